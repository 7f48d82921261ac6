"""A bounding-box tree over triangles, and what is asked of it: which of them cross, and how they wind around points."""

from __future__ import annotations

import numpy as np

from fsi.compute.jit import exact
from fsi.compute.lanes import load, maximum, sqrt, store

LEAF = WIDE = 8  # triangles in a leaf of the tree, and children of a node that are looked at together
ROUNDING, FAR = 1e-6, 1e18  # of single precision, a few bits; farther than anything, with a square in single precision


def build(corners: np.ndarray) -> tuple[np.ndarray, ...]:
    """Split triangles (m, 3, 3) at the median of the longest side. Order (m,) of the triangles, lower and upper corners (k, 3)
    of the nodes, and link (k, 2): children of a node, or (-first, -end) - 1 of a leaf."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    return _build(low, high, (low + high) / 2)


@exact
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


@exact
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


def bundles(corners: np.ndarray, link: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, ...]:
    """The tree over triangles (m, 3, 3) in its order, with up to WIDE children a node, side by side for vector lanes: cylinders
    around the children of a node or the triangles of a leaf, flat (n 8 WIDE,), the eight numbers of `_drum` about the `origin`
    (3,); their numbers (n, WIDE), and which are leaves (n,). The axis is the mean normal, so that what is nearly flat has a
    flat cylinder. They are in single precision and wider by what that may miss."""
    margin = ROUNDING * float(np.abs(corners - origin).max(initial=0.0))
    drums, child, leaf = _bundles(corners - origin, link, margin)
    return drums.reshape(-1), child, leaf


@exact
def _bundles(corners, link, margin):
    nodes = np.empty((len(link), 8))
    first, end = np.empty(len(link), np.int64), np.empty(len(link), np.int64)
    for node in range(len(link) - 1, -1, -1):  # children come after their parent
        left, right = link[node, 0], link[node, 1]
        first[node], end[node] = (first[left], end[right]) if left >= 0 else (-left - 1, -right - 1)
        _drum(corners, first[node], end[node], margin, nodes[node])
    drums, child = np.zeros((len(link), 8, WIDE), np.float32), np.zeros((len(link), WIDE), np.int64)
    drums[:, 7], leaf = -FAR, np.zeros(len(link), np.bool_)
    pending, own, below = np.empty((len(link), 2), np.int64), np.empty(8), np.empty(WIDE, np.int64)
    pending[0, 0], pending[0, 1], top, count = 0, 0, 1, 1
    while top > 0:
        top -= 1
        node, row = pending[top, 0], pending[top, 1]
        if link[node, 0] < 0:
            leaf[row] = True
            for c, t in enumerate(range(first[node], end[node])):
                _drum(corners, t, t + 1, margin, own)
                drums[row, :, c], child[row, c] = own, t
            continue
        below[0], many = node, 1
        for _ in range(3):
            for c in range(many):
                if link[below[c], 0] >= 0:
                    below[c], below[many] = link[below[c], 0], link[below[c], 1]
                    many += 1
        for c in range(many):
            drums[row, :, c], child[row, c] = nodes[below[c]], count
            pending[top, 0], pending[top, 1] = below[c], count
            top, count = top + 1, count + 1
    return drums[:count].copy(), child[:count].copy(), leaf[:count].copy()


@exact
def _drum(corners, first, end, margin, found):
    """Write centre, axis, half the height and radius (8,) of a cylinder around triangles; it holds their corners, and so all of
    them, whatever its axis."""
    ax = ay = az = 0.0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for t in range(first, end):
        a, b, c = corners[t]
        ax += (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        ay += (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        az += (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        for k in range(3):
            low[k], high[k] = min(low[k], a[k], b[k], c[k]), max(high[k], a[k], b[k], c[k])
    size = np.sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = (ax / size, ay / size, az / size) if size > 0.0 else (0.0, 0.0, 1.0)
    x, y, z = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2
    least, most, radius = np.inf, -np.inf, 0.0
    for t in range(first, end):
        for k in range(3):
            u, v, w = corners[t, k, 0] - x, corners[t, k, 1] - y, corners[t, k, 2] - z
            h = ax * u + ay * v + az * w
            least, most = min(least, h), max(most, h)
            u, v, w = u - h * ax, v - h * ay, w - h * az
            radius = max(radius, u * u + v * v + w * w)
    h = (least + most) / 2
    found[0], found[1], found[2] = x + h * ax, y + h * ay, z + h * az
    found[3], found[4], found[5] = ax, ay, az
    found[6], found[7] = (most - least) / 2 + margin, np.sqrt(radius) + margin


@exact
def to_drums(x, y, z, drums, row, away):
    """Write the squared distances (WIDE,) of a point to the cylinders of a row, see `bundles`, or a little less."""
    i = row * 8 * WIDE
    u, v, w = load(drums, i, WIDE) - x, load(drums, i + WIDE, WIDE) - y, load(drums, i + 2 * WIDE, WIDE) - z
    h = load(drums, i + 3 * WIDE, WIDE) * u + load(drums, i + 4 * WIDE, WIDE) * v + load(drums, i + 5 * WIDE, WIDE) * w
    square = u * u + v * v + w * w
    across = maximum(sqrt(maximum(square - h * h, 0.0)) - load(drums, i + 7 * WIDE, WIDE), 0.0)
    along = maximum(maximum(h, h * -1.0) - load(drums, i + 6 * WIDE, WIDE), 0.0)
    store(away, 0, along * along + across * across - square * ROUNDING)


def crossings(corners: np.ndarray, index: np.ndarray, near: float) -> np.ndarray:
    """Pairs (k, 2) of triangles (m, 3, 3) of which an edge of one runs through the other, by more than `near` of its size;
    index (m, 3) are their vertices, with one number at one place. A few of many are given."""
    order, lower, upper, link = build(corners)
    found = _crossings(corners[order], index[order], lower, upper, link, near)
    return order[found]


@exact
def _crossings(corners, index, lower, upper, link, near):
    """Leaf by leaf against the leaves whose boxes meet its own and that do not come before it."""
    found, count = np.empty((1000, 2), np.int64), 0
    stack = np.empty(256, np.int64)
    lowest, highest = np.empty((len(corners), 3)), np.empty((len(corners), 3))
    for t in range(len(corners)):
        for k in range(3):
            lowest[t, k] = min(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
            highest[t, k] = max(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
    for leaf in range(len(link)):
        if link[leaf, 0] >= 0:
            continue
        first, end = -link[leaf, 0] - 1, -link[leaf, 1] - 1
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if not _meet(lower[leaf], upper[leaf], lower[node], upper[node]):
                continue
            left, right = link[node, 0], link[node, 1]
            if left >= 0:
                stack[top], stack[top + 1] = left, right
                top += 2
                continue
            if -left - 1 < first:
                continue
            for t in range(first, end):
                for u in range(max(-left - 1, t + 1), -right - 1):
                    if count == 1000 or not _meet(lowest[t], highest[t], lowest[u], highest[u]):
                        continue
                    if _neighbours(index[t], index[u]):
                        continue
                    if _pierces(corners[t], corners[u], index[t], index[u], near) or _pierces(
                        corners[u], corners[t], index[u], index[t], near
                    ):
                        found[count, 0], found[count, 1] = t, u
                        count += 1
    return found[:count]


@exact
def _neighbours(a, b):
    """Whether triangles with these vertices (3,) have two in common, so that each edge of one touches the other."""
    shared = 0
    for k in range(3):
        shared += a[k] == b[0] or a[k] == b[1] or a[k] == b[2]
    return shared > 1


@exact
def _meet(low, high, lower, upper):
    apart = False
    for k in range(3):
        apart = apart or low[k] > upper[k] or high[k] < lower[k]
    return not apart


@exact
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


@exact
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
