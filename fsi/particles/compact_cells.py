"""Cells without a grid: only those that hold particles are kept, so that empty space costs no memory.

The order is that of `fsi.particles.cells`: by layer (z), pencil (y), cell along the pencil (x), and before within a cell; it
comes from a stable counting sort along each axis in turn. What a dense grid looks up in an array of all cells is found here by
binary search: the pencils of a layer are in order of y, and the used cells of a pencil in order of x. Memory is O(N + n + L), N
particles, n used cells, L layers between the lowest and the highest particle (Ihmsen et al. 2011 need a hash table besides).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsi.compute.jit import exact, helper
from fsi.compute.lanes import at, claim
from fsi.compute.team import Team
from fsi.particles.cells import Grid

OUTSIDE = 2**31 - 1  # index of a particle outside the domain


class Index(NamedTuple):
    """The used cells, all int32. Layer k holds the pencils layer[k - low] to layer[k - low + 1]; pencil p stands at y cell
    pencil[p] and holds the used cells cells[p] to cells[p + 1]; used cell c stands at x cell x[c] and holds the particles
    start[c] to start[c + 1]; low (1,): the lowest layer."""

    low: np.ndarray
    layer: np.ndarray
    pencil: np.ndarray
    cells: np.ndarray
    x: np.ndarray
    start: np.ndarray


@helper()
def first_at_least(values, low, high, wanted):
    """The first place from `low` on whose value is not below `wanted`, `high` if none."""
    while low < high:
        middle = (low + high) // 2
        if at(values, middle) < wanted:
            low = middle + 1
        else:
            high = middle
    return low


@helper()
def between(index, shape, ky, kz, x0, x1):
    """First and end of the particles in the cells x0 to x1 of a pencil."""
    low, layer, pencil, cells, x, start = index
    kz -= low[0]
    if kz < 0 or kz >= layer.size - 1:
        return 0, 0
    last = at(layer, kz + 1)
    p = first_at_least(pencil, at(layer, kz), last, ky)
    if p == last or at(pencil, p) != ky:
        return 0, 0
    end = at(cells, p + 1)
    a = first_at_least(x, at(cells, p), end, x0)
    return at(start, a), at(start, first_at_least(x, a, end, x1 + 1))


@helper()
def pencil_of(index, shape, place):
    """The pencil that holds the particle at this place of the order."""
    low, high = 0, index[2].size
    while low < high:
        middle = (low + high) // 2
        if pencil_end(index, shape, middle) <= place:
            low = middle + 1
        else:
            high = middle
    return low


@helper()
def pencil_end(index, shape, pencil):
    """The end of a pencil in the order."""
    _, _, _, cells, _, start = index
    return at(start, at(cells, pencil + 1))


@exact
def _places(counter, bounds, position, lower, low, high, cell, places, ranges):
    """Cell (axes, n) of each particle along each axis, and per chunk the lowest and the highest of them."""
    dim = position.shape[1]
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for d in range(dim):
            ranges[c, d, 0], ranges[c, d, 1] = OUTSIDE, -1
        for i in range(bounds[c], bounds[c + 1]):
            inside = True
            for d in range(dim - 1, -1, -1):
                x = position[i, d]
                if not (low[d] <= x <= high[d]):
                    inside = False
                    break
                places[d, i] = int((x - lower[d]) / cell[min(d, 1)])
            for d in range(dim):
                if inside:
                    ranges[c, d, 0] = min(ranges[c, d, 0], places[d, i])
                    ranges[c, d, 1] = max(ranges[c, d, 1], places[d, i])
                else:
                    places[d, i] = OUTSIDE


@exact
def _count(counter, bounds, order, places, low, counts):
    """How many particles of each chunk of the order stand at each place; those outside behind all others."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        counts[c] = 0
        for k in range(bounds[c], bounds[c + 1]):
            counts[c, min(places[order[k]] - low, counts.shape[1] - 1)] += 1


@exact
def _offsets(counts):
    total = 0
    for place in range(counts.shape[1]):
        for c in range(counts.shape[0]):
            n = counts[c, place]
            counts[c, place] = total
            total += n
    return total


@exact
def _move(counter, bounds, order, places, low, counts, target):
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for k in range(bounds[c], bounds[c + 1]):
            place = min(places[order[k]] - low, counts.shape[1] - 1)
            target[counts[c, place]] = order[k]
            counts[c, place] += 1


