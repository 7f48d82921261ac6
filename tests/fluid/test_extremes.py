"""Sizes, densities and viscosities far from a wave tank's: water at rest stays at rest, a column falls as it must."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


@pytest.mark.parametrize(
    "spacing, density, viscosity",
    [
        (1e-4, 1000, 1e-6),
        (10.0, 1000, 1e-6),
        (0.02, 1.0, 1e-6),
        (0.02, 13600, 1e-6),
        (0.02, 1000, 0.0),
        (0.02, 1000, 1.0),
    ],
)
def test_a_pool_stays_at_rest(spacing, density, viscosity):
    depth = 16 * spacing
    fluid = {"density": density, "kinematic_viscosity": viscosity}
    sim = Simulation(still_tank(spacing=spacing, depth=depth, length=depth, fluid=fluid), threads=1)
    wave = np.sqrt(9.81 * depth)
    sim.run(5 * depth / wave)
    z, p = sim.fluid.position[:, 1], sim.fluid.pressure_values
    error = (p / (density * 9.81) + z)[z < -2 * spacing] / depth
    assert np.sqrt((error**2).mean()) < 0.005
    assert np.sqrt((sim.fluid.velocity**2).sum(1).mean()) < 0.005 * wave
    assert abs(z.mean() + 0.5 * depth) < 0.001 * depth and sim.fluid.lost == 0


def column(spacing, density, viscosity, gravity=9.81) -> Simulation:
    """A column 8 spacings wide and 16 high that is let go in a tank four times as wide."""
    a = 8 * spacing
    block = {"min": [0, 0], "max": [a, 2 * a]}
    return Simulation(
        Scene.model_validate(
            {
                "spacing": spacing,
                "duration": 3 * np.sqrt(a / max(gravity, 1.0)),
                "gravity": gravity,
                "tank": {"min": [0, 0], "max": [4 * a, 4 * a], "walls": ["x-", "x+", "z-", "z+"]},
                "fluid": {
                    "density": density,
                    "kinematic_viscosity": viscosity,
                    "start": "converged",
                    "blocks": [block],
                },
            }
        ),
        threads=1,
    )


def test_collapsing_columns_of_all_sizes_and_densities_are_similar():
    """Without viscosity nothing but sqrt(a / g) sets a scale: all reach as far at the same time."""
    fronts = []
    for spacing, density in ((1e-4, 1000), (0.02, 1000), (0.02, 1.0), (0.02, 13600), (10.0, 1000)):
        sim = column(spacing, density, 0.0)
        sim.run(1.5 * np.sqrt(8 * spacing / 9.81))
        fronts.append(sim.fluid.position[:, 0].max() / (8 * spacing))
        assert sim.fluid.lost == 0 and sim.balance.kinetic + sim.balance.potential < 1.001 * sim.balance.energy_at_start
    assert np.ptp(fronts) < 0.05 and 1.5 < np.mean(fronts) < 3.5


def test_a_column_of_tar_creeps_in_implicit_steps():
    """1e3 Pa s: it sags by mg / viscosity, far slower than it would fall, and never springs."""
    sim = column(0.02, 1000, 1.0)
    speed = []
    sim.run(on_step=lambda sim: speed.append(sim.balance.max_speed))
    assert sim.fluid.rheology.implicit
    assert 0 < max(speed) < 0.2 * np.sqrt(9.81 * 0.32) and sim.fluid.lost == 0
    assert sim.balance.kinetic + sim.balance.potential < sim.balance.energy_at_start


def test_nothing_moves_without_gravity():
    sim = column(0.02, 1000, 1e-6, gravity=0.0)
    start = sim.fluid.position.copy()
    sim.run()
    assert np.abs(np.sort(sim.fluid.position, 0) - np.sort(start, 0)).max() < 0.01 * 0.02


@pytest.mark.parametrize("step", [0.0005, 0.00025])
def test_steps_far_below_those_of_sound_do_not_feed_a_collapse(step):
    """The front closes the gap before the wall: drawn in by all of gamma in each of these steps it gained 33 and 86 %."""
    scene = {
        "spacing": 0.05,
        "duration": 0.6,
        "tank": {"min": [0.0, 0.0], "max": [0.6, 0.5], "walls": ["x-", "x+", "z-", "z+"]},
        "fluid": {"start": "converged", "blocks": [{"min": [0.0, 0.0], "max": [0.3, 0.3]}]},
        "numerics": {"fixed_time_step": step},
    }
    sim, energy = Simulation(Scene.model_validate(scene), threads=1), []
    sim.run(on_step=lambda sim: energy.append(sim.balance.kinetic + sim.balance.potential))
    rise = np.array(energy) - np.minimum.accumulate(energy)
    assert rise.max() < 0.05 * energy[0] and sim.fluid.lost == 0
