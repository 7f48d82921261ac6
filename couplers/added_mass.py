"""The default scheme: added mass measured in every step, so that body and fluid accelerate together."""

from __future__ import annotations

import numpy as np

from couplers.response import Response, mass_ratio, respond
from fsi.protocols import BodySet, FluidLoads


class AddedMass:
    """Body acceleration and pressure settled together within the step.

    For given positions and velocities the wrench is affine in the joint acceleration a (nv,) that the walls of the
    bodies move with, F(a) = F0 + sum_k R_k (a_k - a0_k). One pressure solution at a0, the acceleration of the last
    step, gives F0; one linear response to each joint acceleration gives R_k, and with the jacobian J of the bodies the
    added inertia Ma = -J^T R. `bodies.advance` then solves the equations of motion with (M + Ma), which is stable for
    any ratio of added to own mass, and the pressure is corrected to the acceleration that came out.

    `acceleration` (nv,) is the scheme's only memory.
    """

    advice = (
        "set a smaller numerics.mach or a finer spacing, or soften what drives the body (a spring, contact or actuator)"
    )
    notes: tuple[str, ...] = ()

    def __init__(self, bodies: BodySet):
        self.acceleration = np.zeros(bodies.motion().jacobian.shape[2])
        self._response: Response | None = None

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Advance the bodies by dt [s]; the settled wrench (b, 6) of the fluid about their centres of mass."""
        motion, start = bodies.motion(), self.acceleration
        wrench = fluid.pressure(motion.jacobian @ start + motion.bias)
        response = self._response = respond(fluid, bodies, motion)
        if response is None:
            self.acceleration = bodies.advance(dt, wrench, np.zeros((start.size, start.size)), start)
            return wrench
        self.acceleration = bodies.advance(dt, wrench, response.inertia(), start)
        rise = (self.acceleration - start)[response.dofs]
        for pressure, factor in zip(response.pressures, rise, strict=True):
            fluid.add(pressure, factor)
        return wrench + np.einsum("m,mbi->bi", rise, response.changes)

    def mass_ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia (b,) of each body in the last step, see `Response.ratio`."""
        return mass_ratio(self._response, bodies)
