"""Points that move little by little, and the others around each of them, looked up once for many moves; compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from bodies.shapes.thinning import gather, hashed, nearest_of, solid

FAR, MAY = 2.8, 0.4  # spacings to the others that are kept, and that a point may move before they are looked up anew


class Around:
    """Who is near whom among moving points (k, dim) about a `spacing` [m] apart.

    A point that was nearest to a place less than a spacing away has, after moves of MAY spacings, the new nearest among
    those within FAR spacings of it."""

    def __init__(self, points: np.ndarray, spacing: float):
        self._spacing = spacing
        self._look(points)

    def _look(self, points: np.ndarray) -> None:
        self._seen = points.copy()
        self._start, self._other = _lists(solid(points), FAR * self._spacing)

    def _moved(self, points: np.ndarray) -> bool:
        """Whether the points had to be looked up anew."""
        far = ((points - self._seen) ** 2).sum(axis=1).max(initial=0.0) > (MAY * self._spacing) ** 2
        if far:
            self._look(points)
        return far

    def nearest(self, points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """For each of the points (k, dim) the next one (k,), -1 where it is farther than `reach` [m], at most a spacing, and
        its distance (k,), `reach` where that is farther."""
        self._moved(points)
        owner, square = _next(solid(points), self._start, self._other, reach)
        return owner, np.sqrt(square)

    def owners(self, parts: np.ndarray, points: np.ndarray, before: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Which of the points (k, dim) is nearest to each of the `parts` (n, dim), -1 where none is within one and a half
        spacings, and its distance (n,); `before` (n,) are those before a move, None at first."""
        reach = 1.5 * self._spacing
        if self._moved(points) or before is None:
            owner, square = nearest_of(parts, points, reach)
        else:
            owner, square = _owners(solid(parts), solid(points), before, self._start, self._other, reach)
        return owner, np.sqrt(square)


@njit(cache=True)
def _lists(points, reach):
    """The others within `reach` of each of the points (k, 3): those of point i are other[start[i, 0] : start[i, 1]]."""
    n = len(points)
    cell, order, begin = hashed(points, reach)
    u, v, w, number, last, many = np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int32), -1, 0
    start, other, count = np.zeros((n, 2), np.int64), np.empty(32 * n + 32, np.int32), 0
    for i in order:
        if last < 0 or cell[i, 0] != cell[last, 0] or cell[i, 1] != cell[last, 1] or cell[i, 2] != cell[last, 2]:
            last, many = i, gather(cell[i], cell, order, begin, points, u, v, w, number)
        if count + many > len(other):
            other = np.concatenate((other, np.empty(len(other) + many, np.int32)))
        start[i, 0] = count
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for m in range(many):
            square = (x - u[m]) * (x - u[m]) + (y - v[m]) * (y - v[m]) + (z - w[m]) * (z - w[m])
            other[count] = number[m]
            count += 1 if square < reach * reach and number[m] != i else 0
        start[i, 1] = count
    return start, other[:count].copy()


@njit(cache=True)
def _next(points, start, other, reach):
    owner, best = np.full(len(points), -1), np.full(len(points), reach * reach)
    for i in range(len(points)):
        for m in range(start[i, 0], start[i, 1]):
            j = other[m]
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            square = x * x + y * y + z * z
            if square < best[i]:
                owner[i], best[i] = j, square
    return owner, best


@njit(cache=True)
def _owners(parts, points, before, start, other, reach):
    owner, best = before.copy(), np.full(len(parts), reach * reach)
    for i in range(len(parts)):
        own = before[i]
        if own < 0:
            continue
        x, y, z = parts[i, 0], parts[i, 1], parts[i, 2]
        nearest = (x - points[own, 0]) ** 2 + (y - points[own, 1]) ** 2 + (z - points[own, 2]) ** 2
        for m in range(start[own, 0], start[own, 1]):
            j = other[m]
            square = (x - points[j, 0]) ** 2 + (y - points[j, 1]) ** 2 + (z - points[j, 2]) ** 2
            if square < nearest:
                nearest, owner[i] = square, j
        best[i] = nearest
    return owner, best
