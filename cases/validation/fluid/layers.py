"""Two liquids of unequal density, one above the other, at rest in a tank.

Exact: pressure g (sum of density x height above), no motion, a sharp interface. Errors of the pressure two spacings under
the surface and deeper, as shares of the pressure at the bottom, averaged in time over the second half of the run; speed:
root mean square of both by mass, as a share of sqrt(g H); mixed: share of the particles that end on the other liquid's
side; drift: rise of the centre of volume at the end as a share of its depth.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure

DEPTH = 0.4  # H, half of it each liquid [m]


class Layers(Measure):
    """Errors of the layered liquids at rest."""

    interval = 0.02

    def begin(self, sim) -> None:
        self.lower, self.upper = (sim.scene.liquids["lower"].density, sim.scene.fluid.density)
        self.bottom = sim.scene.gravity * 0.5 * DEPTH * (self.lower + self.upper)
        self.start = sim.fluid.position[:, -1].mean()
        self.l2, self.linf, self.speed2 = [], [], []

    def sample(self, sim) -> None:
        fluid, scene = sim.fluid, sim.scene
        z, lower = fluid.position[:, -1], fluid.liquid[fluid.label] == 1
        self.rise = z.mean() - self.start
        self.mixed = (lower != (z < -0.5 * DEPTH)).mean()
        if sim.time < 0.5 * scene.duration:
            return
        above, below = np.minimum(-z, 0.5 * DEPTH), np.maximum(-z - 0.5 * DEPTH, 0.0)
        exact = scene.gravity * (self.upper * above + self.lower * below)
        error = np.abs(fluid.pressure_values - exact)[z < -2 * scene.spacing] / self.bottom
        self.l2.append(math.sqrt((error**2).mean()))
        self.linf.append(error.max())
        mass = fluid.relative
        self.speed2.append(mass @ (fluid.velocity**2).sum(1) / mass.sum() / (scene.gravity * DEPTH))

    def errors(self) -> dict[str, float]:
        return {
            "pressure_l2": np.mean(self.l2),
            "pressure_linf": np.mean(self.linf),
            "rms_speed": math.sqrt(np.mean(self.speed2)),
            "mixed": self.mixed,
            "volume_drift": -self.rise / self.start,
        }


def layered_scene(lower: float, upper: float, **numerics):
    """Scene builder for a liquid of density `lower` under one of density `upper` [kg/m3]."""

    def scene(spacing: float, folder) -> dict:
        length = 0.5 * DEPTH
        block = {"min": [0.0, -DEPTH], "max": [length, -0.5 * DEPTH]}
        return {
            "duration": 4.0,
            "tank": {"min": [0.0, -DEPTH], "max": [length, 0.1 * DEPTH], "walls": ["x-", "x+", "z-", "z+"]},
            "fluid": {"density": upper},
            "liquids": {"lower": {"density": lower, "blocks": [block]}},
            "numerics": numerics,
        }

    return scene


SPACING = {"coarse": DEPTH / 20, "medium": DEPTH / 40, "paper": DEPTH / 80}
TARGET = {"pressure_l2": 0.003, "pressure_linf": 0.01, "rms_speed": 0.002, "mixed": 0.0, "volume_drift": 0.002}

NAMES = ("two_layers", "layers_100", "water_and_air")
CASES = {
    case.name: case
    for case in (
        Case(
            "two_layers", "Two liquids at rest, the lower one of twice the density, 4 s",
            "Exact: hydrostatic pressure of both layers, no motion, no mixing.",
            SPACING, layered_scene(2000.0, 1000.0), Layers, TARGET,
        ),
        Case(
            "layers_100", "Water under a liquid of 10 kg/m3 at rest, 4 s",
            "Exact: hydrostatic pressure of both layers, no motion, no mixing; density ratio 100.",
            SPACING, layered_scene(1000.0, 10.0), Layers, TARGET,
            reasons="at 20 mm each layer is only a few kernels high; the errors fall with the spacing by order 1 to 2.6.",
        ),
        Case(
            "water_and_air", "Water under a gas of 1.2 kg/m3 at rest, 4 s",
            "Exact: hydrostatic pressure of both layers, no motion, no mixing; density ratio 833, at a Mach number of 0.1.",
            SPACING, layered_scene(1000.0, 1.2, mach=0.1), Layers, TARGET,
            reasons="the interface is smeared over a kernel, in which the gas feels a share of the water, 833 times as heavy;"
            " its layer changes by a share of a spacing, so the error halves with it.",
        ),
    )
}  # fmt: skip
