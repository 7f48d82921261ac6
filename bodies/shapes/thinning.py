"""Choose evenly spread points among many, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


def thin_to(points: np.ndarray, fixed: np.ndarray, wanted: float, spacing: float, tries: int = 12) -> np.ndarray:
    """Some of the points (n, dim), as evenly spread as a greedy choice gets them: about `wanted` together with the
    `fixed` ones (k, dim), which they keep away from."""
    if points.shape[1] == 3 and len(fixed):
        points = points[distances(points, fixed, spacing) > 0.75 * spacing]
    both, first = np.vstack([fixed, points]), len(fixed)
    if len(both) <= 1:
        return points
    low, high = 0.3 * spacing, 1.3 * spacing
    radius = (low + high) / 2
    for _ in range(tries):
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
    return means(points, nearest_of(points, chosen, reach)[0], chosen)


def means(points: np.ndarray, owner: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Mean (k, dim) of the points (n, dim) that each of the `chosen` (k, dim) owns by number (n,); itself where there are
    none."""
    points, owner = points[owner >= 0], owner[owner >= 0]
    count = np.bincount(owner, minlength=len(chosen))
    total = np.column_stack([np.bincount(owner, weights=x, minlength=len(chosen)) for x in points.T])
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], chosen)


def gaps(points: np.ndarray, reach: float) -> np.ndarray:
    """Distance (n,) of each of the points (n, dim) to the next one [m], `reach` where that is farther."""
    return np.sqrt(nearest_of(points, points, reach, True)[1])


def nearest(points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """For each of the points (n, dim) the next one (n,), -1 where it is farther than `reach` [m], and its distance (n,)."""
    owner, square = nearest_of(points, points, reach, True)
    return owner, np.sqrt(square)


def distances(points: np.ndarray, chosen: np.ndarray, reach: float) -> np.ndarray:
    """Distance (n,) of the points (n, dim) to the nearest of the `chosen` (k, dim) [m], `reach` where that is farther."""
    return np.sqrt(nearest_of(points, chosen, reach)[1])


@njit(cache=True)
def _apart(points, radius, first):
    """Which points (n, dim) to keep, first come first served, so that no two are closer than radius;
    the `first` ones whatever their distance."""
    n, dim = points.shape
    slots = 64
    while slots < n // 4:
        slots *= 2
    head, following, kept = np.full(slots, -1, np.int32), np.full(n, -1, np.int32), np.zeros(n, np.bool_)
    held, count = np.empty((n, dim)), 0  # side by side, so that they stay in the cache
    cell = np.zeros(3, np.int64)
    deep = 1 if dim == 3 else 0
    turn = np.array([0, -1, 1])
    for i in range(n):
        for k in range(dim):
            cell[k] = int(np.floor(points[i, k] / radius))
        free = True
        for a in turn:  # the own cell first, which mostly holds one already
            for b in turn:
                for c in turn[: 1 + 2 * deep]:
                    if not free:
                        break
                    j = head[slot(cell[0] + a, cell[1] + b, cell[2] + c, slots)]
                    while free and j >= 0:
                        square = 0.0
                        for k in range(dim):
                            square += (points[i, k] - held[j, k]) ** 2
                        free = square >= radius * radius
                        j = following[j]
        if free or i < first:
            here = slot(cell[0], cell[1], cell[2], slots)
            kept[i], following[count], head[here] = True, head[here], count
            for k in range(dim):
                held[count, k] = points[i, k]
            count += 1
    return kept


def solid(points: np.ndarray) -> np.ndarray:
    """Points (n, dim) in space (n, 3): a plane is a space one cell thick."""
    return np.pad(np.ascontiguousarray(points), ((0, 0), (0, 3 - points.shape[1])))


def nearest_of(points, chosen, reach, same=False):
    """For each of the points (n, dim) the nearest of the chosen (k, dim), -1 where none is within reach, and the square
    of its distance, at most that of reach; where both are the `same`, the nearest other one."""
    if len(chosen) == 0 or len(points) == 0:
        return np.full(len(points), -1), np.full(len(points), reach * reach)
    return _nearest(solid(points), solid(chosen), reach, same)


@njit(cache=True)
def hashed(points, size):
    """Cells (n, 3) of points (n, 3), their numbers (n,) sorted by the slots of the cells, and where each slot starts."""
    n, slots = len(points), 1
    while slots < 2 * n:
        slots *= 2
    cell, number, start = np.empty((n, 3), np.int32), np.empty(n, np.int32), np.zeros(slots + 1, np.int32)
    for j in range(n):
        for k in range(3):
            cell[j, k] = int(np.floor(points[j, k] / size))
        number[j] = slot(cell[j, 0], cell[j, 1], cell[j, 2], slots)
        start[number[j] + 1] += 1
    for s in range(slots):
        start[s + 1] += start[s]
    order, filled = np.empty(n, np.int32), start[:-1].copy()
    for j in range(n):
        order[filled[number[j]]] = j
        filled[number[j]] += 1
    return cell, order, start


@njit(cache=True)
def _nearest(points, chosen, reach, same):
    """`nearest_of` cell by cell: what is chosen in and around a cell is gathered once for all points in it. Of two that are
    equally near the first counts."""
    size = 1.5 * reach if same else reach
    chosen_cell, chosen_order, start = hashed(chosen, size)
    cell, order, _ = (chosen_cell, chosen_order, start) if same else hashed(points, size)
    owner, best = np.full(len(points), -1), np.full(len(points), reach * reach)
    u, v, w = np.empty(len(chosen)), np.empty(len(chosen)), np.empty(len(chosen))
    number, count, last = np.empty(len(chosen), np.int32), 0, -1
    for i in order:
        if last < 0 or cell[i, 0] != cell[last, 0] or cell[i, 1] != cell[last, 1] or cell[i, 2] != cell[last, 2]:
            last, count = i, gather(cell[i], chosen_cell, chosen_order, start, chosen, u, v, w, number)
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        square, found = best[i], -1
        for m in range(count):
            d = (x - u[m]) * (x - u[m]) + (y - v[m]) * (y - v[m]) + (z - w[m]) * (z - w[m])
            if d < square and not (same and number[m] == i):
                square, found = d, number[m]
        owner[i], best[i] = found, square
    return owner, best


@njit(cache=True)
def gather(middle, cell, order, start, points, u, v, w, number):
    """Write the coordinates u, v, w and numbers of the points in the cell `middle` (3,) and in those around it; how many."""
    count, slots = 0, len(start) - 1
    for a in range(middle[0] - 1, middle[0] + 2):
        for b in range(middle[1] - 1, middle[1] + 2):
            for c in range(middle[2] - 1, middle[2] + 2):
                here = slot(a, b, c, slots)
                for m in range(start[here], start[here + 1]):
                    j = order[m]
                    if cell[j, 0] == a and cell[j, 1] == b and cell[j, 2] == c:
                        number[count], u[count], v[count], w[count] = j, points[j, 0], points[j, 1], points[j, 2]
                        count += 1
    return count


@njit(cache=True)
def slot(a, b, c, slots):
    """Slot of a cell in the table of `slots`, a power of two (Teschner et al. 2003)."""
    return ((a * 73856093) ^ (b * 19349663) ^ (c * 83492791)) & (slots - 1)
