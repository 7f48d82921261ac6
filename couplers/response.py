"""The linear answer of the fluid to the accelerations of the joints, and the inertia that it amounts to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsi.protocols import BodyMotion, BodySet, FluidLoads

PLANE = (0, 2, 4)  # components of a spatial vector that exist in two dimensions: x, z, pitch


@dataclass(frozen=True)
class Response:
    """What a unit acceleration of each joint coordinate in `dofs` (m,) changes: `pressures` (m, opaque to couplers) and the
    wrench on the bodies, `changes` (m, b, 6); `jacobian` (b, 6, nv) is theirs."""

    dofs: np.ndarray
    jacobian: np.ndarray
    pressures: np.ndarray
    changes: np.ndarray

    def inertia(self) -> np.ndarray:
        """Added inertia (nv, nv): joint force against a unit of each joint acceleration."""
        added = np.zeros((self.jacobian.shape[2],) * 2)
        added[:, self.dofs] = -np.einsum("bik,mbi->km", self.jacobian, self.changes)
        return added

    def ratio(self, own: np.ndarray) -> np.ndarray:
        """Added over own inertia (b,) of each body: the largest v^T Ma v / v^T M v over joint accelerations v, with the
        part of Ma that the fluid exerts on this body and the mass matrix `own` (nv, nv) of all."""
        root = np.linalg.cholesky(own[np.ix_(self.dofs, self.dofs)])
        added = -np.einsum("bik,mbi->bkm", self.jacobian[:, :, self.dofs], self.changes)
        scaled = np.linalg.solve(root, np.linalg.solve(root, added).transpose(0, 2, 1))
        return np.linalg.eigvalsh(scaled + scaled.transpose(0, 2, 1)).max(1, initial=0.0) / 2


def respond(
    fluid: FluidLoads, bodies: BodySet, motion: BodyMotion, acceleration: np.ndarray
) -> tuple[np.ndarray, Response | None]:
    """Update the pressure for a joint acceleration (nv,): the wrench (b, 6), and the response of the fluid; None where no
    joint moves a wet body, as far as the fluid can tell."""
    seen = list(PLANE) if bodies.dimension == 2 else list(range(6))
    of_bodies = motion.jacobian @ acceleration + motion.bias
    dofs = np.flatnonzero(np.abs(motion.jacobian[:, seen]).max(axis=(0, 1), initial=0.0) > 1e-12)
    if dofs.size == 0:
        return fluid.pressure(of_bodies), None
    wrench, *changes = fluid.respond(of_bodies, motion.jacobian[:, :, dofs].transpose(2, 0, 1))
    return wrench, Response(dofs, motion.jacobian, *changes)


class Measured:
    """The last response that a scheme measured, for the added over the own inertia of the bodies."""

    def __init__(self):
        self.response: Response | None = None

    def ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia of each body (`Response.ratio`); None where it is not known."""
        if self.response is None:
            return None
        try:
            return self.response.ratio(bodies.inertia())
        except np.linalg.LinAlgError:  # of a run that has failed
            return None

    def state(self) -> dict:
        """The response without its pressures, which are no longer valid after the step."""
        names = ("dofs", "jacobian", "changes")
        return {} if self.response is None else {name: getattr(self.response, name).copy() for name in names}

    def restore(self, state: dict) -> None:
        self.response = Response(**state, pressures=np.empty((0, 0))) if state else None
