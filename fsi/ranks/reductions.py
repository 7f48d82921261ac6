"""Numbers over the particles of all ranks, with the same bits on every number of them.

Maxima do not depend on the order, nor do sums of integers. Sums over few particles are made on all ranks, over the rows of
all in the order of cells; sums over all particles on the root in that order, or in blocks of labels that the ranks share.
"""

from __future__ import annotations

import numpy as np

from fsi.compute.reduce import BLOCK, Reductions, label_sums
from fsi.owners import PISTON, WALL
from fsi.particles.state import BoundaryState
from fsi.ranks.comm import Ranks
from fsi.ranks.halo import RankHalo


class RankReductions(Reductions):
    """`Reductions` over ranks; as long as every rank holds all particles (`RankHalo.scattered`), those of one process."""

    def __init__(self, ranks: Ranks, halo: RankHalo, periods: np.ndarray):
        """periods (dim,): lengths of the periodic axes, 0 for the others."""
        self._ranks, self._halo, self._periods, self.processes = ranks, halo, periods, ranks.size

    # -------------------------------------------------------------------------------------- of any order

    def total(self, values):
        """See `Reductions`; sums of floats may differ in their last bits with the ranks."""
        return self.combined(super().total(values))

    def combined(self, part):
        return self._ranks.reduce(part) if self._halo.scattered else part

    def largest(self, values, least=0.0):
        found = super().largest(values, least)
        return self._ranks.reduce(np.asarray(found), "max") if self._halo.scattered else found

    def smallest(self, values):
        if not self._halo.scattered:
            return super().smallest(values)
        return self._ranks.reduce(np.asarray(values.min(0, initial=np.inf)), "min")

    def largest_of(self, part):
        return self._ranks.reduce(float(part), "max") if self._halo.scattered else part

    # -------------------------------------------------------------------------------------- in the order of cells

    def weighted(self, weights, values):
        if not self._halo.scattered:
            return super().weighted(weights, values)
        return self._on_root(lambda w, v: w @ v, weights, values)

    def mean(self, values):
        return self._on_root(lambda v: v.mean(0), values) if self._halo.scattered else super().mean(values)

    def _on_root(self, function, *arrays):
        rows = self.whole(*arrays)
        return self._ranks.broadcast(function(*rows) if self._ranks.root else None)

    def whole(self, *arrays):
        if not self._halo.scattered:
            return super().whole(*arrays)
        own = [array if len(array) == len(self._halo.own_key) else array[self._halo.own_rows] for array in arrays]
        order = np.argsort(self._ranks.collect(self._halo.own_key), kind="stable")
        return tuple(self._ranks.collect(array)[order] for array in own)

    def gathered(self, which, *arrays):
        if not self._halo.scattered:
            return super().gathered(which, *arrays)
        if len(self._halo.own_rows) < len(self._halo.key):  # within a step, with ghosts
            own = np.isin(which, self._halo.own_rows)
            which, arrays = which[own], tuple(array[own] for array in arrays)
        order = np.argsort(self._ranks.collect(self._halo.key[which], everywhere=True), kind="stable")
        return tuple(self._ranks.collect(array, everywhere=True)[order] for array in arrays)

    def together(self, *arrays):
        if not self._halo.scattered:
            return super().together(*arrays)
        return tuple(self._ranks.collect(array, everywhere=True) for array in arrays)

    def around(self, point, reach, position, *values):
        point = np.asarray(point, float)
        if not self._halo.scattered:
            return super().around(point, reach, position, *values)
        rows = self._halo.own_rows
        apart = position[rows, : len(point)] - point
        length = self._periods[: len(point)]
        apart -= length * np.round(apart / np.where(length > 0, length, np.inf))
        which = rows[(apart**2).sum(1) < (1.01 * reach) ** 2]
        return self.gathered(which, position[which], *(array[which] for array in values))

    def at_largest(self, values, position):
        if not self._halo.scattered:
            return super().at_largest(values, position)
        most, place = -np.inf, np.zeros(position.shape[1])
        if len(values):
            most, place = float(values.max()), super().at_largest(values, position)
        found = self._ranks.collect(np.array([[most, *place]]), everywhere=True)
        return found[np.argmax(found[:, 0]), 1:]

    def by_label(self, label, values, count):
        if not self._halo.scattered:
            return super().by_label(label, values, count)
        ranks, blocks = self._ranks, -(-count // BLOCK)
        first = BLOCK * (np.arange(ranks.size + 1) * blocks // ranks.size)  # label of each rank's first block
        to = np.searchsorted(first, label, side="right") - 1
        rows = np.concatenate([label[:, None].astype(float), values], axis=1)
        order = np.argsort(to, kind="stable")
        ends = np.searchsorted(to[order], np.arange(ranks.size + 1))
        given = {rank: rows[order[ends[rank] : ends[rank + 1]]] for rank in range(ranks.size)}
        got = ranks.swap(given, rows.shape[1], "sums")
        mine = np.concatenate([np.empty((0, rows.shape[1])), *(part for _, part in got)])
        row = np.full(first[ranks.rank + 1] - first[ranks.rank], -1)
        row[mine[:, 0].astype(np.int64) - first[ranks.rank]] = np.arange(len(mine))
        return ranks.collect(label_sums(row, mine[:, 1:]), everywhere=True).sum(0)

    # -------------------------------------------------------------------------------------- boundary particles

    def loads(self, add, placed: BoundaryState, order, position, owner, forces, wrenches):
        if not self._halo.scattered:
            super().loads(add, placed, order, position, owner, forces, wrenches)
            return
        fixed = owner == WALL
        part = np.zeros_like(wrenches)
        for force, wrench in zip(forces, part, strict=True):
            add(position[fixed], force[fixed], owner[fixed], wrench)
        wrenches += self.combined(part)
        moving = self._halo.moving
        if not len(placed.owner) or placed.owner[-1] < PISTON:
            return
        slot = np.full(len(placed.owner) - (first := placed.of_owner(WALL).stop), -1)
        slot[moving - first] = np.arange(len(moving))
        held = np.flatnonzero(owner >= PISTON)
        together = np.zeros((len(forces), len(moving), position.shape[1]))
        together[:, slot[order[held] - first]] = forces[:, held]
        together = self._ranks.reduce(together)
        for force, wrench in zip(together, wrenches, strict=True):
            add(placed.position[moving], force, placed.owner[moving], wrench)
