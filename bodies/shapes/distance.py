"""Signed distance and closest point to a closed triangle mesh (3D) or to closed polygons (2D), compiled.

The sign in 3D is that of the angle-weighted pseudonormal at the closest point (Baerentzen & Aanaes 2005,
doi:10.1109/TVCG.2005.49), which is exact for closed meshes; in 2D it is even-odd parity.
"""

from __future__ import annotations

import numpy as np

from bodies.shapes import tree
from bodies.shapes.shells import merged
from bodies.shapes.tree import WIDE, to_drums
from fsi.compute.jit import exact


class TriangleTree:
    """Tree over a closed mesh with outward triangles: vertices (n, 3), triangles (m, 3)."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        corners = vertices[triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        triangles, corners = triangles[area > 0], corners[area > 0]
        order, _, _, link = tree.build(corners)
        self._corners = np.ascontiguousarray(corners[order])
        self._origin = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        self._tree = tree.bundles(self._corners, link, self._origin)
        self._normals = _pseudonormals(vertices, triangles)[order]

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), negative inside, and closest surface point (n, 3) of points (n, 3)."""
        points = np.ascontiguousarray(points, dtype=float)
        return _nearest_triangle(points, self._corners, self._normals, self._origin, *self._tree)


def _pseudonormals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Outward normals (m, 7, 3) of each triangle: its face, its edges ab, bc, ca, its corners a, b, c."""
    index = merged(vertices)[triangles]
    corners = vertices[triangles]
    side = np.roll(corners, -1, axis=1) - corners
    face = np.cross(side[:, 0], side[:, 1])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-300)
    length = np.maximum(np.linalg.norm(side, axis=2), 1e-300)
    cosine = -np.einsum("tkc,tkc->tk", side, np.roll(side, 1, axis=1)) / (length * np.roll(length, 1, axis=1))
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    at_vertex = np.zeros((index.max() + 1, 3))
    weights = angle[:, :, None] * face[:, None]
    for axis in range(3):
        at_vertex[:, axis] = np.bincount(index.ravel(), weights[:, :, axis].ravel(), len(at_vertex))
    ends = np.sort(np.stack([index, np.roll(index, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, edge = np.unique(ends[:, 0] * (index.max() + 1) + ends[:, 1], return_inverse=True)
    edge = edge.reshape(-1, 3)
    at_edge = np.zeros((edge.max() + 1, 3))
    for axis in range(3):
        at_edge[:, axis] = np.bincount(edge.ravel(), np.repeat(face[:, axis], 3), len(at_edge))
    return np.concatenate([face[:, None], at_edge[edge], at_vertex[index]], axis=1)


@exact
def _minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact
def _along(a, b, s):
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@exact
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@exact
def _row(array, i):
    return array[i, 0], array[i, 1], array[i, 2]


@exact
def _closest_on_triangle(p, a, b, c):
    """Closest point of a triangle, and the feature it lies on: 0 face, 1-3 edges, 4-6 corners (Ericson 2005, 5.1.5)."""
    ab, ac = _minus(b, a), _minus(c, a)
    ap, bp, cp = _minus(p, a), _minus(p, b), _minus(p, c)
    d1, d2, d3, d4, d5, d6 = _dot(ab, ap), _dot(ac, ap), _dot(ab, bp), _dot(ac, bp), _dot(ab, cp), _dot(ac, cp)
    if d1 <= 0.0 and d2 <= 0.0:
        return a, 4
    if d3 >= 0.0 and d4 <= d3:
        return b, 5
    if d6 >= 0.0 and d5 <= d6:
        return c, 6
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _along(a, ab, d1 / (d1 - d3)), 1
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        return _along(b, _minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6))), 2
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return _along(a, ac, d2 / (d2 - d6)), 3
    scale = 1.0 / (va + vb + vc)
    return _along(_along(a, ab, vb * scale), ac, vc * scale), 0


@exact
def _corner(corners, t, k):
    return corners[t, k, 0], corners[t, k, 1], corners[t, k, 2]


@exact
def _nearest_triangle(points, corners, normals, origin, drums, child, leaf):
    distance, closest = np.empty(len(points)), np.empty((len(points), 3))
    stack, away, lanes = np.empty(256, np.int64), np.empty(256), np.empty(WIDE, np.float32)
    triangle = 0
    for i in range(len(points)):
        p = _row(points, i)
        foot, feature = _closest_on_triangle(  # of the last point's triangle: most likely near
            p, _corner(corners, triangle, 0), _corner(corners, triangle, 1), _corner(corners, triangle, 2)
        )
        gap = _minus(p, foot)
        best = _dot(gap, gap)
        x, y, z = p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]
        stack[0], away[0], top = 0, 0.0, 1
        while top > 0:
            top -= 1
            row = stack[top]
            if away[top] >= best:
                continue
            to_drums(x, y, z, drums, row, lanes)
            if leaf[row]:
                for c in range(WIDE):
                    if lanes[c] >= best:
                        continue
                    t = child[row, c]
                    q, kind = _closest_on_triangle(
                        p, _corner(corners, t, 0), _corner(corners, t, 1), _corner(corners, t, 2)
                    )
                    gap = _minus(p, q)
                    if _dot(gap, gap) < best:
                        best, triangle, feature, foot = _dot(gap, gap), t, kind, q
                continue
            below, least = top, top
            for c in range(WIDE):
                if lanes[c] < best:
                    stack[top], away[top] = child[row, c], lanes[c]
                    least = top if away[top] < away[least] else least
                    top += 1
            if top > below:  # the nearest first
                last = top - 1
                stack[least], stack[last] = stack[last], stack[least]
                away[least], away[last] = away[last], away[least]
        n = (normals[triangle, feature, 0], normals[triangle, feature, 1], normals[triangle, feature, 2])
        outside = _dot(_minus(p, foot), n) >= 0.0
        distance[i] = np.sqrt(best) if outside else -np.sqrt(best)
        closest[i, 0], closest[i, 1], closest[i, 2] = foot
    return distance, closest


GROUP = 16  # segments that are passed over at once


@exact
def nearest_segment(points, start, end):
    """Signed distance (n,), negative inside, and closest point (n, 2) of points (n, 2) to closed polygons given by
    their segments, start (m, 2) to end (m, 2) in any order; fastest where neighbours follow each other."""
    groups = (len(start) + GROUP - 1) // GROUP
    low, high, away = np.empty((groups, 2)), np.empty((groups, 2)), np.empty(groups)
    for g in range(groups):
        for d in range(2):
            part = slice(g * GROUP, min((g + 1) * GROUP, len(start)))
            low[g, d] = min(start[part, d].min(), end[part, d].min())
            high[g, d] = max(start[part, d].max(), end[part, d].max())
    distance, closest = np.empty(len(points)), np.empty((len(points), 2))
    for i in range(len(points)):
        x, z = points[i]
        nearest = 0
        for g in range(groups):
            beside = max(low[g, 0] - x, x - high[g, 0], 0.0)
            over = max(low[g, 1] - z, z - high[g, 1], 0.0)
            away[g] = beside * beside + over * over
            nearest = g if away[g] < away[nearest] else nearest
        best, which, inside = np.inf, -1, False
        for turn in range(groups + 1):  # the nearest group first, which spares most of the others
            g = nearest if turn == 0 else turn - 1
            first = turn == 0
            crossed = not first and low[g, 1] <= z < high[g, 1] and x < high[g, 0]
            if not crossed and (away[g] > best or (not first and g == nearest)):
                continue
            for k in range(g * GROUP, min((g + 1) * GROUP, len(start))):
                ax, az, bx, bz = start[k, 0], start[k, 1], end[k, 0], end[k, 1]
                dx, dz = bx - ax, bz - az
                s = ((x - ax) * dx + (z - az) * dz) / max(dx * dx + dz * dz, 1e-300)
                s = min(max(s, 0.0), 1.0)
                qx, qz = ax + s * dx, az + s * dz
                square = (x - qx) ** 2 + (z - qz) ** 2
                if square < best or (square == best and k < which):
                    best, which = square, k
                    closest[i, 0], closest[i, 1] = qx, qz
                if crossed and (az > z) != (bz > z) and x < ax + (z - az) / (bz - az) * dx:
                    inside = not inside
        distance[i] = -np.sqrt(best) if inside else np.sqrt(best)
    return distance, closest
