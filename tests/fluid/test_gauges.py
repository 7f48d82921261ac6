"""Instruments in a fluid whose surface and pressure are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from tanks import still_tank

from fsi.fluid.gauges import Surface, elevation, pressure_at
from fsi.simulation.loop import Simulation

DR, H = 0.05, 0.1


def pool(dim):
    axes = [(np.arange(20) + 0.5) * DR] * (dim - 1) + [-(np.arange(12) + 0.5) * DR]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("x", [0.5, 0.512])
def test_elevation_is_half_a_spacing_above_the_top_layer(dim, x):
    assert elevation(pool(dim), np.full(dim - 1, x), DR, 1.5 * DR) == pytest.approx(0.0, abs=0.05 * DR)


def test_elevation_ignores_spray_and_follows_a_slope():
    points = pool(2)
    points[:, 1] += 0.1 * (points[:, 0] - 0.5)
    points = np.vstack([points, [[0.5, 0.4]]])
    assert elevation(points, np.array([0.5]), DR, 1.5 * DR) == pytest.approx(0.0, abs=0.06 * DR)
    assert np.isnan(elevation(points, np.array([5.0]), DR, 1.5 * DR))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_probe_reads_hydrostatic_pressure_even_on_the_wall(dim):
    points = pool(dim)
    pressure = -9810 * points[:, -1]
    for place in ([0.5, 0.5, -0.3], [0.0, 0.5, -0.2]):
        point = np.array(place if dim == 3 else [place[0], place[2]])
        assert pressure_at(points, pressure, point, 1.5 * DR, 9810.0) == pytest.approx(-9810 * place[2], rel=1e-6)
    assert pressure_at(points, pressure, np.full(dim, 9.0), 1.5 * DR, 9810.0) == 0.0


@pytest.mark.parametrize("dim", [2, 3])
def test_a_probe_over_the_surface_reads_no_pressure(dim):
    points = pool(dim)
    for height in (0.1 * DR, DR, 2 * DR):
        point = np.array([0.5] * (dim - 1) + [height])
        assert pressure_at(points, -9810 * points[:, -1], point, 1.5 * DR, 9810.0) == 0.0
    under = np.array([0.5] * (dim - 1) + [-DR])
    assert pressure_at(points, -9810 * points[:, -1] - 2000, under, 1.5 * DR, 9810.0) == pytest.approx(9810 * DR - 2000)


def basin(dim, still=lambda x: 0.0 * x, solid=lambda points: np.zeros(len(points), bool)):
    """Fluid 0.5 m deep below z = still(x) in a tank from x = 0 (and y = 0) on, and its boundary particles: walls, floor and
    the inside of `solid`."""
    side = (np.arange(-4, 24) + 0.5) * DR
    grid = np.stack(np.meshgrid(*[side] * (dim - 1), (np.arange(-14, 10) + 0.5) * DR, indexing="ij"), -1)
    points = grid.reshape(-1, dim)
    walls = (points[:, :-1] < 0).any(1) | (points[:, -1] < -0.5) | solid(points)
    rise = still(points[:, 0])  # the columns end in a part of a particle, which none is: shift them as a whole
    points[~walls, -1] += rise[~walls]
    fluid = points[~walls & (points[:, -1] < rise)]
    fluid = fluid[~solid(fluid)]
    return fluid, points[walls]


def places(dim):
    """A corner, places at and near the wall, and the middle of the tank."""
    offsets = np.array([0.0, 0.25, 0.5, 1.0, 2.0]) * DR
    if dim == 2:
        return [(x,) for x in (*offsets, 0.5)]
    return [(x, y) for x in (*offsets, 0.5) for y in (0.0, 0.25 * DR, DR, 0.5)]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("ratio", [1.5, 2.0])
def test_still_water_reads_zero_at_walls_and_in_corners(dim, ratio):
    fluid, solid = basin(dim)
    found = [elevation(fluid, np.array(place), DR, ratio * DR, solid) for place in places(dim)]
    np.testing.assert_allclose(found, 0.0, atol=0.05 * DR)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("slope", [-0.2, 0.1, 0.3])
def test_a_sloping_surface_reads_right_at_the_wall(dim, slope):
    fluid, solid = basin(dim, lambda x: slope * x)
    found = [elevation(fluid, np.array(place), DR, H, solid) - slope * place[0] for place in places(dim)]
    np.testing.assert_allclose(found, 0.0, atol=0.1 * DR)


def test_beside_a_column_and_over_solids():
    """A column of radius 0.2 m through the surface reads nan over itself and right around itself; over a bed that lies
    1.5 m high the surface is that above it, and a bed above the water has none."""
    fluid, solid = basin(3, solid=lambda p: np.hypot(p[:, 0] - 0.6, p[:, 1] - 0.6) < 0.2)
    for turn in np.linspace(0, 2 * np.pi, 9):
        for gap in (0.1, 0.5, 1.0, 2.0):
            place = 0.6 + (0.2 + gap * DR) * np.array([np.cos(turn), np.sin(turn)])
            assert elevation(fluid, place, DR, H, solid) == pytest.approx(0.0, abs=0.1 * DR)
    assert np.isnan(elevation(fluid, np.array([0.6, 0.6]), DR, H, solid))
    fluid, solid = basin(2, solid=lambda p: (p[:, 0] > 0.3) & (p[:, 1] < -0.15 + 0.5 * (p[:, 0] > 0.8)))
    assert [elevation(fluid, np.array([x]), DR, H, solid) for x in (0.2, 0.5)] == pytest.approx([0, 0], abs=0.05 * DR)
    assert np.isnan(elevation(fluid, np.array([1.0]), DR, H, solid))


def test_under_an_overhang_the_surface_below_is_read_and_a_submerged_body_is_none():
    fluid, solid = basin(2, solid=lambda p: (p[:, 1] > 0.2) & (p[:, 0] < 0.5))
    assert elevation(fluid, np.array([0.25]), DR, H, solid) == pytest.approx(0.0, abs=0.05 * DR)
    fluid, solid = basin(2, solid=lambda p: (abs(p[:, 0] - 0.6) < 0.2) & (abs(p[:, 1] + 0.25) < 0.1))
    assert elevation(fluid, np.array([0.6]), DR, H, solid) == pytest.approx(0.0, abs=0.05 * DR)
    fluid, solid = basin(2, solid=lambda p: (abs(p[:, 0] - 0.6) < 0.2) & (abs(p[:, 1]) < 0.15))  # a lid that floats
    assert np.isnan(elevation(fluid, np.array([0.6]), DR, H, solid))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("periodic", [(), ("x",)])
def test_the_cells_around_a_vertical_hold_all_that_counts(dimension, periodic):
    scene = still_tank(dimension, spacing=0.05, depth=0.4, length=1.0)
    scene = scene.model_copy(update={"tank": scene.tank.model_copy(update={"periodic": periodic})})
    sim = Simulation(scene, threads=1)
    surface = Surface(sim.fluid)
    sim.fluid.position[:, -1] += 0.03 * np.cos(2 * np.pi * sim.fluid.position[:, 0])
    points = [
        np.resize([x, y], dimension - 1) for x, y in ((0.0, 0.0), (0.02, 0.5), (0.3, 0.9), (0.52, 1.0), (1.0, 0.4))
    ]
    before = [surface(point) for point in points]
    np.testing.assert_allclose(before, [0.03 * np.cos(2 * np.pi * p[0]) for p in points], atol=0.1 * 0.05)
    sim.step()
    fluid, solids = sim.fluid, sim.fluid.solids
    unsorted = SimpleNamespace(start=np.empty(0), grid=None)
    there = solids.position[: solids.count]
    rest = SimpleNamespace(count=0, sort=unsorted)
    whole = SimpleNamespace(
        scene=scene, position=fluid.position, boundary=there, sort=unsorted, solids=rest, reductions=fluid.reductions,
        particles=fluid.particles, mean_spacing=fluid.mean_spacing,
    )  # fmt: skip
    assert [surface(p) for p in points] == [Surface(whole)(p) for p in points]
    if periodic:  # the first frame is read while there are ghosts beyond the ends
        count, shift = len(fluid.position), np.eye(dimension)[0]
        whole.position = np.concatenate([fluid.position - shift, fluid.position, fluid.position + shift])
        whole.particles = SimpleNamespace(own=np.repeat([False, True, False], count))
        assert [surface(p) for p in points] == [Surface(whole)(p) for p in points]
