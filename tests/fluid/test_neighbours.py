"""Sorting and searching against all pairs."""

from contextlib import nullcontext
from threading import Lock

import numpy as np
import pytest
from tanks import random_fluid

from fsi.compute.team import Team
from fsi.particles.cells import CellSort, Grid
from fsi.particles.neighbours import LONGEST, put_steps, rows_of


def lists(near):
    """(first row, last row, fluid neighbours, boundary neighbours) of every group."""
    offset, count, group, span, list_offset, _ = near.groups
    lst = rows_of(near.groups)
    for c in range(len(count)):
        for g in range(offset[c], offset[c] + count[c]):
            cuts = list_offset[c] + span[g, :3]
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


def test_a_step_over_many_rows_becomes_several():
    """A list ends exactly where its room does, and not beyond."""
    rows = np.array([7, 8, LONGEST + 8, 2 * LONGEST + 9, 300_000, 1_000_000], np.int32)
    steps = np.zeros(40, np.uint16)
    end = put_steps(rows, len(rows), steps, 3, len(steps))
    found = rows[0] + np.cumsum(steps[3:end].astype(int))
    assert set(rows) <= set(found) and len(found) == len(set(found)) and found[-1] == rows[-1]
    assert put_steps(rows, len(rows), steps, 3, end) == end and put_steps(rows, len(rows), steps, 3, end - 1) == -1
    assert put_steps(rows[:2], 2, steps, 0, 2) == 2 and put_steps(rows[:2], 2, steps, 0, 1) == -1
    assert put_steps(rows, 0, steps, 40, 40) == 40 and put_steps(rows, 0, steps, -1, 40) == -1


def hopping(near):
    """The groups of `near` with lists of the shortest steps that `put_steps` allows now, and by how much longer they are."""
    offset, count, group, span, list_offset, steps = near.groups
    span, steps, rows = span.copy(), np.zeros(20 * steps.size, np.uint16), rows_of(near.groups)
    ends, k, before = [0], 0, 0
    for c in range(len(count)):
        for g in range(offset[c], offset[c] + count[c]):
            cuts = list_offset[c] + span[g, :3]
            span[g, 0] = k - ends[c]
            for part in range(2):
                there = rows[cuts[part] : cuts[part + 1]]
                k = put_steps(there, len(there), steps, k, len(steps))
                span[g, part + 1], before = k - ends[c], before + len(there)
        ends.append(k)
    return (offset, count, group, span, np.array(ends), steps), k - before


@pytest.mark.parametrize("dim, count", [(2, 40), (3, 14)])
def test_rows_out_of_reach_on_the_way_change_no_bit(dim, count, monkeypatch):
    states = []
    for longest in (LONGEST, 5):
        fluid = random_fluid(dim, "single", count, boundary=True)
        monkeypatch.setattr("fsi.particles.neighbours.LONGEST", longest)
        for near in (fluid.near, fluid.solids.near):
            near.groups, more = hopping(near)
            assert (more > 0) == (longest == 5)
        fluid.predict()
        wrench = fluid.pressure(np.zeros((fluid.owners, 6)))
        sums, impulse = fluid.correct()
        states.append([*fluid.particles.state().values(), wrench, sums, impulse])
    assert all(np.array_equal(a, b) for a, b in zip(*states, strict=True))


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
