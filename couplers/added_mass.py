"""The default scheme: added mass measured in every step, so that body and fluid accelerate together."""

from __future__ import annotations

import numpy as np

from fsi.protocols import BodySet, FluidLoads

PLANE = (0, 2, 4)  # components of a spatial vector that exist in two dimensions: x, z, pitch


class AddedMass:
    """Body acceleration and pressure settled together within the step.

    For given positions and velocities the wrench is affine in the joint acceleration a (nv,) that the walls of the
    bodies move with, F(a) = F0 + sum_k R_k (a_k - a0_k). One pressure solution at a0, the acceleration of the last
    step, gives F0; one linear response per joint acceleration gives R_k, and with the jacobian J of the bodies the
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
        responses = {dof: fluid.response(motion.jacobian[:, :, dof]) for dof in self._moving(motion.jacobian)}
        added = np.zeros((start.size, start.size))
        for dof, (_, change) in responses.items():
            added[:, dof] = -np.einsum("bik,bi->k", motion.jacobian, change)
        self.acceleration = bodies.advance(dt, wrench, added, start)
        for dof, (pressure, change) in responses.items():
            rise = self.acceleration[dof] - start[dof]
            fluid.add(pressure, rise)
            wrench = wrench + change * rise
        return wrench

    def _moving(self, jacobian: np.ndarray) -> np.ndarray:
        """Joint accelerations that move a wet body as far as the fluid can tell."""
        return np.flatnonzero(np.abs(jacobian[:, self._seen]).max(axis=(0, 1), initial=0.0) > 1e-12)
