"""Steady flows of liquids with a yield stress and of grains, whose profiles are known.

Herschel-Bulkley between plates, driven by a uniform force along them (Bird, Dai & Yarusso 1983): with the stress at the plate
T = rho f H / 2 and the plug |z| < a = tau / (rho f), the velocity is
u = n / (n + 1) (rho f / k)^(1/n) ((H/2 - a)^(1 + 1/n) - (|z| - a)^(1 + 1/n)) outside the plug.

Grains of the mu(I) law down a plane inclined by an angle theta (Bagnold's profile; Jop, Forterre & Pouliquen 2006): mu(I) =
tan(theta) fixes I over the whole depth D, and u = 2/3 I sqrt(phi g cos(theta)) / d (D^(3/2) - (D - z)^(3/2)), phi the ratio
of the layer's density to the grains'. In the run gravity is normal to the plane, g cos(theta), and a force g sin(theta) acts
along it.

Both start from rest and take their time: the same sums over a lattice of 80 rows that no particle leaves are 16 % slow after
1 s and 0.1 % off after 4 s between the plates; down the plane they are 17 % slow after 4 s and 3 % after 8 s.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

GAP, DENSITY, FORCE = 0.1, 1000.0, 1.0  # [m], [kg/m3], [m/s2]
YIELD, CONSISTENCY, EXPONENT = 20.0, 8.0, 0.5  # [Pa], [Pa s^n], 1
PLUG = YIELD / (DENSITY * FORCE)

DEPTH, SLOPE = 0.1, math.radians(26.0)  # [m]
GRAINS = {
    "friction": math.tan(math.radians(21.0)),
    "friction_fast": math.tan(math.radians(33.0)),
    "grain_diameter": 0.005,
}
PACKING, GRAIN_DENSITY, NUMBER = 0.6, 2500.0, 0.3


def herschel_bulkley_speed(z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] at heights z [m] above the middle of the gap."""
    power = 1 + 1 / EXPONENT
    beyond = np.maximum(np.abs(z), PLUG) - PLUG
    scale = EXPONENT / (EXPONENT + 1) * (DENSITY * FORCE / CONSISTENCY) ** (1 / EXPONENT)
    return scale * ((0.5 * GAP - PLUG) ** power - beyond**power)


def bagnold_speed(z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] at heights z [m] above the plane."""
    slow, fast = GRAINS["friction"], GRAINS["friction_fast"]
    number = NUMBER * (math.tan(SLOPE) - slow) / (fast - math.tan(SLOPE))
    scale = 2 / 3 * number / GRAINS["grain_diameter"] * math.sqrt(PACKING * 9.81 * math.cos(SLOPE))
    return scale * (DEPTH**1.5 - np.maximum(DEPTH - z, 0.0) ** 1.5)


class Profile(Measure):
    """The profile at the end, as a share of the largest speed."""

    exact = staticmethod(herschel_bulkley_speed)
    origin = 0.5 * GAP

    def sample(self, sim: Simulation) -> None:
        self.u, self.z = sim.fluid.velocity[:, 0].copy(), sim.fluid.position[:, 1] - self.origin

    def errors(self) -> dict[str, float]:
        exact = self.exact(self.z)
        largest = self.exact(np.linspace(-self.origin, DEPTH, 1001)).max()
        return {
            "velocity_l2": math.sqrt(((self.u - exact) ** 2).mean()) / largest,
            "speed": self.u.max() / largest - 1,
        }


class Bagnold(Profile):
    exact, origin = staticmethod(bagnold_speed), 0.0


def channel(spacing: float, folder) -> dict:
    law = {
        "law": "herschel_bulkley",
        "consistency": CONSISTENCY,
        "exponent": EXPONENT,
        "yield_stress": YIELD,
        "mu_0": 2e4,
    }
    return {
        "duration": 4.0,
        "gravity": 0.0,
        "tank": {"min": [0.0, 0.0], "max": [GAP, GAP], "walls": ["z-", "z+"], "periodic": ["x"]},
        "fluid": {
            "density": DENSITY,
            "rheology": law,
            "still_water_level": GAP,
            "start": "zero",
            "acceleration": [FORCE, 0.0],
        },
        "numerics": {"max_time_step": 0.01, "artificial_viscosity": 0.0},
    }


def incline(spacing: float, folder) -> dict:
    law = {"law": "granular", **GRAINS, "inertial_number": NUMBER, "grain_density": GRAIN_DENSITY, "mu_0": 3e3}
    return {
        "duration": 16.0,
        "gravity": 9.81 * math.cos(SLOPE),
        "tank": {"min": [0.0, 0.0], "max": [DEPTH, 1.5 * DEPTH], "walls": ["z-"], "periodic": ["x"]},
        "fluid": {
            "density": PACKING * GRAIN_DENSITY,
            "rheology": law,
            "still_water_level": DEPTH,
            "acceleration": [9.81 * math.sin(SLOPE), 0.0],
        },
        "numerics": {"artificial_viscosity": 0.0, "shifting": 0.05},
    }


NAMES = ("herschel_bulkley_channel", "granular_incline")
CASES = {
    "herschel_bulkley_channel": Case(
        "herschel_bulkley_channel",
        "Herschel-Bulkley liquid with n = 0.5 between two plates, plug over 0.4 of the gap",
        "Exact: power-law profile beside a plug; shares of the plug's speed.",
        {"coarse": GAP / 20, "medium": GAP / 40, "paper": GAP / 80},
        channel, Profile, {"velocity_l2": 0.02, "speed": 0.02},
    ),
    "granular_incline": Case(
        "granular_incline",
        "Grains of the mu(I) law down a plane of 26 degrees",
        "Exact: Bagnold's profile; shares of the speed at the surface.",
        {"coarse": DEPTH / 20, "medium": DEPTH / 40, "paper": DEPTH / 80},
        incline, Bagnold, {"velocity_l2": 0.02, "speed": 0.02},
        "At this slope 1 % of stress is 10 % of velocity. The top row meets half of the pairs across the plane below it; what"
        " they carry in its place is right within 7 %.",
    ),
}  # fmt: skip
