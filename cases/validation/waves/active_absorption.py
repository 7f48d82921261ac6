"""Regular waves in a tank with a wall at its end, whose piston takes up what the wall sends back.

Exact: the wave that leaves the piston is the one asked for, whatever comes back. Five gauges separate the waves towards
the wall from those towards the piston; what the first are off the asked height and phase, over the height of the second,
is the part that the piston reflects. Without absorption it reflects all.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from cases.validation.theory.separation import first_harmonic, separate, wavenumber_of
from fsi.fluid.gauges import elevation
from fsi.simulation.loop import Simulation

G, DEPTH, KD, HEIGHT = 9.81, 0.2, 1.0, 0.1  # the height in depths
K = KD / DEPTH
OMEGA = math.sqrt(G * K * math.tanh(KD))
PERIOD, LENGTH = 2 * math.pi / OMEGA, 2 * math.pi / K
GAUGES = LENGTH * (0.7 + 0.15 * np.arange(7))
END = 1.9 * LENGTH  # no resonance of the tank, whose waves would hide the piston's
START, RECORD = 10 * PERIOD, 4 * PERIOD


class Reflection(Measure):
    """What the piston sends back of what comes to it."""

    interval = PERIOD / 40

    def begin(self, sim: Simulation) -> None:
        self.time, self.elevation = [], []

    def sample(self, sim: Simulation) -> None:
        if sim.time >= START:
            dr, h = sim.scene.spacing, sim.scene.smoothing_length
            self.time.append(sim.time)
            self.elevation.append([elevation(sim.fluid.position, np.array([x]), dr, h) for x in GAUGES])

    def errors(self) -> dict[str, float]:
        found = first_harmonic(np.array(self.time), np.array(self.elevation), OMEGA)
        leaving, coming, _ = separate(GAUGES, found, wavenumber_of(GAUGES, found, K))
        asked = 0.5 * HEIGHT * DEPTH  # the piston's phase makes it real
        return {"reflection": abs(leaving - asked) / abs(coming), "height": abs(leaving) / asked - 1}


def scene(spacing: float, folder) -> dict:
    return {
        "duration": START + RECORD,
        "tank": {"min": [0.0, -DEPTH], "max": [round(END / spacing) * spacing, 0.5 * DEPTH]},
        "waves": {"wave_height": HEIGHT * DEPTH, "period": PERIOD, "absorb": True},
    }


NAMES = ("active_absorption",)
CASES = {
    "active_absorption": Case(
        "active_absorption",
        "A piston that takes up the waves a wall sends back, kd = 1",
        "Exact: the waves asked for leave the piston, and no others.",
        {level: HEIGHT * DEPTH / per_height for level, per_height in (("coarse", 3), ("medium", 6), ("paper", 12))},
        scene,
        Reflection,
        {"reflection": 0.1, "height": 0.1},
    )
}
