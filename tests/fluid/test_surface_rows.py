"""The rows of particles under a free surface: what gravity and pressure leave on each, and where they stand after a while."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import build
from fsi.simulation.loop import Simulation
from fsi.sph import kernel
from fsi.sph.columns import COUNTS
from fsi.sph.predictor import surface_gate

G, ROWS = 9.81, 6
PAIRED = {"precision": "double", "artificial_viscosity": 0.0, "standing_pressure": "paired"}


def rows(sim, wall, length) -> tuple[np.ndarray, np.ndarray]:
    """Mean gaps (ROWS,) between the top rows away from the walls, and standard deviations of the rows, in spacings."""
    dr, x = sim.scene.spacing, sim.fluid.position
    inside = ((x[:, :-1] > wall) & (x[:, :-1] < length - wall)).all(1)
    z = np.sort(x[inside, -1])[::-1]
    wide = round((length - 2 * wall) / dr) ** (sim.fluid.dim - 1)
    layers = z[: (ROWS + 1) * wide].reshape(ROWS + 1, wide) / dr
    return -np.diff(layers.mean(1)), layers.std(1)[:ROWS]


def columns(sim, wall, length) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (ROWS,) of the gaps between the top particles of columns a spacing wide, in spacings; under a
    wave, where rows are no level lines."""
    dr, x = sim.scene.spacing, sim.fluid.position
    place = np.floor(x[:, 0] / dr).astype(int)
    gaps = []
    for column in range(round(wall / dr), round((length - wall) / dr)):
        z = np.sort(x[place == column, 1])[::-1]
        gaps.append(-np.diff(z[: ROWS + 1]) / dr)
    gaps = np.array(gaps)
    return gaps.mean(0), gaps.std(0)


@pytest.mark.parametrize("ratio", [1.5, 1.75, 2.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_hydrostatic_pressure_carries_every_row_of_a_lattice(dim, ratio):
    dr, depth = 0.1, 1.5
    length = 2.6 if dim == 2 else 1.5
    scene = still_tank(dim, dr, depth, length, numerics={"smoothing_ratio": ratio} | PAIRED)
    fluid = Fluid(scene, build(scene), Team(1))
    rest, dt = np.zeros((fluid.owners, 6)), 1e-4
    fluid.begin(dt, rest[:, :3], rest)
    fluid.predict()
    fluid.pressure(rest)
    high = fluid.position[:, -1].copy()
    away = ((fluid.position[:, :-1] > 0.65) & (fluid.position[:, :-1] < length - 0.65)).all(1) & (high > 0.65 - depth)
    pressure = fluid.work.field[: fluid.count, dim]
    pressure[:] = -1000 * G * high * fluid.work.coefficients[: fluid.count, COUNTS]
    fluid.correct()
    left = fluid.velocity[away, -1] / (G * dt)  # of g
    for row in range(6):
        at = np.abs(high[away] + (row + 0.5) * dr) < 0.1 * dr
        assert at.any()
        assert np.abs(left[at]).max() < (0.004 if ratio == 2.0 else 0.011), row


@pytest.mark.parametrize("ratio, left", [(1.5, 0.1), (1.75, 0.06), (2.0, 0.02)])
@pytest.mark.parametrize("dim", [2, 3])
def test_pressure_equation_of_a_lattice_gives_the_pressure_of_its_depth(dim, ratio, left):
    """Rows under a flat surface, one unknown each, hydrostatic below. With the second row's share from thresholds made for 2D
    the pressure was that of 0.40 spacings more depth in 3D, and the top rows rose by 0.08."""
    known = kernel.lattice(1.0, ratio, dim)
    offsets = np.stack(np.meshgrid(*[np.arange(-4, 5.0)] * dim, indexing="ij"), -1).reshape(-1, dim)
    r2, fall = (offsets**2).sum(1), offsets[:, -1].astype(int)
    F = kernel.gradient_factor(np.sqrt(r2), ratio, dim)
    a, depth = F * r2 / (r2 + (0.1 * ratio) ** 2), 20
    equations, right = np.zeros((depth, depth)), np.zeros(depth)
    for row in range(depth):
        there = row + fall >= 0
        gate = surface_gate((F * r2)[there].sum() / dim, known.inside)
        equations[row, row] = a[there].sum() + known.surface_factor * gate * a[~there].sum()
        for weight, other in zip(a[there], row + fall[there], strict=True):
            if other < depth:
                equations[row, other] -= weight
            else:
                right[row] += weight * (other + 0.5)
    too_deep = np.linalg.solve(equations, right) - (np.arange(depth) + 0.5)
    assert np.abs(too_deep[3:]).max() < left
    assert np.abs(too_deep[:3]).max() < 0.1


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_film_over_a_bed_has_a_top_row(count):
    """A bed was once taken for a wall beside the film, whose top row then was spray."""
    dr, length = 0.1, 2.6
    numerics = {"precision": "double", "artificial_viscosity": 0.0}
    scene = still_tank(2, dr, count * dr, length, numerics=numerics)
    fluid = Fluid(scene, build(scene), Team(1))
    rest = np.zeros((fluid.owners, 6))
    fluid.begin(1e-4, rest[:, :3], rest)
    fluid.predict()
    counts = fluid.work.coefficients[: fluid.count, COUNTS]
    inside = (np.abs(fluid.position[:, 0] - 0.5 * length) < 0.5) & (fluid.position[:, 1] > -dr)
    assert counts[inside] == pytest.approx(1 + kernel.surface_rows(2.0, 2).excess[0], abs=0.05)


@pytest.mark.parametrize("dim, length, depth", [(2, 0.8, 0.3), pytest.param(3, 0.4, 0.3, marks=pytest.mark.slow)])
def test_rows_at_rest_stay_a_spacing_apart(dim, length, depth):
    scene = still_tank(dim, 0.02, depth, length, duration=2.0)
    with_walls = Simulation(scene)
    with_walls.run()
    gaps, spread = rows(with_walls, 0.1, length)
    assert np.abs(gaps - 1).max() < (0.05 if dim == 2 else 0.07)
    assert spread.max() < 0.1
    assert np.sqrt((with_walls.fluid.velocity**2).sum(1).mean()) < 0.01 * np.sqrt(G * depth)


@pytest.mark.slow
def test_rows_stay_a_spacing_apart_under_a_standing_wave():
    length, depth, dr = 1.0, 0.4, 0.02
    sim = Simulation(still_tank(2, dr, depth, length, duration=4.0))
    k, amplitude = np.pi / length, 0.03
    x, z = sim.fluid.position.T
    speed = amplitude * np.sqrt(G * k * np.tanh(k * depth)) / np.sinh(k * depth)
    sim.fluid.velocity[:, 0] = speed * np.sin(k * x) * np.cosh(k * (z + depth))
    sim.fluid.velocity[:, 1] = -speed * np.cos(k * x) * np.sinh(k * (z + depth))
    found = []
    sim.run(on_step=lambda sim: found.append(columns(sim, 0.1, length)) if sim.step_count % 50 == 0 else None)
    gaps = np.mean([mean for mean, _ in found[len(found) // 2 :]], 0)
    assert np.abs(gaps - 1).max() < 0.05
