"""One boundary out of all fixed surfaces: the tank's walls, the bathymetry, the fixed wet geoms, the piston.

Where solids overlap each of them brings particles of its own, and two lattices in one place weigh on the fluid twice. Of
every overlap one solid keeps its particles: the one whose surface the fluid meets. Where that is both or neither, the
earlier in the list keeps them. What then still stands closer than NEAR at a seam goes, and what leaves a hole stays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

NEAR = 0.6  # spacings from which two particles of different solids stand side by side; two layers of one solid have 1
BURIED = 0.05  # spacings that a surface lies inside another solid for the fluid not to meet it
Clearance = Callable[[np.ndarray], np.ndarray]


@dataclass
class Surface:
    """Boundary particles (n, dim) of one fixed solid, and the signed distance to its surface."""

    points: np.ndarray
    clearance: Clearance
    foot: Callable[[np.ndarray], np.ndarray] | None = None  # closest place on the surface, where the solid can tell


def joined(surfaces: Sequence[Surface], spacing: float) -> list[np.ndarray]:
    """Which particles (n,) of each surface to keep; the earlier in the list has the right of way."""
    keep = [np.ones(len(s.points), bool) for s in surfaces]
    reach = {
        (one, other): _in_reach(surfaces[one], surfaces[other], spacing)
        for one, other in permutations(range(len(surfaces)), 2)
    }
    for low, lower in enumerate(surfaces):
        for high, higher in enumerate(surfaces[:low]):
            (ours, inside), (theirs, within) = reach[low, high], reach[high, low]
            if len(ours) and len(theirs):
                _bury(lower, higher, ours[inside], theirs[within], keep[low], keep[high], spacing)
    for low, lower in enumerate(surfaces):
        for high, higher in enumerate(surfaces[:low]):
            ours, theirs = (
                index[keep[side][index]] for (index, _), side in ((reach[low, high], low), (reach[high, low], high))
            )
            if len(ours) and len(theirs):
                close = distances(lower.points[ours], higher.points[theirs], NEAR * spacing) < NEAR * spacing * (
                    1 - 1e-9
                )
                keep[low][ours[close]] = False
    return keep


def unburied(surfaces: Sequence[Surface], depth: float) -> list[np.ndarray]:
    """Which particles (n,) of each surface to keep where they count by weights, which make up for those that stand close
    together: all that fluid may feel, no deeper than `depth` [m] in another solid. Edges between solids stay closed."""
    keep = [np.ones(len(s.points), bool) for s in surfaces]
    for one, other in permutations(range(len(surfaces)), 2):
        if len(surfaces[one].points):
            keep[one] &= surfaces[other].clearance(surfaces[one].points) > -depth
    return keep


def _in_reach(one: Surface, other: Surface, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the particles of one solid that lie inside another, or closer to it than half a spacing, and which of them
    lie inside."""
    if len(one.points) == 0 or len(other.points) == 0:
        return np.empty(0, int), np.empty(0, bool)
    clearance = other.clearance(one.points)
    index = np.flatnonzero(clearance < 0.5 * spacing)
    return index, clearance[index] < 0.0


def _bury(lower: Surface, higher: Surface, ours, theirs, keep_low, keep_high, spacing: float) -> None:
    """Drop what each of two solids hides of the other: `ours` are the particles of the lower inside the higher, `theirs` those
    of the higher inside the lower."""
    for mine, other, index, keep, first in (
        (lower, higher, ours, keep_low, False),
        (higher, lower, theirs, keep_high, True),
    ):
        points = mine.points[index]
        hidden = _foot_inside(mine, other, points, spacing)  # where the fluid does not meet my surface
        meets = ~_foot_inside(other, mine, points, spacing)  # where it meets the other's
        gone = hidden & meets if first else hidden | meets
        keep[index[gone]] = False


def _foot_inside(one: Surface, other: Surface, points: np.ndarray, spacing: float) -> np.ndarray:
    """Whether the place on the surface of `one` that is nearest to the points (n, dim) lies inside `other`."""
    if one.foot is not None:
        return other.clearance(one.foot(points)) < -BURIED * spacing
    step = 0.05 * spacing
    slope = [one.clearance(points + step * e) - one.clearance(points - step * e) for e in np.eye(points.shape[1])]
    foot = points - one.clearance(points)[:, None] * np.stack(slope, 1) / (2 * step)
    return other.clearance(foot) < -BURIED * spacing


def distances(points: np.ndarray, others: np.ndarray, reach: float, itself: bool = False) -> np.ndarray:
    """Distance (n,) of the points (n, dim) to the nearest of the others (k, dim), `reach` where that is farther [m]; with
    `itself`, where the others are the points, to the nearest but itself."""
    best = np.full(len(points), reach)
    for i, j in _beside(points, others, reach):
        found = np.linalg.norm(points[i] - others[j], axis=1)
        best[i] = np.minimum(best[i], np.where(i == j, reach, found) if itself else found)
    return best


def pairs_within(points: np.ndarray, others: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (k,) of the points (n, dim) and (k,) of the others (m, dim) that are within `reach` [m] of each other."""
    found = [(np.empty(0, int), np.empty(0, int)), *_beside(points, others, reach)]
    i, j = (np.concatenate(values) for values in zip(*found, strict=True))
    near = ((points[i] - others[j]) ** 2).sum(1) < reach**2
    return i[near], j[near]


def _beside(points: np.ndarray, others: np.ndarray, reach: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Numbers of points and of others in the same cell of side `reach` or in cells that touch; each point at most once a
    time."""
    if len(points) == 0 or len(others) == 0:
        return
    origin = np.minimum(points.min(0), others.min(0)) - 1.5 * reach
    cell, other_cell = (np.floor((x - origin) / reach).astype(np.int64) for x in (points, others))
    size = np.maximum(cell.max(0), other_cell.max(0)) + 3
    stride = np.cumprod([1, *size[:0:-1]])[::-1]  # in the order of a lattice, so that searches are near
    key = other_cell @ stride
    order = np.argsort(key, kind="stable")
    key = key[order]
    for offset in np.indices([3] * points.shape[1]).reshape(points.shape[1], -1).T - 1:
        wanted = (cell + offset) @ stride
        first, last = np.searchsorted(key, wanted, "left"), np.searchsorted(key, wanted, "right")
        while len(at := np.flatnonzero(first < last)):
            yield at, order[first[at]]
            first[at] += 1
