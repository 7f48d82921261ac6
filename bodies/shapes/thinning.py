"""Choose evenly spread points among many, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


def thin_to(points: np.ndarray, fixed: np.ndarray, wanted: float, spacing: float) -> np.ndarray:
    """Some of the points (n, dim), as evenly spread as a greedy choice gets them: about `wanted` together with the
    `fixed` ones (k, dim), which they keep away from."""
    if points.shape[1] == 3 and len(fixed):
        points = points[distances(points, fixed, spacing) > 0.75 * spacing]
    both, first = np.vstack([fixed, points]), len(fixed)
    if len(both) <= 1:
        return points
    low, high = 0.3 * spacing, 1.3 * spacing
    radius = (low + high) / 2
    for _ in range(12):
        kept = _apart(both, radius, first)
        if abs(kept.sum() - wanted) <= 0.005 * wanted:
            break
        low, high = (radius, high) if kept.sum() > wanted else (low, radius)
        radius = _next_radius(radius, kept.sum() - len(fixed), wanted - len(fixed), low, high, points.shape[1])
    return points[kept[first:]]


def _next_radius(radius: float, kept: int, wanted: float, low: float, high: float, dim: int) -> float:
    """In space a layer holds as many as go with the inverse square of the radius; else, and where that leads out of the
    bounds, the middle between them."""
    if dim == 3 and wanted > 0:
        guess = radius * np.sqrt(kept / wanted)
        if low < guess < high:
            return guess
    return (low + high) / 2


def apart(points: np.ndarray, radius: float, fixed: np.ndarray) -> np.ndarray:
    """The points (n, dim), first come first served, that are `radius` [m] from each other and from the `fixed` ones
    (k, dim)."""
    return points[_apart(np.vstack([fixed, points]), radius, len(fixed))[len(fixed) :]]


def centres(points: np.ndarray, chosen: np.ndarray, reach: float) -> np.ndarray:
    """Mean (k, dim) of the points (n, dim) that are nearer to each of the `chosen` (k, dim) than to the others, within
    `reach` [m]; the chosen one itself where there is none."""
    owner = _search(points, chosen, reach, False)[0]
    points, owner = points[owner >= 0], owner[owner >= 0]
    count = np.bincount(owner, minlength=len(chosen))
    total = np.column_stack([np.bincount(owner, weights=x, minlength=len(chosen)) for x in points.T])
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], chosen)


def gaps(points: np.ndarray, reach: float) -> np.ndarray:
    """Distance (n,) of each of the points (n, dim) to the next one [m], `reach` where that is farther."""
    return np.sqrt(_search(points, points, reach, True)[1])


def nearest(points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """For each of the points (n, dim) the next one (n,), -1 where it is farther than `reach` [m], and its distance (n,)."""
    owner, square = _search(points, points, reach, True)
    return owner, np.sqrt(square)


def distances(points: np.ndarray, chosen: np.ndarray, reach: float) -> np.ndarray:
    """Distance (n,) of the points (n, dim) to the nearest of the `chosen` (k, dim) [m], `reach` where that is farther."""
    return np.sqrt(_search(points, chosen, reach, False)[1])


@njit(cache=True)
def _apart(points, radius, first):
    """Which points (n, dim) to keep, first come first served, so that no two are closer than radius;
    the `first` ones whatever their distance."""
    n, dim = points.shape
    slots = 1
    while slots < 2 * n:
        slots *= 2
    head, following, kept = np.full(slots, -1), np.full(n, -1), np.zeros(n, np.bool_)
    cell = np.zeros(3, np.int64)
    deep = 1 if dim == 3 else 0
    for i in range(n):
        for k in range(dim):
            cell[k] = int(np.floor(points[i, k] / radius))
        free = True
        for a in range(-1, 2):
            for b in range(-1, 2):
                for c in range(-deep, deep + 1):
                    j = head[_slot(cell[0] + a, cell[1] + b, cell[2] + c, slots)]
                    while free and j >= 0:
                        square = 0.0
                        for k in range(dim):
                            square += (points[i, k] - points[j, k]) ** 2
                        free = square >= radius * radius
                        j = following[j]
        if free or i < first:
            slot = _slot(cell[0], cell[1], cell[2], slots)
            kept[i], following[i], head[slot] = True, head[slot], i
    return kept


def _search(points, chosen, reach, same):
    """For each of the points (n, dim) the nearest of the chosen (k, dim), -1 where none is within reach, and the square
    of its distance, at most that of reach; where both are the `same`, the nearest other one."""
    if len(chosen) == 0 or len(points) == 0:
        return np.full(len(points), -1), np.full(len(points), reach * reach)
    deep = [(0, 3 - points.shape[1])]  # a plane is a space one cell thick
    points, chosen = (np.pad(np.ascontiguousarray(x), ((0, 0), *deep)) for x in (points, chosen))
    size, low = reach if same else 0.75 * reach, chosen.min(axis=0)
    count = np.floor((chosen.max(axis=0) - low) / size).astype(np.int64) + 1
    while count.prod() > 8 * len(chosen) + 4096:  # a sparse cloud: larger cells
        size *= 1.5
        count = np.floor((chosen.max(axis=0) - low) / size).astype(np.int64) + 1
    cell = np.floor((chosen - low) / size).astype(np.int64)
    number = (cell[:, 0] * count[1] + cell[:, 1]) * count[2] + cell[:, 2]
    order = np.argsort(number, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=count.prod()))])
    return _nearest(points, chosen[order], order, start, low, count, size, reach, same)


@njit(cache=True)
def _nearest(points, chosen, order, start, low, count, size, reach, same):
    """`_search` in cells of three quarters of the reach or more: first those around a point, then all within reach. `chosen`
    are sorted by cell."""
    owner, best = np.full(len(points), -1), np.full(len(points), reach * reach)
    far = int(np.ceil(reach / size))
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        a, b = int(np.floor((x - low[0]) / size)), int(np.floor((y - low[1]) / size))
        c = int(np.floor((z - low[2]) / size))
        square, found, wide = best[i], -1, 1
        while True:
            for k in range(max(a - wide, 0), min(a + wide + 1, count[0])):
                for m in range(max(b - wide, 0), min(b + wide + 1, count[1])):
                    first, last = max(c - wide, 0), min(c + wide, count[2] - 1)
                    if first > last:
                        continue
                    row = (k * count[1] + m) * count[2]
                    for j in range(start[row + first], start[row + last + 1]):
                        d = (x - chosen[j, 0]) ** 2 + (y - chosen[j, 1]) ** 2 + (z - chosen[j, 2]) ** 2
                        if d < square and not (same and order[j] == i):
                            square, found = d, order[j]
            if wide >= far or (found >= 0 and square <= size * size):
                break
            wide = far
        owner[i], best[i] = found, square
    return owner, best


@njit(cache=True)
def _slot(a, b, c, slots):
    """Slot of a cell in the table of `slots`, a power of two (Teschner et al. 2003)."""
    return ((a * 73856093) ^ (b * 19349663) ^ (c * 83492791)) & (slots - 1)
