"""Distances near a surface from few exact ones: on the nodes of a lattice, and by their tangent planes where it is flat."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

Nearest = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # points -> (signed distance, closest surface point)

FLAT = 0.1  # cells that a node's plane may miss the distances around it: curved by 15 cells or more
MOST = 2**26  # nodes of the box around the lattice, from which on every point is answered by `nearest`


class Band:
    """Signed distance and closest surface point, as `nearest` gives them, of points among the nodes (n, 3) of a cubic lattice
    with cells of a `size` [m], whose exact `distance` (n,) and `foot` (n, 3) are known.

    The lattice has all nodes whose distance lies between the two of `within`. A node is flat where its plane meets the
    distances at all nodes around it to FLAT cells, and tells of those that the lattice lacks that they lie beyond. Points in
    its cell, for which the plane errs by a quarter of that at most, are answered by the plane; all others by `nearest`."""

    def __init__(
        self,
        nearest: Nearest,
        nodes: np.ndarray,
        distance: np.ndarray,
        foot: np.ndarray,
        size: float,
        within: tuple[float, float],
    ):
        self.exact, self._size, self._distance = nearest, size, distance
        self._low = nodes.min(axis=0)
        place = np.round((nodes - self._low) / size).astype(np.int64)
        shape = place.max(axis=0) + 1
        self._nodes = self._low + place * size
        self._index = None
        if shape.prod() > MOST:
            return
        self._index = np.full(shape, -1, np.int32)
        self._index[tuple(place.T)] = np.arange(len(nodes))
        away = np.divide(1.0, distance, out=np.zeros_like(distance), where=np.abs(distance) > 1e-3 * size)
        self._outward = (nodes - foot) * away[:, None]
        flat = _flat(self._index, place, self._outward, distance, size, FLAT * size, *within)
        self._index[tuple(place[~flat].T)] = -1

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.ascontiguousarray(points)
        if self._index is None:
            return self.exact(points)
        distance, foot, rest = _planes(
            points, self._index, self._low, self._size, self._nodes, self._outward, self._distance
        )
        if len(rest):
            distance[rest], foot[rest] = self.exact(points[rest])
        return distance, foot


@njit(cache=True)
def _flat(index, place, outward, distance, size, most, least, largest):
    """Which nodes (n,) have a plane that meets the distances at the nodes around them to within `most` [m], and puts nodes
    that are not there beyond the distances from `least` to `largest`."""
    flat = np.ones(len(place), np.bool_)
    for i in range(len(place)):
        a, b, c = place[i]
        normal = outward[i]
        good = normal[0] != 0.0 or normal[1] != 0.0 or normal[2] != 0.0
        for p in range(a - 1, a + 2):
            for q in range(b - 1, b + 2):
                for r in range(c - 1, c + 2):
                    inside = 0 <= p < index.shape[0] and 0 <= q < index.shape[1] and 0 <= r < index.shape[2]
                    j = index[p, q, r] if inside else -1
                    plane = distance[i] + size * ((p - a) * normal[0] + (q - b) * normal[1] + (r - c) * normal[2])
                    if j >= 0:
                        good = good and abs(plane - distance[j]) < most
                    else:
                        good = good and (plane < least + most or plane > largest - most)
        flat[i] = good
    return flat


@njit(cache=True)
def _planes(points, index, low, size, nodes, outward, distance):
    """Distance (n,) and foot (n, 3) of points (n, 3) by the planes of the nodes next to them, and the numbers of the points
    without one."""
    n = len(points)
    away, foot, rest, count = np.empty(n), np.empty((n, 3)), np.empty(n, np.int64), 0
    for i in range(n):
        a = int(np.floor((points[i, 0] - low[0]) / size + 0.5))
        b = int(np.floor((points[i, 1] - low[1]) / size + 0.5))
        c = int(np.floor((points[i, 2] - low[2]) / size + 0.5))
        inside = 0 <= a < index.shape[0] and 0 <= b < index.shape[1] and 0 <= c < index.shape[2]
        j = index[a, b, c] if inside else -1
        if j < 0:
            rest[count] = i
            count += 1
            continue
        d = distance[j]
        for k in range(3):
            d += outward[j, k] * (points[i, k] - nodes[j, k])
        away[i] = d
        for k in range(3):
            foot[i, k] = points[i, k] - outward[j, k] * d
    return away, foot, rest[:count].copy()
