"""How long the impulse takes that sets the water around a body going: with sharp edges and with a round bottom, in 2D.

A section of `heave_resistance` starts at once with a small constant speed U, in water without gravity. Potential flow is there
at once: the impulse Ma U arrives in the first instant, and no force afterwards. The scheme needs the time that sound takes;
`late` is the share of the impulse between steps 240 and 960 that arrives in them, long after.

What arrives late is memory. The pressure equation's Laplacian, over pairs, is not the divergence of the gradient: a step
takes away `taken` of a divergence, 0.7 at a wave length of 10 spacings, 0.01 at three and nothing of a checkerboard. Sharp
edges make short ones, which thus push for hundreds of steps. Nothing in this has a time of its own, so that the lag is a
constant angle at all frequencies and time steps: a resistance in proportion to omega Ma, however small the amplitude, however
well the pressure is solved.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.coupling import models
from cases.validation.coupling.heave_resistance import DEPTH, RADIUS, SECTIONS, TOP, hull
from cases.validation.engine.case import Case, Measure, Wrong
from fsi.sph.kernel import gradient_factor

SPEED, SLOW, HALF = 1e-5, 0.01, 1.0  # m/s; 1/s of a motion as good as uniform; half length of the tank [m]
STEP, FIRST, LAST = 0.004, 240, 960  # s; steps between which `late` is read


def taken(length: float, smoothing_ratio: float = 2.0, dim: int = 2) -> float:
    """lambda, the share of a divergence of this wave length [spacings] along an axis that a step's pressure takes away on a
    lattice: that of the gradient's divergence in the Laplacian, if the pressure equation is solved."""
    reach = math.ceil(2 * smoothing_ratio)
    x = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1.0)] * dim, indexing="ij"), -1).reshape(-1, dim)
    r2 = (x**2).sum(1)
    slope, phase = gradient_factor(np.sqrt(r2), smoothing_ratio, dim), 2 * math.pi / length * x[:, 0]
    gradient = (slope * x[:, 0] * np.sin(phase)).sum()
    laplacian = 2 * (slope * r2 / (r2 + (0.1 * smoothing_ratio) ** 2) * (1 - np.cos(phase))).sum()
    return float(gradient**2 / laplacian)


class Impulse(Measure):
    """Impulse of the body on the water after each step."""

    def begin(self, sim) -> None:
        self.force = []

    def sample(self, sim) -> None:
        self.force.append(-sim.dt * models.force(sim)[0, 2])

    def errors(self) -> dict[str, float]:
        total = np.cumsum(self.force)
        return {"late": total[LAST - 1] / total[FIRST - 1] - 1}


def scene(shape: str, **numerics):
    """The `scene` of a case."""

    def build(spacing: float, folder) -> dict:
        body, asset = hull(SECTIONS[shape])
        step = STEP * spacing * 5 / RADIUS  # sound crosses the tank in steps as many as the spacings
        given = {"viscosity": "none", "artificial_viscosity": 0.0, "density_relaxation": 0.0, "fixed_time_step": step}
        return {
            "gravity": 0.0,
            "duration": LAST * step,
            "tank": {"min": [-HALF, -DEPTH], "max": [HALF, TOP]},
            "bodies": models.write(folder, [body], gravity=0.0, assets=asset),
            "coupler": {"scheme": "prescribed", "motion": {"hull": {"amplitude": SPEED / SLOW, "omega": SLOW}}},
            "numerics": given | numerics,
        }

    return build


REASONS = (
    "A step's pressure takes away a hundredth of a divergence three spacings long, of which sharp edges have some: the impulse"
    " still grows after a thousand steps, evenly in the logarithm of their number."
)


def _case(shape: str) -> Case:
    return Case(
        f"impulse_start_{shape}",
        f"A section with {'sharp edges' if shape == 'sharp' else 'a round bottom'} starts at once in water without gravity, 2D",
        "Potential flow: all of the impulse in the first instant. The half width is 5, 10 and 20 spacings.",
        {"coarse": RADIUS / 5, "medium": RADIUS / 10, "paper": RADIUS / 20},
        scene(shape),
        Impulse,
        {"late": 0.015},  # a resistance of 3 % of omega Ma, as is asked of bodies without waves
        REASONS if shape == "sharp" else "",
        fails_when={"late": Wrong("a lag of a hundredth of a turn, a resistance of 6 % of omega Ma", 0.03)},
    )


NAMES = ("impulse_start_sharp", "impulse_start_round")
CASES = {case.name: case for case in map(_case, SECTIONS)}
