"""The room near the fluid: boundary particles outside it, of dry walls, take no part in a step."""

from __future__ import annotations

import math

import numpy as np

from fsi.compute.jit import exact
from fsi.compute.lanes import claim
from fsi.compute.team import Team
from fsi.particles.cells import whole

FAR, NEAR, HELD = 0, 1, 2  # of a cell: it holds fluid, or one nearby does, or none


@exact
def _mark(counter, bounds, position, low, side, wide, cells):
    """Mark the cells that hold particles, and those up to `wide` cells from them. `cells` has three axes, the last one 1 long
    in two dimensions. Threads that write at once write what one of them would have."""
    dim, place, first, end = position.shape[1], np.zeros(3, np.int64), np.zeros(3, np.int64), np.ones(3, np.int64)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            inside = True
            for d in range(dim):
                x = (position[i, d] - low[d]) / side
                inside &= 0.0 <= x < cells.shape[d]
                place[d] = int(x) if inside else 0
            if not inside or cells[place[0], place[1], place[2]] == HELD:
                continue
            for d in range(dim):
                first[d], end[d] = max(0, place[d] - wide), min(cells.shape[d], place[d] + wide + 1)
            for a in range(first[0], end[0]):
                for b in range(first[1], end[1]):
                    for e in range(first[2], end[2]):
                        cells[a, b, e] = max(cells[a, b, e], NEAR)
            cells[place[0], place[1], place[2]] = HELD


@exact
def _look_up(counter, bounds, position, low, side, cells, found):
    """Whether places are in cells near the fluid; those outside stand for the nearest cells."""
    dim, place = position.shape[1], np.zeros(3, np.int64)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            for d in range(dim):
                place[d] = min(max(int((position[i, d] - low[d]) / side), 0), cells.shape[d] - 1)
            found[i] = cells[place[0], place[1], place[2]] != FAR


class Vicinity:
    """All within `reach` [m] of the fluid, and some up to half as far again, in cells of half the reach; larger ones where
    they would be more than `most`. low, high (dim,): the box that the fluid may be in."""

    def __init__(self, low: np.ndarray, high: np.ndarray, reach: float, most: float, team: Team):
        self._team, self._side = team, reach / 2
        while math.prod((high - low) / self._side + 2) > most:
            self._side *= 2
        self._wide = math.ceil(reach / self._side)
        self._low = low - (self._wide + 1) * self._side
        cells = ((high - self._low) / self._side).astype(int) + self._wide + 2
        self._cells = np.zeros([*cells, 1][:3], np.uint8)

    def holds(self, fluid: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Whether it holds the places (b, dim), for fluid at (n, dim)."""
        grid, found = (self._low, self._side), np.empty(len(places), bool)
        if not len(places):
            return found
        self._cells[:] = FAR
        self._team.run(_mark, whole(len(fluid)), fluid, *grid, self._wide, self._cells)
        self._team.run(_look_up, whole(len(places)), places, *grid, self._cells, found)
        return found
