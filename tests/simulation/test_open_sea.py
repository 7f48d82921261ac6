"""A box of water with a sea around it: what goes in and out is booked, and the waves are those that were asked for."""

import sys
from pathlib import Path

import numpy as np
import pytest

import fsi
from fsi.errors import SceneError
from fsi.fluid.constants import density_relaxation
from fsi.fluid.gauges import elevation
from fsi.scene.geometry import incident_waves
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

sys.path.insert(0, str(Path(__file__).parent))
from test_state import Kept

PERIOD, HEIGHT = 1.2, 0.1


def box(**more):
    return Scene.model_validate(
        {
            "spacing": 0.05,
            "duration": 1.0,
            "tank": {"min": [-2.0, -0.5], "max": [2.0, 0.2]},
            "sea": {"waves": {"wave_height": HEIGHT, "period": PERIOD}, "zone": 0.9},
            "output": {"series": 1e-6, "particles": 0},
        }
        | more
    )


def heights(sim, places):
    solid = sim.fluid.boundary
    found = [elevation(sim.fluid.position, np.array([x]), 0.05, 0.1, solid) for x in places]
    return np.array(found), incident_waves(sim.scene).elevation(sim.time, places[:, None])


def test_the_waves_are_there_from_the_first_step_and_all_impulses_are_booked():
    sim = Simulation(box(), recorders=[Kept()], threads=1)
    sim.run(until=0.3)
    found, exact = heights(sim, np.linspace(-1.0, 1.0, 9))
    assert np.abs(found - exact).max() < 0.1 * HEIGHT  # a fifth of a spacing
    balance = sim.balance
    assert balance.momentum_residual < 1e-5 and balance.audits > 10
    assert sim.fluid.sea.impulse.any() and balance.wavemaker_work != 0 and balance.force_work != 0
    assert abs(balance.dissipated) < 0.3 * balance.kinetic  # of the half of the waves' energy that moves
    assert sim.fluid.lost == 0 and not sim.warnings


@pytest.mark.slow
@pytest.mark.parametrize("start", ["waves", "rest"])
def test_waves_keep_their_height_and_the_level_stays(start):
    sea = {"waves": {"wave_height": HEIGHT, "period": PERIOD}, "zone": 0.9, "start": start}
    scene = box(spacing=0.02, duration=8 * PERIOD, sea=sea, numerics={"mach": 0.3})
    rows, sim = [], Simulation(scene)
    sim.run(on_step=lambda sim: rows.append(heights(sim, np.zeros(1))) if sim.time > 6 * PERIOD else None)
    found, exact = np.array(rows)[:, :, 0].T
    assert np.ptp(found) == pytest.approx(np.ptp(exact), rel=0.05)
    assert abs((found - exact).mean()) < 0.03 * HEIGHT


def test_the_density_of_a_sea_without_bodies_is_held_as_far_as_is_stable_under_its_crests():
    """From four times what damps the slowest mode in a step on that mode grows; its depth is that under a crest."""
    scene, depth = box(), 0.5
    crest = depth + incident_waves(scene).crest
    plain = density_relaxation(box(sea=None), depth)
    found = density_relaxation(scene, depth)
    assert found == pytest.approx(2 * plain * (depth / crest) ** 2) and found < 4 * plain * (depth / crest) ** 2
    assert density_relaxation(box(numerics={"density_relaxation": 0.01}), depth) == 0.01


def test_another_seed_of_an_open_sea_is_refused():
    """Its water is in its waves from the start: a reset would keep those of the old seed."""
    sea = {"waves": {"kind": "irregular", "Hm0": 0.05, "peak_period": 1.2}, "zone": 0.9}
    with fsi.open(box(sea=sea), threads=1) as sim:
        sim.reset()
        with pytest.raises(SceneError, match=r"sea.waves.seed: an open sea begins in its waves"):
            sim.reset(seed=2)