@exact
def _used(order, places, inside, layer, pencil, cells, x, start, low):
    """Fill the index; the numbers of pencils and of used cells."""
    axes = places.shape[0]
    pencils = used = 0
    layer[:] = 0
    kz, ky, kx = np.int64(-1), np.int64(-1), np.int64(-1)
    for k in range(inside):
        i = order[k]
        z = np.int64(places[2, i]) if axes == 3 else np.int64(0)
        new = z != kz or places[1, i] != ky
        if new:
            kz, ky = z, np.int64(places[1, i])
            pencil[pencils], cells[pencils] = ky, used
            pencils += 1
            layer[kz - low + 1] = pencils
        if new or places[0, i] != kx:
            kx = np.int64(places[0, i])
            x[used], start[used] = kx, k
            used += 1
    cells[pencils], start[used] = used, inside
    for k in range(1, layer.size):
        layer[k] = max(layer[k], layer[k - 1])
    return pencils, used


class CompactSort:
    """Stable order of particles by cell, as that of `fsi.particles.cells.CellSort`; `start` is an `Index`."""

    def __init__(self, grid: Grid, team: Team):
        self.grid, self.team = grid, team
        none = np.zeros(0, np.int32)
        self.start, self._room = Index(np.zeros(1, np.int32), *[none] * 5), [none] * 4
        self._counts = np.zeros((team.threads, 0), np.int32)
        self.inside = 0

    def room(self, count: int) -> int:
        """Numbers of scratch that so many particles need."""
        return (2 + len(self.grid.lower)) * count

    def update(self, position: np.ndarray, scratch: np.ndarray | None = None) -> np.ndarray:
        """See `CellSort.update`."""
        (n, dim), grid, team = position.shape, self.grid, self.team
        scratch = np.empty(self.room(n), np.int32) if scratch is None else scratch
        order, other = scratch[:n], scratch[n : 2 * n]
        places = scratch[2 * n : (2 + dim) * n].reshape(dim, n)
        bounds, ranges = np.arange(team.threads + 1) * n // team.threads, np.empty((team.threads, dim, 2), np.int64)
        box = grid.lower, grid.domain_min, grid.domain_max, grid.cell
        team.run(_places, bounds, position, *box, places, ranges)
        low, high = ranges[:, :, 0].min(0), ranges[:, :, 1].max(0)
        source, target = (other, order) if dim % 2 else (order, other)
        source[:] = np.arange(n, dtype=np.int32)
        for d in range(dim):
            width = max(0, int(high[d] - low[d]) + 1) + 1
            if self._counts.shape[1] < width:
                self._counts = np.empty((team.threads, width + width // 8), np.int32)
            counts = self._counts.reshape(-1)[: team.threads * width].reshape(team.threads, width)
            team.run(_count, bounds, source, places[d], int(low[d]), counts)
            _offsets(counts)
            team.run(_move, bounds, source, places[d], int(low[d]), counts, target)
            source, target = target, source
        self.inside = int((places[0] != OUTSIDE).sum())
        self._keep_used(order, places, int(low[2]) if dim == 3 else 0, int(high[2]) if dim == 3 else 0)
        return order

    def _keep_used(self, order: np.ndarray, places: np.ndarray, low: int, high: int) -> None:
        """Note the used cells."""
        if len(self._room[0]) < self.inside + 1:
            self._room = [np.empty(self.inside + self.inside // 8 + 1, np.int32) for _ in range(4)]
        low, high = (low, high) if self.inside else (0, 0)
        layer = np.empty(high - low + 2, np.int32)
        pencil, cells, x, start = self._room
        pencils, used = _used(order, places, self.inside, layer, pencil, cells, x, start, low)
        self.start = Index(
            np.array([low], np.int32), layer, pencil[:pencils], cells[: pencils + 1], x[:used], start[: used + 1]
        )

    def around(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Spans (m, 2) of the order in the used cells whose horizontal indices lie from `first` to `last`, both (dim - 1,)."""
        _, _, pencil, cells, x, start = self.start
        chosen = np.arange(len(pencil))
        if len(first) == 2:
            chosen = np.flatnonzero((pencil >= first[1]) & (pencil <= last[1]))
        ends = [(p, x[cells[p] : cells[p + 1]]) for p in chosen]
        spans = [
            (cells[p] + np.searchsorted(at, first[0]), cells[p] + np.searchsorted(at, last[0] + 1)) for p, at in ends
        ]
        return start[np.array(spans, np.int64).reshape(-1, 2)].astype(np.int64)

    @property
    def nbytes(self) -> int:
        return sum(a.nbytes for a in (*self._room, self.start.layer, self._counts))
