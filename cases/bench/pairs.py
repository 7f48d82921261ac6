"""Pairs of particles, counted: those inside the kernel's support, and those that the sweeps process for them."""

from __future__ import annotations

import numpy as np
from numba import njit

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.cells import CellSort
from fsi.particles.neighbours import Neighbours, W, rows_of


@njit(nogil=True, cache=True)
def _count(groups, lst, xs, support2):
    """Entries of the lists, and pairs (i, j) with i != j closer than the support."""
    offset, count, group, span, list_offset, _ = groups
    entries, inside = 0, 0
    for c in range(count.size):
        for g in range(offset[c], offset[c] + count[c]):
            first, last = list_offset[c] + span[g, 0], list_offset[c] + span[g, 2]
            entries += last - first
            for n in range(first, last):
                j = lst[n]
                for i in range(group[g], group[g + 1]):
                    r2 = np.float32(0)
                    for d in range(xs.shape[0]):
                        r2 += (xs[d, i] - xs[d, j]) ** 2
                    inside += i != j and r2 < support2
    return entries, inside


def neighbours(fluid: Fluid) -> tuple[Neighbours, np.ndarray]:
    """Lists of a fluid without boundary as it stands, on one thread, and the positions (dim, n + W) in their order."""
    team, n = Team(1), fluid.count
    sort = CellSort(fluid.grid, team)
    order = sort.update(fluid.position)
    xs = np.zeros((fluid.dim, n + W), np.float32)
    xs[:, :n] = (fluid.position[order] - fluid.grid.lower).T
    near = Neighbours(fluid.lanes, fluid.dim, fluid.scene.spacing, 2 * fluid.scene.smoothing_length, team)
    near.update(sort, 0, xs, [(sort, 0)])
    return near, xs


def pair_counts(fluid: Fluid) -> dict[str, float]:
    """Of a fluid without boundary, per particle: `neighbours` inside the support and `entries` of the lists. An entry is
    processed for all lanes of a group, so that the sweeps process entries * lanes pairs for neighbours + 1."""
    near, xs = neighbours(fluid)
    support = 2 * fluid.scene.smoothing_length
    entries, inside = _count(near.groups, rows_of(near.groups), xs, np.float32(support**2))
    return {"neighbours": inside / fluid.count, "entries": entries / fluid.count}
