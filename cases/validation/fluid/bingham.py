"""Steady flow of a Bingham plastic between two plates, driven by a uniform force along them.

Exact: the stress is rho f |z| from the middle of the gap. A Bingham plastic is a plug of half-width tau / (rho f) there,
and sheared at (rho f |z| - tau) / mu_inf outside it (Bird, Dai & Yarusso 1983, Rev. Chem. Eng. 1, 1-70). The run's liquid
is the Cross model with K = mu_0 / tau, whose shear rate s solves mu(s) s = rho f |z|, a quadratic; its velocity is the
integral of that.
Errors: against the Cross model (what the scheme adds) and against the plastic itself (what the model
adds to it).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

GAP, DENSITY, FORCE = 0.1, 1000.0, 1.0  # [m], [kg/m3], [m/s2]
YIELD, MU_INF, MU_0 = 20.0, 10.0, 10000.0  # [Pa], [Pa s], [Pa s]
STRESS = 0.5 * DENSITY * FORCE * GAP  # at the plates [Pa]
LENGTH = GAP


def plastic_speed(z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] of a Bingham plastic at heights z [m] above the middle."""
    plug = YIELD / (DENSITY * FORCE)
    beyond = np.maximum(np.abs(z), plug) - plug
    return DENSITY * FORCE / (2 * MU_INF) * ((0.5 * GAP - plug) ** 2 - beyond**2)


def cross_rate(stress: np.ndarray) -> np.ndarray:
    """Shear rate s [1/s] of the Cross model at a shear stress [Pa]: mu_inf s + (mu_0 - mu_inf) s / (1 + K s) = stress."""
    K = MU_0 / YIELD
    b, c = MU_0 - K * stress, -stress
    return (-b + np.sqrt(b * b - 4 * MU_INF * K * c)) / (2 * MU_INF * K)


def cross_speed(z: np.ndarray, pieces: int = 20000) -> np.ndarray:
    """Velocity [m/s] of the Cross liquid at heights z [m] above the middle, by Simpson's rule."""
    y = np.linspace(0, 0.5 * GAP, 2 * pieces + 1)
    s = cross_rate(DENSITY * FORCE * y)
    panels = (s[:-2:2] + 4 * s[1::2] + s[2::2]) * (y[1] - y[0]) / 3
    from_wall = np.concatenate([np.cumsum(panels[::-1])[::-1], [0.0]])
    return np.interp(np.abs(z), y[::2], from_wall)


class Plug(Measure):
    """The profile at the end."""

    def sample(self, sim: Simulation) -> None:
        self.u, self.z = sim.fluid.velocity[:, 0], sim.fluid.position[:, 1] - 0.5 * GAP
        self.spacing = sim.scene.spacing

    def errors(self) -> dict[str, float]:
        exact, plastic = cross_speed(self.z), plastic_speed(self.z)
        rms = lambda a, b: math.sqrt(((a - b) ** 2).mean()) / plastic.max()  # noqa: E731
        return {
            "velocity_l2": rms(self.u, exact),
            "plastic_l2": rms(self.u, plastic),
            "plug_speed": self.u.max() / cross_speed(np.zeros(1))[0] - 1,
        }


def _scene(spacing: float, folder) -> dict:
    return {
        "duration": 1.0,
        "gravity": 0.0,
        "tank": {"min": [0.0, 0.0], "max": [LENGTH, GAP], "walls": ["z-", "z+"], "periodic": ["x"]},
        "fluid": {
            "density": DENSITY,
            "rheology": {"mu_inf": MU_INF, "mu_0": MU_0, "yield_stress": YIELD},
            "still_water_level": GAP,
            "start": "zero",
            "acceleration": [FORCE, 0.0],
        },
        "numerics": {"max_time_step": 0.01, "artificial_viscosity": 0.0},
    }


NAMES = ("bingham_channel",)
CASES = {
    "bingham_channel": Case(
        "bingham_channel",
        "Bingham plastic between two plates, plug over 0.4 of the gap",
        "Exact: steady profile of the Cross model with K = mu_0 / tau and mu_0 = 1000 mu_inf (`velocity_l2`,"
        " `plug_speed`), and of the Bingham plastic that it stands for (`plastic_l2`); shares of the plug's speed.",
        {"coarse": GAP / 20, "medium": GAP / 40, "paper": GAP / 80},
        _scene,
        Plug,
        {"velocity_l2": 0.02, "plastic_l2": 0.03, "plug_speed": 0.02},
        reasons="at 20 spacings across the gap the sheared layers beside the plug are 6 spacings wide.",
    )
}
