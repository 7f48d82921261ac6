"""Cells that hold particles alone give the order and the lists of a dense grid; empty space costs nothing."""

from dataclasses import replace

import numpy as np
import pytest
from tanks import still_tank

from fsi.compute.team import Team
from fsi.errors import SceneError
from fsi.fluid.fluid import Fluid
from fsi.particles.cells import Grid
from fsi.particles.layout import build
from fsi.particles.neighbours import Neighbours, rows_of
from fsi.particles.sorts import make_sort
from fsi.scene.check import check_scene


def cloud(dim: int):
    rng = np.random.default_rng(dim)
    points, walls = rng.uniform(0, 1, (1500, dim)), rng.uniform(-0.1, 0, (300, dim))
    points[:20] += 5  # outside
    points[30] = np.nan
    points[40:60] *= 0.01  # crowded
    return points, walls


def searched(grid: Grid, points, walls, threads: int = 1):
    """Orders of both kinds, and the groups and lists of the first."""
    dim, team = points.shape[1], Team(threads)
    wet, dry = make_sort(grid, team), make_sort(grid, team)
    order, order_dry = wet.update(points).copy(), dry.update(walls).copy()
    m, b = wet.inside, dry.inside
    xs = np.zeros((dim, m + b + 16), np.float32)
    xs[:, :m], xs[:, m : m + b] = (points[order[:m]] - grid.lower).T, (walls[order_dry[:b]] - grid.lower).T
    near = Neighbours(8, dim, 0.08, 0.16, team)
    near.update(wet, 0, xs, [(wet, 0), (dry, m)])
    first, count, group, span, start, _ = near.groups
    lst = rows_of(near.groups)
    found = [order, order_dry]
    for c in range(len(count)):
        end = first[c] + count[c]
        found += [group[first[c] : end + 1], span[first[c] : end], lst[start[c] : start[c] + span[end - 1, 2]]]
    return [a.copy() for a in found], wet.nbytes


@pytest.mark.parametrize("dim, threads", [pytest.param(2, 1, marks=pytest.mark.slow), (3, 1), (3, 2)])
def test_order_and_lists_are_those_of_the_grid(dim, threads):
    grid = Grid.over([-0.1] * dim, [1.1] * dim, 0.08, 0.16)
    dense, compact = (searched(replace(grid, compact=c), *cloud(dim), threads)[0] for c in (False, True))
    assert not grid.compact and len(dense) == len(compact)
    assert all(np.array_equal(a, b) for a, b in zip(dense, compact, strict=True))


def test_empty_space_costs_nothing():
    points, walls = cloud(3)
    sizes = []
    for far in (1.1, 1000.0):
        grid = Grid.over([-0.1] * 3, [far] * 3, 0.08, 0.16, len(points))
        points[:20] = 1.0
        sizes.append(searched(replace(grid, compact=True), points, walls)[1])
    assert grid.compact and grid.cells > 1e11 and sizes[0] == sizes[1]


def test_no_particles_and_none_inside_are_fine():
    grid = replace(Grid.over([0.0] * 3, [1.0] * 3, 0.1, 0.2), compact=True)
    sort = make_sort(grid, Team(1))
    for points in (np.empty((0, 3)), np.full((5, 3), 7.0)):
        assert len(sort.update(points)) == len(points) and sort.inside == 0


def test_fluid_may_leave_by_an_open_side_and_is_counted_by_it():
    """What passes the open floor of a tank without walls is no loss, what passes another side is."""
    scene = still_tank(2, spacing=0.05, tank={"min": [0, -0.5], "max": [1, 0.5], "walls": [], "open": ["z-"]})
    fluid = Fluid(scene, build(scene), Team(1))
    n = fluid.count
    fluid.position[:2] = [[0.5, -7.0], [9.0, 0.0]]
    fluid.begin(1e-4, np.zeros((1, 3)), np.zeros((1, 6)))
    assert fluid.count == n - 2 and fluid.lost == 1 and fluid.departed.left.tolist() == [1]
    assert fluid.departed.last_seen.tolist() == [9.0, 0.0]
    with pytest.raises(SceneError, match=r"tank.open: x- has a wall"):
        check_scene(still_tank(2, tank={"min": [0, -0.5], "max": [1, 0.5], "walls": ["x-"], "open": ["x-"]}))
