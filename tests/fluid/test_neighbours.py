"""Sorting and searching against all pairs."""

from contextlib import nullcontext
from threading import Lock

import numpy as np
import pytest
from tanks import random_fluid

from fsi.compute.team import Team
from fsi.particles.cells import CellSort, Grid


def lists(near):
    """(first row, last row, fluid neighbours, boundary neighbours) of every group."""
    offset, count, group, span, list_offset, lst = near.groups
    for c in range(len(count)):
        for g in range(offset[c], offset[c] + count[c]):
            cuts = list_offset[c] + span[g]
            yield group[g], group[g + 1], lst[cuts[0] : cuts[1]], lst[cuts[1] : cuts[2]]


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("dim, count", [(2, 40), (3, 14)])
def test_every_pair_is_found_once(dim, count, precision):
    fluid = random_fluid(dim, precision, count, boundary=True)
    n, support = fluid.count, 2 * fluid.scene.smoothing_length
    points = np.concatenate([fluid.position, fluid.solids.position[: fluid.solids.count]])
    for near, first, kinds in ((fluid.near, 0, 2), (fluid.solids.near, n, 1)):
        seen = []
        for s, e, wet, solid in lists(near):
            assert (wet < n).all() and (solid >= n).all()
            found = np.concatenate([wet, solid])
            assert len(np.unique(found)) == len(found)
            for i in range(s, e):
                close = np.flatnonzero(((points - points[i]) ** 2).sum(1) < support**2)
                assert set(close if kinds == 2 else close[close < n]) <= set(found)
            seen.extend(range(s, e))
        assert seen == list(range(first, first + (n if first == 0 else fluid.solids.count)))


def test_particles_outside_or_without_a_position_sort_last():
    grid = Grid.over([0.0, 0.0], [1.0, 1.0], 0.1, 0.3)
    points = np.array([[0.5, 0.5], [np.nan, 0.5], [0.1, 0.9], [1.5, 0.5], [0.5, -np.inf]])
    sort = CellSort(grid, Team(1))
    order = sort.update(points)
    assert sort.inside == 2 and set(order[:2]) == {0, 2}


@pytest.mark.parametrize("threads", [2, 3])
def test_order_does_not_depend_on_threads(threads):
    points = np.random.default_rng(0).random((5000, 3))
    grid = Grid.over([0.0] * 3, [1.0] * 3, 0.1, 0.3)
    one, many = (CellSort(grid, Team(t)).update(points) for t in (1, threads))
    assert (one == many).all()


def test_walls_that_were_dry_get_their_lists_when_water_comes():
    """A chunk that needed no room in the last step, and more than the slack in this one."""
    fluid = random_fluid(3, "single", 18, boundary=True)
    before = [np.concatenate(group[2:]) for group in lists(fluid.solids.near)]
    for near in (fluid.near, fluid.solids.near):
        near._need[:] = 0.0
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    after = [np.concatenate(group[2:]) for group in lists(fluid.solids.near)]
    assert sum(map(len, after)) > 4096
    assert all((a == b).all() for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("threads", [1, 3])
def test_a_team_does_each_piece_once_and_tells_of_faults(threads):
    team, lock, seen = Team(threads), Lock(), []

    def work(counter, bounds):
        while True:
            with lock:
                piece, counter[0] = counter[0], counter[0] + 1
            if piece >= len(bounds) - 1:
                break
            seen.append(piece)
            if piece == fault:
                raise ValueError(piece)

    for fault in (-1, 5, -1):
        seen.clear()
        with pytest.raises(ValueError) if fault >= 0 else nullcontext():
            team.run(work, np.arange(40))
    assert sorted(seen) == list(range(39))
    team.close()
