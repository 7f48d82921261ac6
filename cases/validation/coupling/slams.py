"""Boxes and wedges dropped into water, and a flat plate that slaps it.

Drops: density ratios 0.1, 1 and 8 from 0.2 and 1 m above the water, free to tumble; the heavy ones go on to the bed. There
is no exact answer, but the energy of all must not rise, and no fluid may end up in a body. `energy_rise` is a share of the
energy that the falls set free.

Plate: without gravity, a plate of half width a and mass M meets the surface flat at a speed V. The fluid below gets half the
added mass of the plate, m = rho pi a^2 / 2, at once, so that the impulse is V M m / (M + m) (von Karman 1929, NACA TN 321;
Lamb 1932, art. 71). It is read off the plate's speed after a way of a twentieth of a. The blow lasts as long as the plate
takes for a spacing, and sound has to cross the plate many times in that: the time step falls as the square of the spacing.
With steps that fall as the spacing the fluid bounces off the plate, and the impulse comes out 9 % too large at 10 spacings
to a and 30 % at 20. The peak of the force has no limit as spacing and time step fall, and is not compared.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.coupling import models
from cases.validation.coupling.energy import Inside, Total
from cases.validation.engine.case import Case, Measure

RATIOS, HEIGHTS = (0.1, 1.0, 8.0), (0.2, 1.0)
HALF, PITCH, DEPTH = 0.16, 0.8, 0.8  # half width of the bodies and distance between them [m]
COARSE = 0.03  # m
PLATE, THICK, SPEED, PLATE_RATIO = 0.3, 0.06, 2.0, 2.0  # a [m], m, V [m/s]

WEDGE = " ".join(f"{x} {y} {z}" for x, z in ((-HALF, HALF), (HALF, HALF), (0.0, -HALF)) for y in (-0.5, 0.5))
FILE = """<mujoco>
  <custom><tuple name="wet">{wet}</tuple></custom>
  <option timestep="0.005" integrator="implicitfast"/>
  <asset><mesh name="wedge" vertex="{wedge}"/></asset>
  <worldbody>
    <geom name="bed" type="plane" pos="0 0 {bed}" size="20 20 1"/>
{bodies}
  </worldbody>
</mujoco>
"""


def _drops(shape: str):
    def scene(spacing: float, folder: Path) -> dict:
        falls = [(ratio, height) for height in HEIGHTS for ratio in RATIOS]
        geom = 'type="mesh" mesh="wedge"' if shape == "wedge" else f'type="box" size="{HALF} 0.5 {HALF / 2}"'
        under = HALF if shape == "wedge" else HALF / 2
        bodies, wet = [], ""
        for n, (ratio, height) in enumerate(falls):
            place = f"{(n + 0.5 - len(falls) / 2) * PITCH} 0 {height + under}"
            bodies.append(
                f'    <body name="b{n}" pos="{place}"><freejoint/><geom name="b{n}" {geom} density="{1000 * ratio}"/></body>'
            )
            wet += f'<element objtype="geom" objname="b{n}"/>'
        text = FILE.format(wet=wet, wedge=WEDGE, bed=-DEPTH, bodies="\n".join(bodies))
        (folder / "drops.xml").write_text(text, encoding="utf-8")
        end = len(falls) * PITCH / 2
        return {
            "duration": 1.5,
            "tank": {"min": [-end, -DEPTH], "max": [end, 2.4]},
            "bodies": {"set": {"mjcf": str(folder / "drops.xml")}},
        }

    return scene


FALLEN = 0.05  # m; a body that has not gone that far was not dropped


class Drops(Measure):
    """Energy of all, and fluid in the bodies at the end."""

    def begin(self, sim) -> None:
        self.total, self.inside, self.count = Total(sim), Inside(sim), sim.fluid.count
        self.height = sim.bodies.motion().position[:, 2]
        self.falls = sim.scene.gravity * float(sim.bodies.mass @ sim.bodies.motion().position[:, 2])

    def sample(self, sim) -> None:
        self.total(sim)
        self.sim = sim

    def errors(self) -> dict[str, float]:
        lost = self.sim.fluid.lost
        fallen = np.abs(self.sim.bodies.motion().position[:, 2] - self.height).min() > FALLEN
        return {
            "energy_rise": self.total.rise / self.falls if fallen else math.nan,
            "fluid_in_bodies": self.inside.count(self.sim) / self.count,
            "lost": lost / self.count,
        }


def _plate(spacing: float, folder: Path) -> dict:
    joint = models.HEAVE
    place = (0, 0, THICK / 2 + 0.5 * spacing)
    plate = models.body("plate", place, joint, "box", (PLATE, 0.5, THICK / 2), 1000 * PLATE_RATIO)
    return {
        "duration": (0.5 * spacing + 0.06 * PLATE) / SPEED * 3,
        "gravity": 0.0,
        "tank": {"min": [-2.4, -1.2], "max": [2.4, 0.3]},
        "bodies": models.write(folder, [plate], gravity=0.0),
        "fluid": {"kinematic_viscosity": 0.0},
        "numerics": {"max_time_step": 0.025 * spacing / SPEED * spacing / COARSE, "artificial_viscosity": 0.0},
    }


class Slap(Measure):
    """Speed of the plate by its way below the surface."""

    def begin(self, sim) -> None:
        sim.bodies.place({}, {"plate": -SPEED})
        self.mass, self.gap = float(sim.bodies.mass[0]), 0.5 * sim.scene.spacing
        self.way, self.speed = [-self.gap], [SPEED]

    def sample(self, sim) -> None:
        series = sim.bodies.joints()
        self.way.append(-series["joint_position"][0] - self.gap)
        self.speed.append(-series["joint_velocity"][0])

    def errors(self) -> dict[str, float]:
        added = 1000 * math.pi * PLATE**2 / 2
        speed = np.interp(0.05 * PLATE, self.way, self.speed)
        return {"impulse": (SPEED - speed) / (SPEED * added / (self.mass + added)) - 1}


NAMES = ("drops_box", "drops_wedge", "plate_slap")
CASES = {
    f"drops_{shape}": Case(
        f"drops_{shape}",
        f"{'Boxes' if shape == 'box' else 'Wedges'} of density ratios 0.1, 1 and 8 are dropped into water from 0.2 and 1 m",
        "Exact: no energy is created, as a share of the energy of the falls; no fluid gets into a body.",
        {"coarse": 0.04, "medium": 0.02, "paper": 0.01},
        _drops(shape),
        Drops,
        {"energy_rise": 0.01, "fluid_in_bodies": 0.0, "lost": 0.001},
        "The wedge of 8 times the water's density comes down on the bed and runs over particles in a gap that has no room for"
        " them: some pass through it, up to 1.3 spacings deep, and whether one is inside at the end is chance.",
    )
    for shape in ("box", "wedge")
} | {
    "plate_slap": Case(
        "plate_slap",
        "A flat plate of 0.6 m slaps the water at 2 m/s",
        "Exact: von Karman (1929), impulse of the impact. The peak of the force depends on spacing and time step without"
        " limit and is not compared.",
        {"coarse": COARSE, "medium": COARSE / 2, "paper": COARSE / 4},
        _plate,
        Slap,
        {"impulse": 0.1},
    ),
}
