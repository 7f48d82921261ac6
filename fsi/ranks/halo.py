"""The particles of a rank: its own, those of its box, and the ghosts of others that its own ones can feel.

A sum over neighbours takes them in the order of cells, and within a cell in the order that they had before. On several ranks
this order is kept by a key of every particle: its cell and its place in it after the last sort. A rank holds whole boxes and
knows the ghosts around, so that it sorts them as one process would, and each sum has the same bits.

Ghosts reach two supports beyond the box: own particles feel walls a support away, and those feel fluid a support farther.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from fsi.particles.cells import CellSort, Grid
from fsi.particles.ghosts import Periodic
from fsi.particles.state import BoundaryState, ParticleState
from fsi.protocols import Particles
from fsi.ranks import kernels
from fsi.ranks.comm import Ranks
from fsi.ranks.decomposition import Decomposition
from fsi.ranks.kernels import CODE_BITS
from fsi.scene.model import Scene


class RankHalo:
    """A `fsi.protocols.Halo` over ranks, periodic axes included. Owns the decomposition, the keys of the particles and the rows
    of ghosts and their sources in a step. Before the first `exchange` every rank holds all particles (`scattered` False).

    own_key: keys (n,) of the own particles, in their order, from the last sort; key: those of all particles that are here now,
    ghosts included within a step, of which own_rows are own; moving: numbers of the boundary particles that move, in the
    order of cells.
    """

    room = 1.2

    def __init__(self, scene: Scene, ranks: Ranks, decomposition: Decomposition, grid: Grid):
        self.ranks, self.grid, self._periodic = ranks, grid, Periodic(scene)
        self.width = 4.05 * scene.smoothing_length
        self._reach = 2.01 * scene.smoothing_length
        self.scattered, self.ghosts = False, 0
        self.own_key = self.key = self.own_rows = np.empty(0, np.int64)
        self.moving = np.empty(0, np.int64)
        self.decide(decomposition)

    def expected(self, count: int) -> int:
        """See `Halo`."""
        return 0

    # -------------------------------------------------------------------------------------- boxes

    def decide(self, decomposition: Decomposition) -> None:
        """Take these boxes from the next `exchange` on."""
        self.decomposition = decomposition
        self._low, self._high = decomposition.box(self.ranks.rank)
        self._fixed: np.ndarray | None = None
        boxes = [self._around(*decomposition.box(rank)) for rank in range(decomposition.size)]
        mine, self._others = decomposition.box(self.ranks.rank), []
        for code, shift in self._images():
            for rank, (low, high) in enumerate(boxes):
                itself = rank == self.ranks.rank and code == 0
                meets = all(
                    mine[0][d] + shift[d] <= high[d] and mine[1][d] + shift[d] >= low[d] for d in range(len(low))
                )
                if meets and not itself:
                    self._others.append((rank, code, shift, low, high))
        reach = self.width * np.ones(len(mine[0]))
        self._inner = mine[0] + reach, mine[1] - reach
        for d in self._periodic.axes:  # the outer ranks have images beyond the ends
            self._inner[0][d] = max(self._inner[0][d], self._periodic.low[d] + self.width)
            self._inner[1][d] = min(self._inner[1][d], self._periodic.high[d] - self.width)

    def _around(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the ghosts of this box may stand."""
        low, high = low.copy(), high.copy()
        for d in self._periodic.axes:
            low[d], high[d] = max(low[d], self._periodic.low[d]), min(high[d], self._periodic.high[d])
        return low - self.width, high + self.width

    def _images(self) -> list[tuple[int, np.ndarray]]:
        """(code, shift (dim,)) of a particle itself and of its images, in the order of `Periodic.images`."""
        axes, found = self._periodic.axes, []
        for digits in product(range(3), repeat=len(axes)):
            shift = np.zeros(len(self._low))
            for d, digit in zip(axes, digits, strict=True):
                shift[d] = (0.0, 1.0, -1.0)[digit] * (self._periodic.high[d] - self._periodic.low[d])
            found.append((sum(digit * 3**k for k, digit in enumerate(digits)), shift))
        return sorted(found, key=lambda image: image[0])

    # -------------------------------------------------------------------------------------- a step

    def exchange(self, particles: Particles) -> int:
        """See `Halo`."""
        self.drop(particles)
        self._periodic.wrap(particles.position)
        if self.scattered:
            self._migrate(particles)
        else:
            self.own_key = np.arange(particles.count)
            mine = self.holds(particles.position)
            particles.keep(mine)
            self.own_key, self.scattered = self.own_key[mine], True
        own = particles.count
        self._append_ghosts(particles)
        return own

    def _migrate(self, particles: Particles) -> None:
        """Give particles that have left the box to the ranks whose boxes they are in."""
        away = np.empty(particles.count, np.int64)
        away = away[: kernels.outside(particles.position, self._low, self._high, away)]
        to = self.decomposition.rank_of(particles.position[away])
        rows = _packed(particles, away, self.own_key[away])
        got = self.ranks.swap({int(r): rows[to == r] for r in np.unique(to)}, rows.shape[1], "migration")
        if len(away):
            kept = np.ones(particles.count, bool)
            kept[away] = False
            particles.keep(kept)
            self.own_key = self.own_key[kept]
        if got:
            dim = len(self._low)
            rows = np.concatenate([rows for _, rows in got])
            position, velocity, pressure, label, key = np.split(rows, [dim, 2 * dim, 2 * dim + 1, 2 * dim + 2], axis=1)
            dtype = particles.pressure.dtype
            particles.append(position, velocity, pressure[:, 0].astype(dtype), label[:, 0].astype(np.int32))
            self.own_key = np.concatenate([self.own_key, _bits(key)])

    def _append_ghosts(self, particles: Particles) -> None:
        near = np.empty(particles.count, np.int64)
        near = near[: kernels.outside(particles.position, *self._inner, near)]
        place, given, sources = particles.position[near], {}, {}
        for rank, code, shift, low, high in self._others:
            there = np.ones(len(near), bool)
            for d in range(len(low)):
                x = place[:, d] + shift[d] if shift[d] else place[:, d]
                there &= (x >= low[d]) & (x <= high[d])
            chosen = near[there]
            rows = _packed(particles, chosen, self.own_key[chosen] | (code << CODE_BITS))
            rows[:, : len(low)] += shift
            given.setdefault(rank, []).append(rows)
            sources.setdefault(rank, []).append(chosen)
        self._sources = {rank: np.concatenate(parts) for rank, parts in sorted(sources.items())}
        width = 2 * len(self._low) + 3
        got = self.ranks.swap({rank: np.concatenate(parts) for rank, parts in given.items()}, width, "ghosts")
        self._sizes = {rank: len(rows) for rank, rows in got}
        rows = np.concatenate([np.empty((0, width)), *(rows for _, rows in got)])
        dim = len(self._low)
        self._last_key = np.concatenate([self.own_key, _bits(rows[:, -1:])])
        particles.append_ghosts(
            rows[:, :dim], rows[:, dim : 2 * dim], rows[:, 2 * dim].astype(particles.pressure.dtype)
        )

    def locate(self, order: np.ndarray, sort: CellSort) -> int:
        """See `Halo`."""
        inside, own = sort.inside, len(self.own_key)
        self.key = np.empty(inside, np.int64)
        kernels.arrange(sort.start, order, self._last_key, self.key)
        row = np.empty(len(order), np.int64)
        row[order] = np.arange(len(order))
        self._ghosts = np.where(row[own:] < inside, row[own:], -1)
        self._from = np.concatenate([np.empty(0, np.int64), *(row[s] for s in self._sources.values())])
        mine = np.zeros(len(order), bool)
        mine[row[:own]] = True
        self.own_rows = np.flatnonzero(mine[:inside])
        self.own_key = self.key[self.own_rows]
        self.ghosts = int((self._ghosts >= 0).sum())
        return self.ghosts

    def idle(self) -> np.ndarray:
        """See `Halo`."""
        ghosts = np.ones(len(self.key), bool)
        ghosts[self.own_rows] = False
        return ghosts

    def refresh(self, rows: np.ndarray, columns: slice) -> None:
        """See `Halo`."""
        first, last, _ = columns.indices(rows.shape[1])
        out = np.empty((len(self._from), last - first), rows.dtype)
        into = np.empty((len(self._ghosts), last - first), rows.dtype)
        kernels.pick(rows, self._from, first, last, out)
        ranks, requests, at = self.ranks, [], 0
        for rank, size in self._sizes.items():
            part, at = into[at : at + size], at + size
            if rank == ranks.rank:
                mine = part
            else:
                requests.append(ranks.comm.Irecv(part, source=rank))
        at = 0
        for rank, source in self._sources.items():
            part, at = out[at : at + len(source)], at + len(source)
            if rank == ranks.rank:
                if len(part):
                    mine[:] = part
            elif len(part):
                requests.append(ranks.comm.Isend(part, dest=rank))
                ranks.count("ghosts", part.nbytes)
        ranks.wait(*requests)
        kernels.put(rows, self._ghosts, first, last, into)

    def drop(self, particles: ParticleState) -> np.ndarray | slice:
        """See `Halo`."""
        rows, self.key, self.own_rows = self.own_rows, self.own_key, np.arange(len(self.own_key))
        if len(rows) == particles.count or not self.scattered:
            return slice(None)
        particles.reorder(rows.astype(np.int32), len(rows))
        return rows

    # -------------------------------------------------------------------------------------- boundary particles

    def holds(self, position: np.ndarray) -> np.ndarray:
        """See `Halo`."""
        return ((position >= self._low) & (position < self._high)).all(1)

    def nearby(self, placed: BoundaryState) -> np.ndarray:
        """See `Halo`."""
        fixed, low, high = placed.of_owner(0).stop, self._low - self._reach, self._high + self._reach
        if self._fixed is None:
            p = placed.position[:fixed]
            self._fixed = np.flatnonzero(((p >= low) & (p <= high)).all(1))
        p = placed.position[fixed:]
        self.moving = fixed + self.grid.order(p)
        near = fixed + np.flatnonzero(((p >= low) & (p <= high)).all(1))
        return np.concatenate([self._fixed, near])


def _packed(particles: Particles, chosen: np.ndarray, key: np.ndarray) -> np.ndarray:
    """Rows of position, velocity, pressure, label and key, as doubles."""
    rows = [particles.position[chosen], particles.velocity[chosen], particles.pressure[chosen, None]]
    return np.concatenate([*rows, particles.label[chosen, None], key.view(np.float64)[:, None]], axis=1)


def _bits(key: np.ndarray) -> np.ndarray:
    """Keys (n,) from a column of doubles (n, 1) that hold them."""
    return np.ascontiguousarray(key[:, 0]).view(np.int64)
