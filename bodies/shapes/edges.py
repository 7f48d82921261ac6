"""Particles along the convex edges and corners of a layer under a surface, and in tips too narrow for the layer."""

from __future__ import annotations

import numpy as np

from bodies.shapes import thinning
from bodies.shapes.band import Nearest

SHARP = 0.9  # cosine between the normals of two faces that meet in an edge; flatter ones count as smooth
CLOSE = 2.0  # lattice steps from the edge of a deep layer, within which points are looked at
SMOOTH = 0.95  # the same for points a lattice step away


def particles(nearest: Nearest, shallow: np.ndarray, target: float, spacing: float, step: float) -> np.ndarray:
    """Particles (n, dim) at the depth `target` [m] under two faces or more at once, a spacing apart along edges, and in
    the first layer those between them and the tip of an acute edge. `shallow` (m, dim): those points of a lattice of size
    `step` that, moved along the normal to that depth under the nearest face, are not as deep under another."""
    if shallow.shape[1] == 3:  # where they are many
        shallow = _beside_edges(nearest, shallow, target)
    if (
        shallow.shape[1] == 3 and target > spacing and len(shallow)
    ):  # deep: those next to where they are moved are enough
        place, faces = _meet(nearest, shallow, target)
        shallow = shallow[(faces > 0) & (np.linalg.norm(place - shallow, axis=1) < CLOSE * step)]
    if len(shallow) == 0:
        return shallow
    per, dim = max(1, round(8 * step / spacing)), shallow.shape[1]
    part = (np.indices([per] * dim).reshape(dim, -1).T + 0.5) / per - 0.5
    shallow = (shallow[:, None] + part * step).reshape(-1, dim)
    place, faces = _meet(nearest, shallow, target)
    corners = thinning.apart(place[faces == dim], 0.7 * spacing, place[:0])
    chosen = corners
    if dim == 3:
        chosen = _row(nearest, place[faces == 2], corners, spacing, (0.99 * target, 1.01 * target))
    if target < spacing:
        depth, away = -nearest(shallow)[0], np.linalg.norm(place - shallow, axis=1) / spacing
        off = np.abs(away - np.maximum(np.round(away), 1.0))
        tip = np.flatnonzero((faces > 0) & (depth > 0.1 * spacing) & (off < 0.15))
        tips = shallow[tip[np.argsort(np.round(off[tip] / 0.05), kind="stable")]]
        chosen = _row(nearest, tips, chosen, spacing, (0.1 * spacing, target))
    return chosen


def _beside_edges(nearest: Nearest, points: np.ndarray, target: float) -> np.ndarray:
    """Those of the points (n, dim) that a move to the depth `target` [m] brings under another face, by their normals; between
    smooth faces there is no edge to look for."""
    distance, foot = nearest(points)
    normal = inward(points, foot, distance)
    place = foot + target * normal
    distance, foot = nearest(place)
    return points[(normal * inward(place, foot, distance)).sum(axis=1) < SMOOTH]


def _row(
    nearest: Nearest, points: np.ndarray, fixed: np.ndarray, spacing: float, between: tuple[float, float]
) -> np.ndarray:
    """The `fixed` points (k, dim), then some of the points (n, dim), which crowd along lines, about a spacing apart and
    settled between their neighbours at depths that lie `between` two [m]."""
    points = thinning.apart(points, 0.08 * spacing, points[:0])  # equally dense along the lines
    chosen = np.vstack([fixed, thinning.apart(points, 0.9 * spacing, fixed)])
    good, before = (
        np.zeros(len(chosen) - len(fixed), bool),
        np.full((len(chosen) - len(fixed), points.shape[1]), np.nan),
    )
    for _ in range(60 if len(chosen) > len(fixed) else 0):
        centre = thinning.centres(points, chosen, 1.5 * spacing)[len(fixed) :]
        moved = np.flatnonzero((centre != before).any(axis=1))
        if len(moved) == 0:
            break
        depth, before = -nearest(centre[moved])[0], centre
        good[moved] = (depth > between[0]) & (depth < between[1])
        chosen[len(fixed) :][good] = centre[good]
    return chosen


def _meet(nearest: Nearest, points: np.ndarray, target: float) -> tuple[np.ndarray, np.ndarray]:
    """Where the points (n, dim) end when moved to the depth `target` [m] under the nearest face, then that and the next
    one, then three: places (n, dim), and the number of faces (n,), 0 where there is no such place."""
    n, dim = points.shape
    place, faces = points.copy(), np.zeros(n, dtype=int)
    normal, level = np.zeros((n, dim, dim)), np.zeros((n, dim))
    rest = np.arange(n)
    distance, foot = nearest(place)
    for k in range(dim):
        clear = np.abs(distance) > 1e-6 * target
        rest, distance, foot = rest[clear], distance[clear], foot[clear]
        normal[rest, k] = inward(place[rest], foot, distance)
        level[rest, k] = (normal[rest, k] * foot).sum(axis=1) + target
        slope = np.einsum("nik,nk->ni", normal[rest, :k], normal[rest, k])
        rest = rest[np.all(slope < SHARP, axis=1)]
        short = level[rest, : k + 1] - np.einsum("nik,nk->ni", normal[rest, : k + 1], place[rest])
        place[rest] += _least(normal[rest, : k + 1], short)
        distance, foot = nearest(place[rest])
        there = np.abs(distance + target) < 0.01 * target
        faces[rest[there]] = k + 1
        rest, distance, foot = rest[~there], distance[~there], foot[~there]
    faces[faces < 2] = 0
    return place, faces


def _least(normal: np.ndarray, short: np.ndarray) -> np.ndarray:
    """The shortest moves (n, dim) by `short` (n, k) along k unit normals (n, k, dim) at once; none where these lie in a
    plane."""
    if normal.shape[2] == 2:
        return np.einsum("nki,ni->nk", np.linalg.pinv(normal, rcond=1e-3), short)
    if normal.shape[1] == 1:
        return short * normal[:, 0]
    gram = normal @ normal.transpose(0, 2, 1)
    flat = np.linalg.det(gram) < 1e-6  # normals in one plane
    gram[flat] += np.eye(gram.shape[1])
    moves = np.einsum("nik,ni->nk", normal, np.linalg.solve(gram, short[..., None])[..., 0])
    return np.where(flat[:, None], 0.0, moves)


def inward(points: np.ndarray, foot: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) from closest surface points `foot` into the solid; zero for points on the surface."""
    return (foot - points) * np.divide(1.0, distance, out=np.zeros_like(distance), where=distance != 0)[:, None]
