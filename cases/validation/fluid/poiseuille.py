"""Flow between two plates, started from rest by a uniform force along them.

Exact: series of Morris, Fox & Zhu (1997), J. Comput. Phys. 136, 214-226, eq. 21, with their values: plates 1 mm apart,
nu = 1e-6 m2/s, force 1e-4 m/s2, Reynolds number 0.0125. The velocities along the plates are compared at the five times of
their figure 3, as a share of the largest velocity in the end.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

GAP, VISCOSITY, FORCE = 1e-3, 1e-6, 1e-4  # [m], [m2/s], [m/s2]
TIMES = (0.0225, 0.045, 0.1125, 0.225, 1.0)  # [s]
LARGEST = FORCE * GAP**2 / (8 * VISCOSITY)  # [m/s]


def exact_speed(z: np.ndarray, t: float, terms: int = 200) -> np.ndarray:
    """Velocity [m/s] at heights z [m] above the lower plate at time t [s]."""
    n = 2 * np.arange(terms)[:, None] + 1
    decay = np.exp(-((n * math.pi / GAP) ** 2) * VISCOSITY * t)
    start = 4 * FORCE * GAP**2 / (VISCOSITY * (math.pi * n) ** 3) * np.sin(n * math.pi * z / GAP) * decay
    return FORCE / (2 * VISCOSITY) * z * (GAP - z) - start.sum(0)


class Profile(Measure):
    """Velocity profiles at given times."""

    def begin(self, sim: Simulation) -> None:
        self.due, self.found = list(TIMES), []

    def sample(self, sim: Simulation) -> None:
        if not self.due or sim.time < self.due[0] * (1 - 1e-9):
            return
        self.due.pop(0)
        u, z = sim.fluid.velocity[:, 0], sim.fluid.position[:, 1]
        self.found.append(math.sqrt(((u - exact_speed(z, sim.time)) ** 2).mean()) / LARGEST)
        self.centre = u[np.abs(z - 0.5 * GAP) < sim.scene.spacing].max() / LARGEST - 1

    def errors(self) -> dict[str, float]:
        return {"velocity_l2": max(self.found), "steady_centre": self.centre}


def _scene(spacing: float, folder) -> dict:
    return {
        "duration": TIMES[-1],
        "gravity": 0.0,
        "tank": {"min": [0.0, 0.0], "max": [GAP, GAP], "walls": ["z-", "z+"], "periodic": ["x"]},
        "fluid": {
            "kinematic_viscosity": VISCOSITY,
            "still_water_level": GAP,
            "start": "zero",
            "acceleration": [FORCE, 0.0],
        },
    }


NAMES = ("poiseuille",)
CASES = {
    "poiseuille": Case(
        "poiseuille",
        "Start of the flow between two plates",
        "Exact: series of Morris et al. (1997). Largest root mean square error of the profiles at their five times;"
        " velocity midway in the end; both as shares of the largest velocity.",
        {"coarse": GAP / 20, "medium": GAP / 40, "paper": GAP / 80},
        _scene,
        Profile,
        {"velocity_l2": 0.02, "steady_centre": 0.02},
    )
}
