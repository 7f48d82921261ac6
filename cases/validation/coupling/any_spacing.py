"""A box and a cylinder float in a tank, at 20 spacings that fit neither the tank nor them.

Exact: Archimedes. Both are drawn where they float, half under water that is up to z = 0. Errors are the largest of all
spacings, as shares of the spacing: `volume` of the water at the start, over the area of its surface; `level`, a gauge between
the two over the last second; `box`, `cylinder`: heights of the bodies over it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cases.validation.coupling import models
from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.engine.several import runs

DEPTH, LENGTH, DURATION, SERIES = 0.4, 1.6, 4.0, 20
WIDE, HIGH, RADIUS = 0.3, 0.2, 0.15  # of the box and the cylinder [m]
DAMPER = 60.0  # on the heave of each [N s/m]
UNDER = WIDE * HIGH / 2 + math.pi * RADIUS**2 / 2  # water that they displace [m2]


def variants(spacing: float, folder: Path) -> Mapping[str, dict]:
    """Plain scenes by name; `spacing` is the coarsest."""
    joint = f'<joint type="slide" axis="0 0 1" damping="{DAMPER:g}"/>'
    bodies = [
        models.body("box", (-0.4, 0.0, 0.0), joint, "box", (WIDE / 2, 0.5, HIGH / 2), 500.0),
        models.body("cylinder", (0.4, 0.0, 0.0), joint, "cylinder", (RADIUS, 0.5), 500.0, along_y=True),
    ]
    tank = {"min": [-LENGTH / 2, -DEPTH], "max": [LENGTH / 2, 0.3]}
    rows = DEPTH / spacing * np.linspace(1.0, 1.8, SERIES, endpoint=False)
    return {
        f"{n:.4g} rows": {
            "spacing": DEPTH / n,
            "duration": DURATION,
            "tank": tank,
            "gauges": {"middle": {"x": 0.0}},
            "bodies": models.write(folder, bodies),
        }
        for n in rows
    }


class Afloat(Measure):
    """Where the water and the bodies are, in spacings."""

    interval = 0.02

    def __init__(self, sim):
        self.seen: list[list[float]] = []
        super().__init__(sim)

    def begin(self, sim) -> None:
        self.spacing, self.duration = sim.scene.spacing, sim.scene.duration
        water = sim.fluid.total_count * sim.fluid.mean_spacing**2
        self.volume = (water + UNDER - LENGTH * DEPTH) / LENGTH / self.spacing

    def sample(self, sim) -> None:
        if sim.time > self.duration - 1.0:
            level = sim.instruments.elevations()["middle"]
            self.seen.append([level, *sim.bodies.motion().position[:, 2]])

    def errors(self) -> dict[str, float]:
        level, box, cylinder = np.mean(self.seen, axis=0) / self.spacing
        return {"volume": self.volume, "level": level, "box": box, "cylinder": cylinder}


def judge(seen: Mapping[str, Afloat]) -> dict[str, float]:
    found = [measure.errors() for measure in seen.values()]
    return {name: max(abs(errors[name]) for errors in found) for name in found[0]}


NAMES = ("any_spacing",)
CASES = {
    "any_spacing": Case(
        "any_spacing",
        f"A box and a cylinder float at {SERIES} spacings that fit neither the tank nor them",
        "Exact: Archimedes' draft, still water level. Errors in shares of the spacing.",
        {"coarse": DEPTH / 15, "medium": DEPTH / 30, "paper": DEPTH / 60},
        variants, Afloat, dict.fromkeys(("volume", "level", "box", "cylinder"), 0.02),
        reasons="Particles at rest keep the order of their lattice, which bears some shear: the rows under a flat bottom"
        " hold it up or let it down by up to 0.15 spacings, a round one by a third of that.",
        run=runs(variants, Afloat, judge),
        fails_when=dict.fromkeys(("volume", "level", "box", "cylinder"), Wrong("a lattice that solids cut, unmended", 0.19)),
    )
}  # fmt: skip
