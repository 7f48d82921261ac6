"""Waves in the fluid, in one short flume."""

import math

import numpy as np
import pytest

from fsi.fluid.gauges import elevation
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

DEPTH, HEIGHT, LENGTH, DR = 0.1, 0.03, 2.4, 0.0125


def test_a_solitary_wave_travels_and_is_taken_up_by_the_piston_that_made_it():
    """It passes two gauges at its height and speed, meets the wall, comes back, and most of its energy leaves the water
    through the piston."""
    scene = Scene.model_validate(
        {
            "spacing": DR,
            "duration": 7.0,
            "tank": {"min": [0, -DEPTH], "max": [LENGTH, DEPTH]},
            "waves": {"kind": "solitary", "wave_height": HEIGHT, "absorb": True},
            "numerics": {"artificial_viscosity": 0.0},
        }
    )
    sim = Simulation(scene, threads=1)
    time, surface, kinetic = [], [], []

    def watch(sim):
        time.append(sim.time)
        kinetic.append(sim.balance.kinetic)
        surface.append([elevation(sim.fluid.position, np.array([x]), DR, 2 * DR) for x in (0.8, 1.6)])

    sim.run(on_step=watch)
    time, surface, kinetic = np.array(time), np.array(surface), np.array(kinetic)
    on_its_way = time < 2.9
    crests = surface[on_its_way].argmax(0)
    assert surface[crests, [0, 1]] == pytest.approx(HEIGHT, rel=0.12)
    speed = 0.8 / np.diff(time[crests])[0]
    assert speed == pytest.approx(math.sqrt(9.81 * (DEPTH + HEIGHT)), rel=0.05)
    assert kinetic[-1] < 0.06 * kinetic[(time > 2.3) & (time < 2.8)].mean()
    assert sim.movers.absorber.shift < -0.01  # it has given way
    assert sim.fluid.lost == 0
