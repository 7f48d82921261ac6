"""Cells: a fixed grid over the domain, and a parallel counting sort of particles into it.

Cells are one spacing long and `ACROSS` spacings wide. A row of cells along x is a pencil; particles sorted by cell are
contiguous along a pencil, which is what the groups of `fsi.particles.neighbours` need. A group of 8 or 16 of them should fill
a square or a cube: its list, of all that are near one of them, is then the shortest. The grid is padded by the kernel's
support on all sides, so a search never leaves it. Particles outside the domain,
or without a position, sort behind all others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsi.compute.jit import exact, helper
from fsi.compute.lanes import at, claim
from fsi.compute.team import Team, chunk_bounds

ACROSS = {2: 3.6, 3: 2.1}  # by dimension; few rows of a lattice lie on the edge of a cell
FEW_CELLS, EMPTY = 250_000, 16  # cells, and cells a particle, up to which all are kept
PIECE = 32768  # cells whose counts one thread adds up at a time


@dataclass(frozen=True)
class Grid:
    """lower (dim,): corner of the padded grid, the origin of all single-precision positions; domain_min, domain_max
    (dim,): the box particles may be in; cell (2,): cell length along x and across; shape (3,): cells per axis, x first,
    with 1 for the missing axis in two dimensions; compact: keep only the cells that hold particles."""

    lower: np.ndarray
    domain_min: np.ndarray
    domain_max: np.ndarray
    cell: np.ndarray
    shape: tuple[int, int, int]
    compact: bool = False

    @property
    def cells(self) -> int:
        return self.shape[0] * self.shape[1] * self.shape[2]

    def order(self, position: np.ndarray) -> np.ndarray:
        """Stable order of a few places (n, dim) by cell, without those outside the domain, as `CellSort` has it."""
        dim = position.shape[1]
        inside = np.flatnonzero(((position >= self.domain_min) & (position <= self.domain_max)).all(1))
        key, shape = np.zeros(len(inside), np.int64), self.shape[:dim]
        for d in range(dim - 1, -1, -1):
            key = key * shape[d] + ((position[inside, d] - self.lower[d]) / self.cell[min(d, 1)]).astype(np.int64)
        return inside[np.argsort(key, kind="stable")]

    @classmethod
    def over(cls, domain_min, domain_max, spacing: float, support: float, particles: float = math.inf) -> Grid:
        """The grid over a domain, compact where it is large for so many particles."""
        low, high = np.asarray(domain_min, float), np.asarray(domain_max, float)
        cell = spacing * np.array([1.0, ACROSS[len(low)]])
        sides = cell[[0] + [1] * (len(low) - 1)]
        pad = (np.ceil(support / sides) + 1) * sides
        count = ((high - low + 2 * pad) / sides).astype(int) + 2
        shape = (int(count[0]), int(count[1]), int(count[2]) if len(low) == 3 else 1)
        compact = math.prod(shape) > max(FEW_CELLS, EMPTY * particles)
        return cls(low - pad, low, high, cell, shape, compact)


@helper()
def between(start, shape, ky, kz, x0, x1):
    """First and end of the particles in the cells x0 to x1 of a pencil."""
    pencil = (kz * shape[1] + ky) * shape[0]
    return at(start, pencil + x0), at(start, pencil + x1 + 1)


@helper()
def pencil_of(start, shape, place):
    """The pencil that holds the particle at this place of the order."""
    return np.searchsorted(start[:: shape[0]], place, side="right") - 1


@helper()
def pencil_end(start, shape, pencil):
    """The end of a pencil in the order."""
    return at(start, (pencil + 1) * shape[0])


@exact
def _histogram(counter, bounds, position, lower, low, high, cell, shape, key, counts):
    dim = position.shape[1]
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for k in range(counts.shape[1]):
            counts[c, k] = 0
        for i in range(bounds[c], bounds[c + 1]):
            inside, k = True, 0
            for d in range(dim - 1, -1, -1):
                x = position[i, d]
                if not (low[d] <= x <= high[d]):
                    inside = False
                    break
                k = k * shape[d] + int((x - lower[d]) / cell[min(d, 1)])
            if not inside:
                k = counts.shape[1] - 1
            key[i] = k
            counts[c, k] += 1


@exact
def _sum(counter, bounds, counts, totals):
    """Particles in each piece of the cells."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        totals[c] = counts[:, bounds[c] : bounds[c + 1]].sum()


@exact
def _prefix(counter, bounds, counts, before, start):
    """First place of each cell, and of what each chunk of particles has in it; `before`: of each piece of the cells."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        total = before[c]
        for k in range(bounds[c], bounds[c + 1]):
            start[k] = total
            for chunk in range(counts.shape[0]):
                n = counts[chunk, k]
                counts[chunk, k] = total
                total += n


@exact
def _order(counter, bounds, key, counts, order):
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            k = key[i]
            order[counts[c, k]] = i
            counts[c, k] += 1


class CellSort:
    """Stable order of particles by cell.

    After `update`: start (cells + 1,) int32, the first place of each cell; `inside`, how many particles are in the domain
    (those behind are lost).
    """

    def __init__(self, grid: Grid, team: Team):
        self.grid, self.team = grid, team
        self.start = np.empty(0, np.int32)
        self.inside = 0

    def room(self, count: int) -> int:
        """Numbers of scratch that so many particles need."""
        return 2 * count + self.team.threads * (self.grid.cells + 1)

    def update(self, position: np.ndarray, scratch: np.ndarray | None = None) -> np.ndarray:
        """Sort positions (n, dim); the order (n,) int32, the particle at each sorted place. It stands in `scratch`, int32
        and at least `room` long, if that is given."""
        n, grid, team = len(position), self.grid, self.team
        if self.start.size == 0:
            self.start = np.zeros(grid.cells + 1, np.int32)
        scratch = np.empty(self.room(n), np.int32) if scratch is None else scratch
        order, key, rest = scratch[:n], scratch[n : 2 * n], scratch[2 * n : self.room(n)]
        counts = rest.reshape(team.threads, -1)
        bounds = np.arange(team.threads + 1) * n // team.threads
        shape = np.array(grid.shape if position.shape[1] == 3 else (grid.shape[0], grid.shape[1]))
        team.run(
            _histogram, bounds, position, grid.lower, grid.domain_min, grid.domain_max, grid.cell, shape, key, counts
        )
        pieces = chunk_bounds(self.start.size, PIECE if team.threads > 1 else self.start.size)
        totals = np.zeros(len(pieces) - 1, np.int64)
        if len(totals) > 1:
            team.run(_sum, pieces, counts, totals)
        team.run(_prefix, pieces, counts, np.cumsum(totals) - totals, self.start)
        team.run(_order, bounds, key, counts, order)
        self.inside = int(self.start[-1])
        return order

    @property
    def nbytes(self) -> int:
        return self.start.nbytes


def whole(count: int) -> np.ndarray:
    """Bounds of chunks over `count` particles for kernels that only move data."""
    return chunk_bounds(count, 16384)
