"""Sand with a yield stress under water whose top slopes by 3 degrees stays where it is.

At the floor its weight in water asks for rho' g d tan(3 deg), up to 75 Pa over depths d of 0.1 to 0.15 m: less than its yield
stress of 1000 Pa. Below that it creeps with mu_0, as a stiff liquid does, by rho' g d^2 tan(3 deg) / (2 mu_0) at most, 12 mm
in a minute: `creep` is the way of its fastest tenth in a minute over ten spacings, from the second half of the run. A larger
mu_0 creeps less, but steps of thousands of times the explicit one leave its pressure wrong (docs/guide/fluids.md).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from fsi.simulation.loop import Simulation

SLOPE = math.tan(math.radians(3.0))
TOE, MINUTE, SPACINGS = -0.4, 60.0, 10.0  # height of the sand at its thin end [m], [s]


class Creep(Measure):
    """How fast the sand creeps, how fast the water is, and the energy that comes from nowhere."""

    def begin(self, sim: Simulation) -> None:
        self.half, self.end, self.before = None, sim.scene.duration, None

    def sample(self, sim: Simulation) -> None:
        fluid = sim.fluid
        sand = fluid.liquid[fluid.label] == 1
        place = np.empty((len(fluid.label), 2))
        place[fluid.label] = fluid.position
        if self.half is None and sim.time >= 0.5 * self.end:
            self.half = sim.time, place
        self.place, self.time, self.sand = place, sim.time, np.sort(fluid.label[sand])
        self.speed = float(np.sqrt((fluid.velocity[~sand] ** 2).sum(1).mean()))
        self.spacing, self.leaks = sim.scene.spacing, fluid.lost

    def errors(self) -> dict[str, float]:
        start, place = self.half
        way = np.linalg.norm((self.place - place)[self.sand], axis=1)
        fastest = float(np.quantile(way, 0.9)) / (self.time - start)
        return {
            "creep": fastest * MINUTE / (SPACINGS * self.spacing),
            "rms_speed": self.speed / math.sqrt(9.81 * 0.5),
            "leaks": float(self.leaks),
        }


def _scene(spacing: float, folder) -> dict:
    sand = {
        "density": 1950.0,
        "rheology": {"mu_inf": 1.0, "mu_0": 3e4, "yield_stress": 1000.0},
        "blocks": [{"polygon": [[0.0, -0.5], [1.0, -0.5], [1.0, TOE], [0.0, TOE + SLOPE]]}],
    }
    return {
        "duration": 2.0,
        "tank": {"min": [0.0, -0.5], "max": [1.0, 0.2]},
        "fluid": {"start": "converged"},
        "liquids": {"sand": sand},
        "output": {},
    }


NAMES = ("slope_at_rest",)
CASES = {
    "slope_at_rest": Case(
        "slope_at_rest",
        "Sand of 1950 kg/m3 with a yield stress of 1000 Pa under water, its top sloping by 3 degrees, 2 s",
        "Exact: it stays; less than a spacing in a minute.",
        {"coarse": 0.025, "medium": 0.02, "paper": 0.0125},
        _scene, Creep, {"creep": 0.1, "rms_speed": 0.01, "leaks": 0.0},
        fails_when={"creep": Wrong("two spacings in a minute", 0.2)},
    )
}  # fmt: skip
