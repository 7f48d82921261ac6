"""The plain staggered scheme, for comparison: the fluid sees the bodies' acceleration of the step before."""

from __future__ import annotations

from typing import Literal

import numpy as np

from couplers.response import Measured, respond
from fsi.protocols import BodySet, FluidLoads
from fsi.scene.coupler import CouplerSettings
from fsi.state import Remembers

WATCH = 50  # steps from one measurement of the added mass to the next


class LaggedSettings(CouplerSettings):
    """The bodies' acceleration of the step before: for comparison."""

    scheme: Literal["lagged"] = "lagged"

    def make(self, bodies: BodySet, source: object = "scene.toml") -> Lagged:
        return Lagged(bodies)


class Lagged(Remembers):
    """One pressure solution a step, at the joint acceleration a0 (nv,) of the step before; the bodies then move under its
    wrench. An error of a0 comes back as -Ma/M of itself, so that the scheme is unstable where the added mass Ma of a
    body exceeds its own mass M (Causin et al. 2005, Comput. Methods Appl. Mech. Eng. 194, 4506-4527), and before that:
    Ma of a single step is only a part of what the steps that follow bring."""

    advice = 'set coupler.scheme = "added_mass"; lagged holds bodies up to an added mass of about a third of their own'
    notes: tuple[str, ...] = ()
    remembered = ("acceleration", "_count", "_measured")

    def __init__(self, bodies: BodySet):
        self.acceleration = np.zeros(bodies.motion().jacobian.shape[2])
        self._measured = Measured()
        self._count = 0

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Advance the bodies by dt [s]; the wrench (b, 6) of the fluid about their centres of mass."""
        motion, start = bodies.motion(), self.acceleration
        if self._count % WATCH == 0:
            wrench, self._measured.response = respond(fluid, bodies, motion, start)
        else:
            wrench = fluid.pressure(motion.jacobian @ start + motion.bias)
        self._count += 1
        self.acceleration = bodies.advance(dt, wrench, np.zeros((start.size, start.size)), start)
        return wrench

    def mass_ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia (b,) of each body as last measured, see `Response.ratio`."""
        return self._measured.ratio(bodies)
