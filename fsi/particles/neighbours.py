"""Groups of consecutive sorted particles, and one neighbour list for each group.

A group is up to `LANES` particles of one pencil, so its members are close together and one list serves them all: the
particles of a group sit in the vector lanes, and each neighbour in the list is broadcast to them. A list holds first the
fluid neighbours, then the boundary neighbours, as rows of the packed arrays (fluid rows first, boundary rows after). In each
of the two parts rows ascend, and the list holds the steps from one to the next, in 16 bits, from the first row on. Where a
step is longer it becomes several, over rows in between, which are out of reach as all that are in no list.

Candidates are gathered once for a run of up to `RUN` particles, as the parts of the pencils that reach its box, then
thinned for each of its groups. Positions here are single precision relative to the grid; the pair sums cut at the
kernel's support themselves, so a candidate too many is harmless and the radius is taken a little larger.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fsi.compute.compact import append, bits_below, consecutive, count_bits
from fsi.compute.jit import compiled, exact, helper
from fsi.compute.lanes import claim, load, maximum, minimum, other
from fsi.compute.pairs import ROW
from fsi.compute.team import Team, chunk_bounds
from fsi.errors import RunError
from fsi.particles.cells import CellSort

RUN = 16  # particles that share candidates
CANDIDATES = 2048  # at most, for one run
LONGEST = (1 << 16) - 1  # step
SPARE_ROOM = 1.03  # of a chunk's list over what it held in the last step
MORE_ROOM = 4096  # for a chunk's list that had too little
SPARE_GROUPS = 1.05  # the same of its groups
SPARE_MEMORY = 1.01  # of all of them over what is asked for: fresh memory is slow
MOST_SPARE = 1.05  # of the lists, which are most of the memory: beyond it they are made anew
W = 8  # lanes of the search, whatever the lanes of the sweeps
f32 = np.float32
NOBODY = np.empty(0, bool)


@helper()
def put_steps(rows, m, steps, k, end):
    """Write the steps between the first m of the ascending rows to steps[k:end], from the first row on; returns the new k, or
    -1 where there is no room."""
    if k < 0 or k + m > end:
        return -1
    if m == 0:
        return k
    steps[k], longest = 0, np.int32(0)
    before, after, here = rows[: m - 1], rows[1:m], steps[k + 1 : k + m]
    for q in range(m - 1):  # in vectors, as indices that cannot be negative allow
        step = np.int32(after[q] - before[q])
        here[q] = step
        longest = max(longest, step)
    if longest <= LONGEST:
        return k + m
    hops = 0
    for q in range(m - 1):
        hops += (after[q] - before[q] - 1) // LONGEST
    if k + m + hops > end:
        return -1
    row = rows[0]
    for q in range(m):
        while rows[q] - row > LONGEST:
            steps[k] = LONGEST
            k, row = k + 1, row + LONGEST
        steps[k] = rows[q] - row
        k, row = k + 1, rows[q]
    return k


@helper()
def _box(xs, s, e, d):
    low = high = xs[d, s]
    for i in range(s + 1, e):
        low, high = min(low, xs[d, i]), max(high, xs[d, i])
    return low, high


@cache
def make_search(lanes: int, dim: int, compact: bool = False):
    """The compiled search for groups of this many lanes in this dimension, in a grid or in compact cells."""
    solid = dim == 3
    if compact:
        from fsi.particles import compact_cells as cells
    else:
        from fsi.particles import cells
    between, pencil_of, pencil_end = cells.between, cells.pencil_of, cells.pencil_end

    @helper(lanes, dim, compact)
    def gather(xs, s, e, start, first_row, cell, shape, radius, rows, near, m, centre):
        """Append the particles closer than radius to the box of particles s to e: their rows, and their positions
        relative to the box's centre. Returns how many there are now, -1 if too many."""
        x0, x1 = _box(xs, s, e, 0)
        y0, y1 = _box(xs, s, e, 1)
        z0, z1 = _box(xs, s, e, 2) if solid else (f32(0), f32(0))
        half = f32(0.5)
        cx, cy, cz = half * (x0 + x1), half * (y0 + y1), half * (z0 + z1)
        hx, hy, hz = half * (x1 - x0), half * (y1 - y0), half * (z1 - z0)
        centre[0], centre[1], centre[2] = cx, cy, cz
        x, y, z = xs[0], xs[1], xs[dim - 1]
        bx, by, bz = near[0], near[1], near[2]
        along, across = f32(1) / cell[0], f32(1) / cell[1]
        k0, k1 = (int((z0 - radius) * across), int((z1 + radius) * across)) if solid else (0, 0)
        j0, j1 = int((y0 - radius) * across), int((y1 + radius) * across)
        for kz in range(k0, k1 + 1):
            wall = f32(kz) * cell[1]
            dz = max(f32(0), max(wall - z1, z0 - wall - cell[1])) if solid else f32(0)
            for ky in range(j0, j1 + 1):
                wall = f32(ky) * cell[1]
                dy = max(f32(0), max(wall - y1, y0 - wall - cell[1]))
                reach2 = radius * radius - dy * dy - dz * dz
                if reach2 <= 0:
                    continue
                reach = np.sqrt(reach2)
                a, b = between(start, shape, ky, kz, int((x0 - reach) * along), int((x1 + reach) * along))
                a, b = first_row + a, first_row + b
                for j in range(a, b, W):
                    X, Y = load(x, j, W) - cx, load(y, j, W) - cy
                    ex = maximum(0.0, maximum(X, X * -1.0) - hx)
                    ey = maximum(0.0, maximum(Y, Y * -1.0) - hy)
                    r2 = ex * ex + ey * ey
                    if solid:
                        Z = load(z, j, W) - cz
                        ez = maximum(0.0, maximum(Z, Z * -1.0) - hz)
                        r2 = r2 + ez * ez
                    if m > CANDIDATES - 2 * W:
                        return -1
                    hits = bits_below(r2, radius * radius) & ((1 << min(b - j, W)) - 1)
                    append(rows, m, consecutive(j, W), hits)
                    append(bx, m, X, hits)
                    append(by, m, Y, hits)
                    if solid:
                        append(bz, m, Z, hits)
                    m += count_bits(hits)
        return m

    @helper(lanes, dim)
    def thin(xs, s, e, centre, radius, rows, near, first, m, chosen, t):
        """The candidates first to m closer than radius to one of the particles s to e, into `chosen`; returns how many.
        |x_j - x_i|^2 = |x_j|^2 - 2 x_j . x_i + |x_i|^2, with the smallest of the last two terms kept."""
        for lane in range(lanes):
            i = min(s + lane, e - 1)
            own2 = f32(0)
            for d in range(dim):
                a = xs[d, i] - centre[d]
                t[lane, d] = f32(-2) * a
                own2 += a * a
            t[lane, 3] = own2
        bx, by, bz, k = near[0], near[1], near[2], 0
        for q in range(first, m, W):
            X, Y = load(bx, q, W), load(by, q, W)
            far = X * X + Y * Y
            best = X * other(t, 0, 0, W) + (Y * other(t, 0, 1, W) + other(t, 0, 3, W))
            if solid:
                Z = load(bz, q, W)
                far = far + Z * Z
                best = best + Z * other(t, 0, 2, W)
            for lane in range(1, lanes):
                v = X * other(t, lane, 0, W) + (Y * other(t, lane, 1, W) + other(t, lane, 3, W))
                if solid:
                    v = v + Z * other(t, lane, 2, W)
                best = minimum(best, v)
            hits = bits_below(best + far, radius * radius) & ((1 << min(m - q, W)) - 1)
            append(chosen, k, load(rows, q, W), hits)
            k += count_bits(hits)
        return k

    @compiled(lanes, dim, compact)
    def search(
        counter, bounds, own_start, own_row, xs, starts, first_rows, pieces, cell, shape, radius, longest,
        group_offset, list_offset, group_count, group, span, steps, idle,
    ):  # fmt: skip
        """Chunk c: groups from group_offset[c] on, lists from list_offset[c] on; group_count[c] is -1 where the list
        has no room, -2 where a run has too many candidates, -3 where the groups have no room."""
        t = np.empty((lanes, 4), f32)
        rows, chosen = np.empty(CANDIDATES, np.int32), np.empty(CANDIDATES, np.int32)
        near = np.empty((3, CANDIDATES), f32)
        centre = np.zeros(3, f32)
        cut = np.zeros(3, np.int64)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            g, k, room = group_offset[c], list_offset[c], list_offset[c + 1]
            s, end = own_row + bounds[c], own_row + bounds[c + 1]
            pencil = pencil_of(own_start, shape, bounds[c])
            fault = 0
            while s < end and fault == 0:
                while own_row + pencil_end(own_start, shape, pencil) <= s:
                    pencil += 1
                stop = min(end, own_row + pencil_end(own_start, shape, pencil), s + RUN)
                n, limit = s + 1, xs[0, s] + longest
                while n < stop and xs[0, n] < limit:
                    n += 1
                searched = pieces
                if idle.size > 0:  # rows of one kind alone; the lists of idle ones stay empty
                    stop, n = n, s + 1
                    while n < stop and idle[n] == idle[s]:
                        n += 1
                    searched = 0 if idle[s] else pieces
                m = 0
                for piece in range(2):
                    if m >= 0 and piece < searched:
                        m = gather(
                            xs, s, n, starts[piece], first_rows[piece], cell, shape, radius, rows, near, m, centre
                        )
                    cut[piece + 1] = m
                if m < 0:
                    fault = -2
                elif g + RUN // lanes >= group_offset[c + 1]:
                    fault = -3
                while s < n and fault == 0:
                    e = min(s + lanes, n)
                    group[g] = s
                    span[g, 0] = k - list_offset[c]
                    for piece in range(2):
                        found = thin(xs, s, e, centre, radius, rows, near, cut[piece], cut[piece + 1], chosen, t)
                        span[g, ROW + piece] = chosen[0] if found else 0
                        k = put_steps(chosen, found, steps, k, room)
                        span[g, piece + 1] = k - list_offset[c]
                    if k < 0:
                        fault = -1
                    g, s = g + 1, e
            group[g] = s
            group_count[c] = fault if fault else g - group_offset[c]

    return search


