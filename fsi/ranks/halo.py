"""The particles of a rank: its own, those of its box, and the ghosts of others that its own ones can feel.

A sum over neighbours takes them in the order of cells, and within a cell in the order that they had before. On several ranks
this order is kept by a key of every particle: its cell and its place in it after the last sort. A rank holds whole boxes and
knows the ghosts around, so that it sorts them as one process would, and each sum has the same bits.

Ghosts reach a support beyond the box, and another one near boundary particles: own particles feel walls a support away, and
those feel fluid a support farther. They get the results of a sweep while it goes on: first come the particles that are
ghosts elsewhere, and the others while the messages are under way.
"""

from __future__ import annotations

import time as clock
from functools import wraps
from itertools import product

import numpy as np

from fsi.owners import WALL
from fsi.particles.cells import CellSort, Grid
from fsi.particles.ghosts import Periodic
from fsi.particles.state import BoundaryState, ParticleState
from fsi.protocols import Particles
from fsi.ranks import kernels
from fsi.ranks.comm import Ranks
from fsi.ranks.decomposition import Decomposition
from fsi.ranks.kernels import CODE_BITS
from fsi.scene.model import Scene

PIECES = 4  # of a sweep over the particles that no other rank waits for, between which messages get on


def _timed(method):
    """The method, whose processor time without waiting is added to `used` of the halo."""

    @wraps(method)
    def timed(self, *arguments):
        start = clock.process_time() - self.ranks.spun
        found = method(self, *arguments)
        self.used += clock.process_time() - self.ranks.spun - start
        return found

    return timed


