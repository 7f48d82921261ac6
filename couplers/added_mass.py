"""The default scheme: added mass measured in every step, so that body and fluid accelerate together."""

from __future__ import annotations

import numpy as np

from fsi.protocols import BodySet, FluidLoads

PLANE = (0, 2, 4)  # components of a spatial vector that exist in two dimensions: x, z, pitch


class AddedMass:
    """Body acceleration and pressure settled together within the step.

    For given positions and velocities the wrench is affine in the joint acceleration a (nv,) that the walls of the
    bodies move with, F(a) = F0 + sum_k R_k (a_k - a0_k). One pressure solution at a0, the acceleration of the last
    step, gives F0; one linear response to each joint acceleration gives R_k, and with the jacobian J of the bodies the
    added inertia Ma = -J^T R. `bodies.advance` then solves the equations of motion with (M + Ma), which is stable for
    any ratio of added to own mass, and the pressure is corrected to the acceleration that came out.

    `acceleration` (nv,) is the scheme's only memory.
    """

    def __init__(self, bodies: BodySet):
        self.acceleration = np.zeros(bodies.motion().jacobian.shape[2])
        self._seen = list(PLANE) if bodies.dimension == 2 else list(range(6))

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Advance the bodies by dt [s]; the settled wrench (b, 6) of the fluid about their centres of mass."""
        motion, start = bodies.motion(), self.acceleration
        wrench = fluid.pressure(motion.jacobian @ start + motion.bias)
        added = np.zeros((start.size, start.size))
        dofs = self._moving(motion.jacobian)
        if dofs.size == 0:
            self.acceleration = bodies.advance(dt, wrench, added, start)
            return wrench
        pressures, changes = fluid.response(motion.jacobian[:, :, dofs].transpose(2, 0, 1))
        added[:, dofs] = -np.einsum("bik,mbi->km", motion.jacobian, changes)
        self.acceleration = bodies.advance(dt, wrench, added, start)
        rise = (self.acceleration - start)[dofs]
        for pressure, factor in zip(pressures, rise, strict=True):
            fluid.add(pressure, factor)
        return wrench + np.einsum("m,mbi->bi", rise, changes)

    def _moving(self, jacobian: np.ndarray) -> np.ndarray:
        """Joint accelerations that move a wet body as far as the fluid can tell."""
        return np.flatnonzero(np.abs(jacobian[:, self._seen]).max(axis=(0, 1), initial=0.0) > 1e-12)
