"""Whole runs against exact answers: hydrostatics, a falling block, a dam break's energy."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.errors import RunError
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


def hydrostatic_error(sim) -> float:
    """Relative L2 error of the pressure against rho g depth, two spacings under the surface and deeper."""
    fluid, scene = sim.fluid, sim.scene
    deep = fluid.position[:, -1] < -2 * scene.spacing
    exact = -1000 * 9.81 * fluid.position[deep, -1]
    return float(np.sqrt(((fluid.pressure_values[deep] - exact) ** 2).mean()) / (1000 * 9.81 * fluid.depth))


@pytest.mark.parametrize("dimension, spacing, length, until", [(2, 0.01, 1.0, 5.0), (3, 0.025, 0.3, 2.0)])
def test_still_water_stays_still(dimension, spacing, length, until):
    sim = Simulation(still_tank(dimension, spacing, length=length))
    start = sim.fluid.position[:, -1].mean()
    errors = []
    sim.run(until, lambda sim: errors.append(hydrostatic_error(sim)) if sim.step_count % 20 == 0 else None)
    drift = 2 * (sim.fluid.position[:, -1].mean() - start) / 0.5
    speed = np.sqrt((sim.fluid.velocity**2).sum(1).mean()) / np.sqrt(9.81 * 0.5)
    assert np.mean(errors[len(errors) // 2 :]) < (0.003 if dimension == 2 else 0.01)
    assert abs(drift) < (0.001 if dimension == 2 else 0.005)
    assert speed < 0.005
    assert sim.fluid.lost == 0


def test_a_free_block_falls_like_a_stone():
    scene = Scene.model_validate(
        {
            "spacing": 0.02,
            "duration": 0.3,
            "tank": {"min": [0, -2], "max": [1, 1], "walls": ["z-"]},
            "fluid": {"blocks": [{"min": [0.4, 0.5], "max": [0.6, 0.7], "velocity": [0.5, 0.0]}]},
        }
    )
    sim = Simulation(scene)
    start = sim.fluid.position.mean(0)
    sim.run()
    fall = sim.fluid.position.mean(0) - start
    # x += dt u_new overshoots the parabola by g t dt / 2, and a step is up to 8 ms
    assert fall[0] == pytest.approx(0.15, rel=1e-5)
    assert fall[1] == pytest.approx(-0.5 * 9.81 * 0.3 * (0.3 + sim.time / sim.step_count), rel=0.01)
    assert np.ptp(sim.fluid.velocity[:, 1]) < 0.05


def dam_break(**numerics) -> Simulation:
    scene = Scene.model_validate(
        {
            "spacing": 0.02,
            "duration": 1.2,
            "tank": {"min": [0, 0], "max": [2, 2], "walls": ["x-", "x+", "z-", "z+"]},
            "fluid": {"start": "converged", "blocks": [{"min": [0, 0], "max": [0.5, 1]}]},
            "numerics": numerics,
        }
    )
    return Simulation(scene)


def test_dam_break_never_gains_energy_and_loses_no_particle():
    sim = dam_break()
    energy = []
    sim.run(on_step=lambda sim: energy.append(sim.balance.kinetic + sim.balance.potential))
    assert max(np.diff(energy)) < 1e-3 * sim.balance.energy_at_start
    assert max(energy) < 1.001 * sim.balance.energy_at_start
    assert sim.fluid.lost == 0
    assert (sim.fluid.position > 0).all() and (sim.fluid.position < 2).all()


def test_an_unstable_run_stops_and_says_so():
    with pytest.raises(RunError, match="unstable at t = "):
        dam_break(fixed_time_step=0.2).run()
