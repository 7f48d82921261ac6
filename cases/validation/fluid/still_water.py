"""Water at rest in a tank: the pressure is rho g depth, nothing moves, and the volume stays.

Exact: hydrostatics. Errors of the pressure two spacings under the surface and deeper, as shares of rho g H, averaged
in time over the second half of the run; speed: root mean square over particles and that time, as a share of sqrt(g H);
drift: height of the centre of mass at the end above that of as much water at rest, as a share of its depth (a uniform
swelling of the water by this much). The start is no reference: over a sloped bed the lattice ends in stairs, and its
centre of mass is lower than the water's by up to 0.3 %.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure

DEPTH = 0.5  # H [m]


class Stillness(Measure):
    """Errors of water at rest, whose depth is the deepest place of the tank. `rest`: mean depth of the water up to the
    still water level and the height of its centre of mass [m]."""

    interval = 0.02

    def __init__(self, sim, rest: tuple[float, float] = (DEPTH, -0.5 * DEPTH)):
        self.rest = rest
        super().__init__(sim)

    def begin(self, sim) -> None:
        dr, low, high = sim.scene.spacing, sim.scene.tank.min, sim.scene.tank.max
        area = math.prod(b - a for a, b in zip(low[:-1], high[:-1], strict=True))
        mean = sim.fluid.count * dr**sim.scene.dimension / area
        depth, centre = self.rest
        extra = mean - depth  # what the lattice holds too much of lies on top
        self.centre = (depth * centre + 0.5 * extra**2) / mean
        self.height = sim.scene.fluid.still_water_level - sim.scene.tank.min[-1]
        self.l2, self.linf, self.speed2, self.rise = [], [], [], 0.0

    def sample(self, sim) -> None:
        fluid, scene = sim.fluid, sim.scene
        z = fluid.position[:, -1] - scene.fluid.still_water_level
        self.rise = z.mean() - self.centre
        if sim.time < 0.5 * scene.duration:
            return
        deep = z < -2 * scene.spacing
        scale = scene.fluid.density * scene.gravity
        error = np.abs(fluid.pressure_values[deep] + scale * z[deep]) / (scale * self.height)
        self.l2.append(math.sqrt((error**2).mean()))
        self.linf.append(error.max())
        self.speed2.append((fluid.velocity**2).sum(1).mean() / (scene.gravity * self.height))

    def errors(self) -> dict[str, float]:
        return {
            "pressure_l2": np.mean(self.l2),
            "pressure_linf": np.mean(self.linf),
            "rms_speed": math.sqrt(np.mean(self.speed2)),
            "volume_drift": self.rise / abs(self.centre),
        }


def still_scene(dimension: int, duration: float):
    """Scene builder for a box of water."""
    across, length = ([0.0], [1.0]) if dimension == 2 else ([0.0, 0.0], [0.3, 0.3])

    def scene(spacing: float, folder) -> dict:
        tank = {"min": [*across, -DEPTH], "max": [*length, 0.2]}
        return {"dimension": dimension, "duration": duration, "tank": tank}

    return scene


REFERENCE = "Exact: hydrostatic pressure `rho g depth`, no motion, no change of volume."
TARGET_2D = {"pressure_l2": 0.003, "pressure_linf": 0.006, "rms_speed": 0.002, "volume_drift": 0.001}
TARGET_3D = TARGET_2D | {"pressure_l2": 0.006, "pressure_linf": 0.012}
FINE_2D = {"coarse": DEPTH / 25, "medium": DEPTH / 50, "paper": DEPTH / 100}
FINE_3D = {"coarse": DEPTH / 25, "medium": DEPTH / 40, "paper": DEPTH / 50}

NAMES = ("still_water", "still_water_long", "still_water_3d")
CASES = {
    case.name: case
    for case in (
        Case(
            "still_water", "Water at rest for 5 s, 1 m long and 0.5 m deep", REFERENCE, FINE_2D,
            still_scene(2, duration=5.0), Stillness, TARGET_2D,
        ),
        Case(
            "still_water_long", "Water at rest for 60 s, 1 m long and 0.5 m deep", REFERENCE, FINE_2D,
            still_scene(2, duration=60.0), Stillness, TARGET_2D,
        ),
        Case(
            "still_water_3d", "Water at rest for 5 s in a basin of 0.3 x 0.3 x 0.5 m", REFERENCE, FINE_3D,
            still_scene(3, duration=5.0), Stillness, TARGET_3D,
        ),
    )
}  # fmt: skip
