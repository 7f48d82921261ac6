"""Flows between plates whose exact profile is known: two liquids, implicit steps, the eddies of a laminar flow.

Exact: a uniform acceleration f along the plates is balanced by the shear stress, (mu u')' = -rho f, u = 0 at the plates;
between two liquids velocity and shear stress are continuous. Errors are root mean squares over the particles at the end,
as shares of the largest velocity.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

GAP, FORCE = 1e-3, 1e-4  # [m], [m/s2]
NU = 1e-6  # of the fluid [m2/s]
LOWER = {"density": 2000.0, "kinematic_viscosity": 2e-6}  # four times as viscous [Pa s] as the fluid above it
LONG = 100  # time step of the implicit case, in steps of an explicit one


def two_liquids_speed(z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] at heights z [m]: u = -rho f z^2 / (2 mu) + (a / mu) z below, the same from the upper plate above."""
    below, above = LOWER["density"], 1000.0
    mu1, mu2, d = below * LOWER["kinematic_viscosity"], above * NU, 0.5 * GAP
    # u1 = (-r1 f z^2 / 2 + a z) / mu1, u2 = (-r2 f y^2 / 2 + b y) / mu2 with y = GAP - z; u1 = u2, stress 1 = -stress 2
    system = np.array([[d / mu1, -d / mu2], [1.0, 1.0]])
    right = [0.5 * FORCE * d * d * (below / mu1 - above / mu2), FORCE * d * (below + above)]
    a, b = np.linalg.solve(system, right)
    y = GAP - z
    lower = (-0.5 * below * FORCE * z * z + a * z) / mu1
    upper = (-0.5 * above * FORCE * y * y + b * y) / mu2
    return np.where(z < d, lower, upper)


def single_speed(z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] of one liquid at heights z [m]."""
    return 0.5 * FORCE / NU * z * (GAP - z)


class Flow(Measure):
    """The profile at the end."""

    exact = staticmethod(single_speed)

    def sample(self, sim: Simulation) -> None:
        self.u, self.z = sim.fluid.velocity[:, 0].copy(), sim.fluid.position[:, 1].copy()

    def errors(self) -> dict[str, float]:
        largest = self.exact(np.linspace(0, GAP, 1001)).max()
        error = np.abs(self.u - self.exact(self.z)) / largest
        return {"velocity_l2": math.sqrt((error**2).mean()), "velocity_linf": error.max()}


class TwoLiquids(Flow):
    """The profile of two liquids, and particles that have left their own layer."""

    exact = staticmethod(two_liquids_speed)

    def sample(self, sim: Simulation) -> None:
        super().sample(sim)
        self.mixed = ((sim.fluid.liquid[sim.fluid.label] == 1) != (self.z < 0.5 * GAP)).mean()

    def errors(self) -> dict[str, float]:
        return super().errors() | {"mixed": self.mixed}


class Eddies(Flow):
    """Eddy viscosity of the laminar profile, (C_s dr)^2 |u'|, as a share of its largest."""

    def sample(self, sim: Simulation) -> None:
        super().sample(sim)
        self.eddies = sim.fluid.fields["eddy_viscosity"].astype(float)
        self.scale = (sim.scene.numerics.smagorinsky * sim.scene.spacing) ** 2 * FORCE / NU

    def errors(self) -> dict[str, float]:
        error = np.abs(self.eddies / self.scale - np.abs(0.5 * GAP - self.z))
        return {"eddy_viscosity_l2": math.sqrt((error**2).mean()) / (0.5 * GAP)} | super().errors()


def _scene(duration: float, liquids: dict | None = None, **numerics):
    def scene(spacing: float, folder) -> dict:
        step = LONG * 0.125 * (1.5 * spacing) ** 2 / NU
        extra = {"max_time_step": step} if numerics.get("viscous_step") == "implicit" else {}
        return {
            "duration": duration,
            "gravity": 0.0,
            "tank": {"min": [0.0, 0.0], "max": [GAP, GAP], "walls": ["z-", "z+"], "periodic": ["x"]},
            "fluid": {
                "kinematic_viscosity": NU,
                "still_water_level": GAP,
                "start": "zero",
                "acceleration": [FORCE, 0.0],
            },
            "liquids": liquids or {},
            "numerics": numerics | extra,
        }

    return scene


LOWER_HALF = {"lower": LOWER | {"blocks": [{"min": [0.0, 0.0], "max": [GAP, 0.5 * GAP]}]}}
SPACING = {"coarse": GAP / 20, "medium": GAP / 40, "paper": GAP / 80}
TARGET = {"velocity_l2": 0.02, "velocity_linf": 0.04}

NAMES = ("two_liquids_channel", "implicit_viscosity", "eddy_viscosity")
CASES = {
    case.name: case
    for case in (
        Case(
            "two_liquids_channel", "Two liquids between plates, the lower of twice the density and four times as viscous",
            "Exact: two parabolas with equal velocity and stress where they meet.",
            SPACING, _scene(1.5, LOWER_HALF), TwoLiquids, TARGET | {"mixed": 0.0},
        ),
        Case(
            "implicit_viscosity", "Flow between plates in steps a hundred times as long as explicit viscosity allows",
            "Exact: steady parabola.", SPACING, _scene(2.0, viscous_step="implicit"), Flow, TARGET,
        ),
        Case(
            "eddy_viscosity", "Smagorinsky's eddy viscosity in a laminar flow between plates",
            "Exact: (C_s dr)^2 |u'| of the steady parabola, which the eddies change by less than 1e-5.",
            SPACING, _scene(1.0, turbulence="smagorinsky"), Eddies, TARGET | {"eddy_viscosity_l2": 0.05},
        ),
    )
}  # fmt: skip