class RankHalo:
    """A `fsi.protocols.Halo` over ranks, periodic axes included. Owns the decomposition, the keys of the particles and the rows
    of ghosts and their sources in a step. Before the first `exchange` every rank holds all particles (`scattered` False).

    own_key: keys (n,) of the own particles, in their order, from the last sort; key: those of all particles that are here now,
    ghosts included within a step, of which own_rows are own; moving: numbers of the boundary particles that move, in the
    order of cells; used: processor time [s] that all this has taken, without waiting.
    """

    room = 1.2

    def __init__(self, scene: Scene, ranks: Ranks, decomposition: Decomposition, grid: Grid):
        self.ranks, self.grid, self._periodic = ranks, grid, Periodic(scene)
        self.width = 4.05 * scene.smoothing_length
        self._reach = 2.01 * scene.smoothing_length
        self._walls: NearWalls | None = None  # of the boundary, once it is known
        self._buffers: dict[str, np.ndarray] = {}
        self._split_of, self._runs = None, ()
        self.used = 0.0
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
        if self._walls:
            self._walls = NearWalls(self._walls.placed, *self._corners(), self._reach)
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

    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners (dim,) of the box as far as particles may be in it."""
        low, high = self.grid.domain_min, self.grid.domain_max
        return np.clip(self._low, low, high), np.clip(self._high, low, high)

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

    @_timed
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
        walled = self._walls(place) if self._walls else None
        for rank, code, shift, low, high in self._others:
            there = np.ones(len(near), bool)
            for d in range(len(low)):
                x = place[:, d] + shift[d] if shift[d] else place[:, d]
                there &= (x >= low[d]) & (x <= high[d])
            if walled is not None and code == 0:
                close, less = walled.copy(), self.width - self._reach
                close |= ((place >= low + less) & (place <= high - less)).all(1)
                there &= close
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

    @_timed
    def locate(self, order: np.ndarray, sort: CellSort) -> int:
        """See `Halo`."""
        inside, own = sort.inside, len(self.own_key)
        self.key = np.empty(inside, np.int64)
        if sort.grid.compact:
            kernels.arrange_compact(sort.start, sort.grid.shape, order, self._last_key, self.key)
        else:
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
        into, requests = self._send(rows, columns)
        self._receive(rows, columns, into, requests)

    def sweep(self, run, near, rows: np.ndarray, columns: slice) -> None:
        """See `Halo`; the particles that others wait for first."""
        if self._split_of is not near.groups:
            self._split(near)
        outer, *inner = self._runs
        run(*outer)
        into, requests = self._send(rows, columns)
        for part in inner:
            run(*part)
            self.ranks.test(requests)
        self._receive(rows, columns, into, requests)

    @_timed
    def _split(self, near) -> None:
        """Part the groups of own particles into those that are ghosts elsewhere, and `PIECES` of the others."""
        offset, count, group, span, base, lists = self._split_of = near.groups
        kind = np.zeros(near.bounds[-1], np.int8)
        kind[self.own_rows], kind[self._from] = kernels.INNER, kernels.OUTER
        found, room = [], int(count.sum())
        for which, pieces in ((kernels.OUTER, 1), (kernels.INNER, PIECES)):
            runs = np.empty((3, room), np.int64)
            runs = runs[:, : kernels.split(offset, count, group, base, kind, which, *runs)]
            for part in np.array_split(runs, pieces, axis=1):
                first, length, start = part.copy()
                found.append((np.arange(len(first) + 1), (first, length, group, span, start, lists)))
        self._runs = tuple(found)

    def _buffer(self, name: str, count: int, width: int, dtype) -> np.ndarray:
        """Memory (count, width) that stands until the next call for the same name; it is kept from step to step."""
        size, kept = count * width * np.dtype(dtype).itemsize, self._buffers.get(name)
        if kept is None or len(kept) < size:
            kept = self._buffers[name] = np.empty(size + size // 4, np.uint8)
        return kept[:size].view(dtype).reshape(count, width)

    @_timed
    def _send(self, rows: np.ndarray, columns: slice) -> tuple[np.ndarray, list]:
        """Begin to give the ghosts what their sources have: where it comes in, and the messages."""
        first, last, _ = columns.indices(rows.shape[1])
        out = self._buffer("out", len(self._from), last - first, rows.dtype)
        into = self._buffer("into", len(self._ghosts), last - first, rows.dtype)
        kernels.pick(rows, self._from, first, last, out)
        ranks, requests, at, mine = self.ranks, [], 0, None
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
        return into, requests

    @_timed
    def _receive(self, rows: np.ndarray, columns: slice, into: np.ndarray, requests: list) -> None:
        self.ranks.wait(*requests)
        first, last, _ = columns.indices(rows.shape[1])
        kernels.put(rows, self._ghosts, first, last, into)

    @_timed
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
        if self._walls is None:
            self._walls = NearWalls(placed, *self._corners(), self._reach)
        if self._fixed is None:
            p = placed.position[:fixed]
            self._fixed = np.flatnonzero(((p >= low) & (p <= high)).all(1))
        p = placed.position[fixed:]
        self.moving = fixed + self.grid.order(p)
        near = fixed + np.flatnonzero(((p >= low) & (p <= high)).all(1))
        return np.concatenate([self._fixed, near])


class NearWalls:
    """Whether places in a box are within `reach` [m] of the boundary particles `placed`; some up to twice as far count too."""

    def __init__(self, placed: BoundaryState, low: np.ndarray, high: np.ndarray, reach: float):
        self.placed, self._low, self._reach = placed, low - reach, reach
        self._shape = tuple(((high - low) / reach).astype(int) + 3)
        self._fixed = placed.of_owner(WALL).stop
        self._marked = self._mark(placed.position[: self._fixed])

    def __call__(self, position: np.ndarray) -> np.ndarray:
        """For places (n, dim) of the box, with the boundary where it is now."""
        moving = self.placed.position[self._fixed :]
        marked = self._marked | self._mark(moving) if len(moving) else self._marked
        return marked[tuple(np.clip(self._cells(position), 0, np.array(self._shape) - 1).T)]

    def _cells(self, position: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):  # of a particle without a position, which is lost
            return np.floor((position - self._low) / self._reach).astype(np.int64)

    def _mark(self, position: np.ndarray) -> np.ndarray:
        """True in the cells of these places, and in those beside them."""
        marked, cells = np.zeros(self._shape, bool), self._cells(position)
        marked[tuple(cells[((cells >= 0) & (cells < self._shape)).all(1)].T)] = True
        for axis in range(marked.ndim):
            first, last = (np.roll(marked, by, axis) for by in (1, -1))  # what comes round only marks more
            marked = marked | first | last
        return marked


def _packed(particles: Particles, chosen: np.ndarray, key: np.ndarray) -> np.ndarray:
    """Rows of position, velocity, pressure, label and key, as doubles."""
    rows = [particles.position[chosen], particles.velocity[chosen], particles.pressure[chosen, None]]
    return np.concatenate([*rows, particles.label[chosen, None], key.view(np.float64)[:, None]], axis=1)


def _bits(key: np.ndarray) -> np.ndarray:
    """Keys (n,) from a column of doubles (n, 1) that hold them."""
    return np.ascontiguousarray(key[:, 0]).view(np.int64)
