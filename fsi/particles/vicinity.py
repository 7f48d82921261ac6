"""The room near the fluid: boundary particles outside it, of dry walls, take no part in a step."""

from __future__ import annotations

import math

import numpy as np

from fsi.compute.jit import exact
from fsi.compute.lanes import claim
from fsi.compute.team import Team
from fsi.particles.cells import whole


@exact
def _mark(counter, bounds, position, low, side, marked):
    """Mark the cells that hold particles; `marked` has three axes, the last ones 1 long where there are fewer."""
    dim, place = position.shape[1], np.zeros(3, np.int64)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            inside = True
            for d in range(dim):
                x = (position[i, d] - low[d]) / side
                inside &= 0.0 <= x < marked.shape[d]
                place[d] = int(x) if inside else 0
            if inside:
                marked[place[0], place[1], place[2]] = 1


@exact
def _look_up(counter, bounds, position, low, side, marked, found):
    """Whether the cells of places are marked; those outside stand for the nearest ones."""
    dim, place = position.shape[1], np.zeros(3, np.int64)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            for d in range(dim):
                place[d] = min(max(int((position[i, d] - low[d]) / side), 0), marked.shape[d] - 1)
            found[i] = marked[place[0], place[1], place[2]]


class Vicinity:
    """All within `reach` [m] of the fluid, and some farther off, in cells that are no more than `most`; low, high (dim,): the
    box that the fluid may be in."""

    def __init__(self, low: np.ndarray, high: np.ndarray, reach: float, most: float, team: Team):
        self._team, self._side = team, reach / 4
        while math.prod((high - low) / self._side + 2) > most and self._side < reach:
            self._side *= 2
        self._wide = math.ceil(reach / self._side)
        self._low = low - (self._wide + 1) * self._side
        cells = ((high - self._low) / self._side).astype(int) + self._wide + 2
        self._marked = np.zeros([*cells, 1][:3], np.uint8)

    def holds(self, fluid: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Whether it holds the places (b, dim), for fluid at (n, dim)."""
        marked, found = self._marked, np.empty(len(places), bool)
        marked[:] = 0
        self._team.run(_mark, whole(len(fluid)), fluid, self._low, self._side, marked)
        for axis in range(len(self._low)):
            along = np.moveaxis(marked, axis, 0)
            for _ in range(self._wide):
                beside = along[:-2] | along[2:]
                along[1:-1] |= beside
        self._team.run(_look_up, whole(len(places)), places, self._low, self._side, marked, found)
        return found
