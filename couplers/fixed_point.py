"""The reference scheme: pressure and bodies are solved in turn until the acceleration that goes in comes out."""

from __future__ import annotations

from typing import Literal

import numpy as np

from couplers.quasi_newton import QuasiNewton
from couplers.response import Measured, respond
from fsi.protocols import BodySet, FluidLoads
from fsi.scene.coupler import CouplerSettings
from fsi.state import Remembers

WATCH = 50  # steps from one measurement of the added mass to the next
PASSES = 50  # at most, in a step
ROUNDING = 100.0


class FixedPointSettings(CouplerSettings):
    """Pressure and bodies in turn, until the acceleration settles to `tolerance`: the reference."""

    scheme: Literal["fixed_point"] = "fixed_point"

    def make(self, bodies: BodySet, source: object = "scene.toml") -> FixedPoint:
        return FixedPoint(bodies, self.tolerance)


class FixedPoint(Remembers):
    """The joint acceleration a (nv,) of a step is the fixed point of a -> H(a): the pressure for walls that accelerate
    with a, its wrench on the bodies, and their mean acceleration under it from MuJoCo. Every pass starts from the same
    state: the bodies are saved and restored bit for bit, and the pressure of the fluid is solved anew from the last
    step's. Nothing is assumed of H, no added mass is measured; `QuasiNewton` finds the fixed point. A scalar relaxation
    (Aitken) would do for one joint, but not for several that the fluid couples.

    Settled is an acceleration with r = H(a) - a such that r^T M r <= tolerance^2 (a^T M a + sum F^2 / m), with the mass
    matrix M and the force F of the fluid on each body of mass m: what is left in force, as a share of the forces at work.
    Near that rounding takes over; a residual up to `ROUNDING` times as large that falls no more is settled as well.
    """

    advice = (
        "set a smaller numerics.mach or a finer spacing, or soften what drives the body (a spring, contact or actuator)"
    )
    remembered = ("acceleration", "unsettled", "_count", "_solver", "_measured")

    def __init__(self, bodies: BodySet, tolerance: float = 1e-6):
        self.acceleration = np.zeros(bodies.motion().jacobian.shape[2])
        self.tolerance, self.unsettled = tolerance, 0
        self._solver = QuasiNewton()
        self._measured = Measured()
        self._count = 0

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Advance the bodies by dt [s]; the settled wrench (b, 6) of the fluid about their centres of mass."""
        motion, inertia, state = bodies.motion(), bodies.inertia(), bodies.state()
        guess, none, sizes = self.acceleration, np.zeros_like(inertia), []
        self._solver.begin()
        for attempt in range(PASSES):
            if attempt:
                bodies.restore(state)
            if attempt == 0 and self._count % WATCH == 0:
                wrench, self._measured.response = respond(fluid, bodies, motion, guess)
            else:
                wrench = fluid.pressure(motion.jacobian @ guess + motion.bias)
            found = bodies.advance(dt, wrench, none, guess)
            rest, force = found - guess, (wrench[:, :3] ** 2).sum(1)
            sizes.append(np.sqrt(rest @ inertia @ rest))
            goal = self.tolerance * np.sqrt(guess @ inertia @ guess + (force / bodies.mass).sum())
            if _settled(sizes, goal):
                break
            guess = self._solver.next(guess, found, np.sqrt(np.diag(inertia)), 10 * goal)
        else:
            self.unsettled += 1
        self._count += 1
        self.acceleration = found
        return wrench

    @property
    def notes(self) -> tuple[str, ...]:
        """Steps that did not settle."""
        if not self.unsettled:
            return ()
        return (f"fixed_point: {self.unsettled} of {self._count} steps did not settle within {PASSES} passes",)

    def mass_ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia (b,) of each body as last measured, see `Response.ratio`."""
        return self._measured.ratio(bodies)


def _settled(sizes: list[float], goal: float) -> bool:
    """Whether the last of the residuals is small enough, or as small as rounding lets it become."""
    stalled = len(sizes) > 3 and sizes[-1] > 0.5 * min(sizes[:-1])
    return sizes[-1] <= (ROUNDING * goal if stalled else goal)
