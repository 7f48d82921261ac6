"""The time step and its reasons.

The pressure travels at c = 0.378 h sqrt(gain) / dt (`fsi.fluid.chebyshev`), so dt sets the numerical Mach number; besides, no
particle may move or accelerate through a good part of its support in a step, and the explicit viscous term has its own
limit (Morris et al. 1997, eq. 19-21). Implicit ISPH takes steps of a share of the time in which a particle falls through its
support, or by the speed (Ihmsen et al. 2014).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from fsi.fluid.chebyshev import SOUND, iteration
from fsi.fluid.rheology import explicit_limit, step_limit
from fsi.scene.model import Scene
from fsi.state import Remembers

STIFF = (
    500  # steps of explicit viscosity in an implicit one, up to which the pressure of a fluid at rest is good to 1 %
)
LAST = 20  # steps that share what the end of a run cuts off the last one
GROWTH = 1.05  # a step is at most so much longer than the one before


@dataclass
class TimeStep(Remembers):
    """Chooses the time step [s] of each step of a scene whose fluid is `depth` metres high."""

    scene: Scene
    depth: float
    previous: float | None = None
    reason: str = ""  # what set the last step
    remembered: ClassVar = ("previous", "reason")

    def __post_init__(self):
        at_rest = self._others(0.0, self.scene.gravity)
        least = self.scene.numerics.fixed_time_step or min(at_rest.values())
        self.viscosity, self.implicit = step_limit(self.scene, least)
        self.notes = []
        if self.implicit:
            ratio = least / explicit_limit(self.scene)
            self.notes = [f"viscosity: implicit, at steps {ratio:.3g} times as long as an explicit one would take"]
            if ratio > STIFF:
                self.notes[0] += f"; above {STIFF} pressures may be wrong by some per cent"

    def limits(self, speed: float, acceleration: float) -> dict[str, float]:
        """Each limit [s] by name, for the largest speed [m/s] and acceleration [m/s2] in the fluid and its boundary."""
        return self._others(speed, acceleration) | {"viscosity": self.viscosity}

    def _others(self, speed: float, acceleration: float) -> dict[str, float]:
        numerics, h = self.scene.numerics, self.scene.smoothing_length
        if numerics.solver == "iisph":
            return {
                "lambda_max": numerics.lambda_max * math.sqrt(_over(2 * h, self.scene.gravity)),
                "speed": _over(numerics.courant * h, speed),
                "max_time_step": numerics.max_time_step or math.inf,
            }
        return {
            "sound": sound_step(self.scene, self.depth),
            "speed": _over(numerics.courant * h, speed),
            "acceleration": 0.25 * math.sqrt(_over(h, acceleration)),
            "max_time_step": numerics.max_time_step or math.inf,
        }

    def choose(self, speed: float, acceleration: float) -> float:
        """The time step [s] for the coming step."""
        if self.scene.numerics.fixed_time_step:
            return self.scene.numerics.fixed_time_step
        limits = self.limits(speed, acceleration)
        self.reason = min(limits, key=limits.get)
        step = limits[self.reason]
        if not math.isfinite(step):  # no gravity, no motion, no viscosity: nothing sets a scale but the run's length
            step = self.scene.duration / 100
        if self.previous is not None:
            step = min(step, GROWTH * self.previous)
        self.previous = step
        return step


def sound_step(scene: Scene, depth: float) -> float:
    """Step [s] at which long waves in water `depth` metres deep have the scene's Mach number; inf without gravity."""
    sound = SOUND * scene.smoothing_length * math.sqrt(iteration(scene.numerics).gain)  # times the step
    return _over(sound * scene.numerics.mach, math.sqrt(scene.gravity * depth))


def _over(a: float, b: float) -> float:
    return a / b if b > 0 else math.inf


def to_reach(until: float, time: float, step: float) -> float:
    """The step [s], or the nearest below it of which a whole number reach `until`, from `LAST` steps before on: a step cut to
    what is left would jolt the fluid, whose numerical sound speed it raises."""
    left = until - time
    count = left / step * (1 - 1e-9)
    return step if count > LAST else left / max(1, math.ceil(count))