class Neighbours:
    """Groups and lists of one kind of particle (fluid or boundary).

    Sweeps take `groups`, a tuple (group_offset, group_count, group, span, list_offset, steps): the groups of chunk c are
    g = group_offset[c] .. + group_count[c]; group g holds rows group[g] to group[g + 1]; its fluid neighbours are the rows that
    steps[list_offset[c] + span[g, 0] : ... + span[g, 1]] lead to from row span[g, 3] on, and its boundary neighbours follow,
    up to span[g, 2], from row span[g, 4] on. `rows_of` gives the rows.
    """

    def __init__(self, lanes: int, dim: int, spacing: float, support: float, team: Team):
        self.lanes, self.dim, self.team = lanes, dim, team
        self._radius, self._longest = f32(support * 1.0001), f32(12 * spacing)
        self._need = self._groups = np.empty(0)  # list entries and groups of each chunk, learnt from step to step
        self._steps = np.empty(0, np.uint16)
        self._group, self._span = np.empty(0, np.int32), np.empty((0, ROW + 2), np.int32)
        self.bounds = np.zeros(2, np.int64)

    def update(
        self, own: CellSort, own_row: int, xs: np.ndarray, others: list[tuple[CellSort, int]], idle: np.ndarray = NOBODY
    ) -> None:
        """Build groups and lists of the particles sorted by `own`, whose rows begin at own_row; `others`: the sorted
        kinds to search, fluid first, with their first rows. xs (dim, rows + W) single precision, relative to the grid. idle
        (rows,): those that nothing is summed up for, if any.

        Raises RunError where particles have clumped.
        """
        grid, n = own.grid, own.inside
        self.bounds = bounds = chunk_bounds(n)
        chunks = len(bounds) - 1
        group_count = np.zeros(chunks, np.int64)
        both = (others * 2)[:2]  # of one kind twice, so that one compiled search serves either number
        starts = tuple(sort.start for sort, _ in both)
        rows = tuple(row for _, row in both)
        if len(self._need) != chunks:
            self._need = np.diff(bounds) * (28.0 if self.dim == 3 else 8.0)
            self._groups = np.diff(bounds) * (2.0 / self.lanes)
        while True:
            list_offset = _offsets(self._need * SPARE_ROOM)
            group_offset = _offsets(self._groups * SPARE_GROUPS + 2 + RUN // self.lanes)
            if len(self._group) < group_offset[-1]:
                places = int(SPARE_MEMORY * group_offset[-1])
                self._group, self._span = np.empty(places, np.int32), np.empty((places, ROW + 2), np.int32)
            if not list_offset[-1] <= self._steps.size <= MOST_SPARE * list_offset[-1]:
                self._steps = None  # before the new one is made
                self._steps = np.empty(int(SPARE_MEMORY * list_offset[-1]), np.uint16)
            self.team.run(
                make_search(self.lanes, self.dim, grid.compact), bounds, own.start, own_row, xs, starts, rows, len(others),
                grid.cell.astype(f32), grid.shape, self._radius, self._longest,
                group_offset, list_offset, group_count, self._group, self._span, self._steps, idle,
            )  # fmt: skip
            if group_count.min() >= 0:
                break
            if group_count.min() == -2:
                raise RunError(
                    f"more than {CANDIDATES} particles within reach of a few: the particles have clumped and the run is "
                    "unstable; take a smaller numerics.courant or numerics.mach"
                )
            short, few = group_count == -1, group_count == -3
            self._need[short] = 1.3 * self._need[short] + MORE_ROOM  # it may have been 0: dry walls
            self._groups[few] = 1.5 * self._groups[few] + RUN
        last = group_offset[:-1] + np.maximum(group_count, 1) - 1
        self._groups = group_count.astype(float)
        self._need = np.where(group_count > 0, self._span[last, 2], 0).astype(float)
        self.groups = (group_offset, group_count, self._group, self._span, list_offset, self._steps)

    @property
    def nbytes(self) -> int:
        return self._steps.nbytes + self._group.nbytes + self._span.nbytes


@exact
def rows_of(groups):
    """Rows that the steps of all lists lead to, int32, each at the place of its step."""
    offset, count, _, span, list_offset, steps = groups
    rows = np.zeros(steps.size, np.int32)
    for c in range(count.size):
        for g in range(offset[c], offset[c] + count[c]):
            for part in range(2):
                row = span[g, ROW + part]
                for n in range(list_offset[c] + span[g, part], list_offset[c] + span[g, part + 1]):
                    row += steps[n]
                    rows[n] = row
    return rows


def _offsets(rooms: np.ndarray) -> np.ndarray:
    """Where each of so many rooms (n,) begins, and the end (n + 1,)."""
    return np.concatenate([[0], np.cumsum(rooms.astype(np.int64))])
