"""Boxes and spheres of six density ratios float side by side, each free to move in every way; soft springs keep them in
their places along the water.

Exact: Archimedes. Released a spacing above their rest, they have to find it: `draft` is the largest distance of a mean height
over the last quarter of the run from Archimedes' in spacings, `drift` how far a mean height moves from the third quarter to
the last, in spacings too. The water level that counts is that of the particles in the tank and of what the bodies displace
at rest. All lengths are whole numbers of spacings: seven particles along 7.2 spacings carry a twentieth less than the weight
of the water, and a box of 0.9 lies 0.18 spacings too deep on them. Bodies are four spacings and more apart: with 2.4 between
box and wall its yaw grows until it lies at the wall, and a light box within 2 of it goes there.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from cases.validation.coupling import models
from cases.validation.engine.case import Case, Measure

RATIOS = (0.02, 0.05, 0.1, 0.25, 0.5, 0.9)
WIDE, HIGH, RADIUS = 0.36, 0.24, 0.18  # m
PITCH, DEPTH, DURATION = 0.6, 0.48, 20.0  # distance from body to body [m], m, s
END, ACROSS = 0.24, 0.48  # more room beyond the outermost bodies, half width of the tank in three dimensions [m]


def draft(shape: str, dimension: int, ratio: float) -> float:
    """Depth of the lowest point of a body at rest [m]."""
    if shape == "box":
        return ratio * HIGH
    if dimension == 2:  # immersed share of a disc of radius 1 at depth d
        share = lambda d: (np.arccos(1 - d) - (1 - d) * np.sqrt(d * (2 - d))) / np.pi  # noqa: E731
    else:
        share = lambda d: d * d * (3 - d) / 4  # noqa: E731
    return RADIUS * brentq(lambda d: share(d) - ratio, 0, 2)


def displaced(shape: str, dimension: int, deep: float) -> float:
    """Volume, in two dimensions area, of a body that is `deep` in the water."""
    d = max(deep, 0.0)
    if shape == "box":
        return WIDE ** (dimension - 1) * d
    if dimension == 2:
        return RADIUS**2 * np.arccos(1 - d / RADIUS) - (RADIUS - d) * np.sqrt(d * (2 * RADIUS - d))
    return np.pi * d * d * (RADIUS - d / 3)


def _joints(dimension: int, mass: float) -> str:
    """Free motion, with springs along the water that swing a body of this mass [kg] in 4 s."""
    stiffness = mass * (2 * np.pi / 4.0) ** 2
    hold = f'stiffness="{stiffness:.6g}" damping="{0.2 * np.sqrt(stiffness * mass):.6g}"'
    if dimension == 2:
        return f'<joint type="slide" axis="1 0 0" {hold}/><joint type="slide" axis="0 0 1"/>' + models.PITCH
    slides = "".join(f'<joint type="slide" axis="{axis}" {hold}/>' for axis in ("1 0 0", "0 1 0"))
    return slides + '<joint type="slide" axis="0 0 1"/><joint type="ball"/>'


class Rest(Measure):
    """Heights of all bodies, against those of rest."""

    interval = 0.05

    def __init__(self, sim, shape: str):
        self.shape, self.time, self.height = shape, [], []
        super().__init__(sim)

    def begin(self, sim) -> None:
        self.spacing, self.duration = sim.scene.spacing, sim.scene.duration
        dimension = sim.scene.dimension
        centre = HIGH / 2 if self.shape == "box" else RADIUS
        drafts = np.array([draft(self.shape, dimension, ratio) for ratio in RATIOS])
        surface = np.prod(np.subtract(sim.scene.tank.max, sim.scene.tank.min)[:-1])
        water = sim.fluid.count * self.spacing**dimension
        under = sum(displaced(self.shape, dimension, deep) for deep in drafts)
        self.rest = centre - drafts + (water + under) / surface - DEPTH

    def sample(self, sim) -> None:
        self.time.append(sim.time)
        self.height.append(sim.bodies.motion().position[:, 2])

    def errors(self) -> dict[str, float]:
        t, z = np.array(self.time) / self.duration, np.array(self.height)
        third, last = z[(t > 0.5) & (t <= 0.75)].mean(0), z[t > 0.75].mean(0)
        errors = {
            "draft": np.abs(last - self.rest).max() / self.spacing,
            "drift": np.abs(last - third).max() / self.spacing,
        }
        return errors | {
            f"draft_{r:g}": (a - b) / self.spacing for r, a, b in zip(RATIOS, last, self.rest, strict=True)
        }


def _scene(shape: str, dimension: int):
    def scene(spacing: float, folder) -> dict:
        bodies, length = [], len(RATIOS) * PITCH
        for n, ratio in enumerate(RATIOS):
            centre = HIGH / 2 if shape == "box" else RADIUS
            place = ((n + 0.5) * PITCH - length / 2, 0.0, centre - draft(shape, dimension, ratio) + spacing)
            size = (WIDE / 2, 0.5 if dimension == 2 else WIDE / 2, HIGH / 2) if shape == "box" else (RADIUS, 0.5)
            joints = _joints(
                dimension, 1000 * ratio * displaced(shape, dimension, HIGH if shape == "box" else 2 * RADIUS)
            )
            kind, along_y = ("cylinder", True) if shape == "ball" and dimension == 2 else (shape, False)
            kind = "sphere" if kind == "ball" else kind
            size = size[:1] if kind == "sphere" else size
            bodies.append(models.body(f"{shape}_{ratio:g}", place, joints, kind, size, 1000 * ratio, along_y=along_y))
        across, end = [] if dimension == 2 else [ACROSS], length / 2 + END
        return {
            "dimension": dimension,
            "duration": DURATION,
            "tank": {"min": [-end, *(-y for y in across), -DEPTH], "max": [end, *across, 0.48]},
            "bodies": models.write(folder, bodies),
        }

    return scene


def _case(shape: str, dimension: int) -> Case:
    name = f"archimedes_{shape}{'_3d' if dimension == 3 else ''}"
    what = {"box": "Boxes", "ball": "Spheres" if dimension == 3 else "Cylinders"}[shape]
    levels = {"coarse": 0.04, "medium": 0.02, "paper": 0.01} if dimension == 2 else {
        "coarse": 0.06, "medium": 0.04, "paper": 0.03}  # fmt: skip
    return Case(
        name,
        f"{what} of density ratios {', '.join(f'{r:g}' for r in RATIOS)} float, {dimension}D, {DURATION:g} s",
        "Exact: Archimedes' draft. Errors in shares of the particle spacing.",
        levels,
        _scene(shape, dimension),
        lambda sim: Rest(sim, shape),
        {"draft": 0.1, "drift": 0.1},
        reasons="The lightest bodies lie too high, 0.02 in three dimensions by 0.12 spacings, a body without weight by 0.3: the"
        " pressure of the last particles under them ends there. All others are within 0.07.",
    )


NAMES = ("archimedes_box", "archimedes_ball", "archimedes_box_3d", "archimedes_ball_3d")
CASES = {case.name: case for case in (_case(shape, d) for d in (2, 3) for shape in ("box", "ball"))}
