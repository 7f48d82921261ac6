"""A bounding-box tree over triangles, and what is asked of it: which of them cross, and how they wind around points."""

from __future__ import annotations

import numpy as np
from numba import njit

LEAF = 8  # triangles in a leaf of the tree


def build(corners: np.ndarray) -> tuple[np.ndarray, ...]:
    """Split triangles (m, 3, 3) at the median of the longest side. Order (m,) of the triangles, lower and upper corners (k, 3)
    of the nodes, and link (k, 2): children of a node, or (-first, -end) - 1 of a leaf."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    return _build(low, high, (low + high) / 2)


@njit(cache=True)
def _build(low, high, centre):
    n = len(low)
    order = np.arange(n)
    most = 2 * n + 1
    lower, upper, link = np.empty((most, 3)), np.empty((most, 3)), np.empty((most, 2), np.int64)
    pending = np.empty((256, 3), np.int64)
    pending[0, 0], pending[0, 1], pending[0, 2] = 0, 0, n
    top, count = 1, 1
    while top > 0:
        top -= 1
        node, first, end = pending[top, 0], pending[top, 1], pending[top, 2]
        longest = 0
        for k in range(3):
            a, b = np.inf, -np.inf
            for i in range(first, end):
                a, b = min(a, low[order[i], k]), max(b, high[order[i], k])
            lower[node, k], upper[node, k] = a, b
            if b - a > upper[node, longest] - lower[node, longest]:
                longest = k
        if end - first <= LEAF:
            link[node, 0], link[node, 1] = -first - 1, -end - 1
            continue
        middle = (first + end) // 2
        _select(order, centre, longest, first, end - 1, middle)
        link[node, 0], link[node, 1] = count, count + 1
        pending[top, 0], pending[top, 1], pending[top, 2] = count, first, middle
        pending[top + 1, 0], pending[top + 1, 1], pending[top + 1, 2] = count + 1, middle, end
        top, count = top + 2, count + 2
    return order, lower[:count].copy(), upper[:count].copy(), link[:count].copy()


@njit(cache=True)
def _select(order, centre, axis, left, right, middle):
    """Hoare's selection: no key before `middle` is above the one there, none after it below."""
    while left < right:
        pivot = centre[order[(left + right) // 2], axis]
        i, j = left, right
        while i <= j:
            while centre[order[i], axis] < pivot:
                i += 1
            while centre[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            return


def crossings(corners: np.ndarray, index: np.ndarray, near: float) -> np.ndarray:
    """Pairs (k, 2) of triangles (m, 3, 3) of which an edge of one runs through the other, by more than `near` of its size;
    index (m, 3) are their vertices, with one number at one place. A few of many are given."""
    order, lower, upper, link = build(corners)
    found = _crossings(corners[order], index[order], lower, upper, link, near)
    return order[found]


@njit(cache=True)
def _crossings(corners, index, lower, upper, link, near):
    found, count = np.empty((1000, 2), np.int64), 0
    stack = np.empty(256, np.int64)
    lowest, highest = np.empty((len(corners), 3)), np.empty((len(corners), 3))
    for t in range(len(corners)):
        for k in range(3):
            lowest[t, k] = min(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
            highest[t, k] = max(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
    for t in range(len(corners)):
        low, high = lowest[t], highest[t]
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if not _meet(low, high, lower[node], upper[node]):
                continue
            left, right = link[node, 0], link[node, 1]
            if left >= 0:
                stack[top], stack[top + 1] = left, right
                top += 2
                continue
            for u in range(-left - 1, -right - 1):
                near_enough = u != t and count < 1000 and _meet(low, high, lowest[u], highest[u])
                if near_enough and _pierces(corners[t], corners[u], index[t], index[u], near):
                    found[count, 0], found[count, 1] = t, u
                    count += 1
    return found[:count]


@njit(cache=True)
def _meet(low, high, lower, upper):
    apart = False
    for k in range(3):
        apart = apart or low[k] > upper[k] or high[k] < lower[k]
    return not apart


@njit(cache=True)
def _pierces(a, b, ia, ib, near):
    """Whether an edge of triangle a that has no corner in common with triangle b runs through b."""
    e1x, e1y, e1z = b[1, 0] - b[0, 0], b[1, 1] - b[0, 1], b[1, 2] - b[0, 2]
    e2x, e2y, e2z = b[2, 0] - b[0, 0], b[2, 1] - b[0, 1], b[2, 2] - b[0, 2]
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    area = np.sqrt(nx * nx + ny * ny + nz * nz)
    if area == 0.0:
        return False
    size = np.sqrt(area)
    for k in range(3):
        m = (k + 1) % 3
        shared = False
        for c in range(3):
            shared = shared or ia[k] == ib[c] or ia[m] == ib[c]
        if shared:
            continue
        px, py, pz = a[k, 0] - b[0, 0], a[k, 1] - b[0, 1], a[k, 2] - b[0, 2]
        qx, qy, qz = a[m, 0] - b[0, 0], a[m, 1] - b[0, 1], a[m, 2] - b[0, 2]
        d, e = (px * nx + py * ny + pz * nz) / area, (qx * nx + qy * ny + qz * nz) / area
        if d * e >= 0.0 or min(abs(d), abs(e)) < near * size:
            continue
        s = d / (d - e)
        rx, ry, rz = px + s * (qx - px), py + s * (qy - py), pz + s * (qz - pz)
        cx, cy, cz = ry * e2z - rz * e2y, rz * e2x - rx * e2z, rx * e2y - ry * e2x
        v = (cx * nx + cy * ny + cz * nz) / (area * area)
        cx, cy, cz = e1y * rz - e1z * ry, e1z * rx - e1x * rz, e1x * ry - e1y * rx
        w = (cx * nx + cy * ny + cz * nz) / (area * area)
        if v > near and w > near and v + w < 1.0 - near:
            return True
    return False


@njit(cache=True)
def winding(points, corners):
    """How often closed triangles (m, 3, 3) wind around points (n, 3), by solid angles (van Oosterom & Strackee 1983,
    doi:10.1109/TBME.1983.325207)."""
    result = np.zeros(len(points))
    for i in range(len(points)):
        total = 0.0
        for t in range(len(corners)):
            ax, ay, az = (
                corners[t, 0, 0] - points[i, 0],
                corners[t, 0, 1] - points[i, 1],
                corners[t, 0, 2] - points[i, 2],
            )
            bx, by, bz = (
                corners[t, 1, 0] - points[i, 0],
                corners[t, 1, 1] - points[i, 1],
                corners[t, 1, 2] - points[i, 2],
            )
            cx, cy, cz = (
                corners[t, 2, 0] - points[i, 0],
                corners[t, 2, 1] - points[i, 1],
                corners[t, 2, 2] - points[i, 2],
            )
            a = np.sqrt(ax * ax + ay * ay + az * az)
            b = np.sqrt(bx * bx + by * by + bz * bz)
            c = np.sqrt(cx * cx + cy * cy + cz * cz)
            triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            total += np.arctan2(triple, a * b * c + ab * c + bc * a + ca * b)
        result[i] = total / (2 * np.pi)
    return result
