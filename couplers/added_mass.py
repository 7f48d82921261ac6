"""The default scheme: added mass measured in every step, so that body and fluid accelerate together."""

from __future__ import annotations

from typing import Literal

import numpy as np

from couplers.response import Measured, respond
from fsi.protocols import BodySet, FluidLoads
from fsi.scene.coupler import CouplerSettings
from fsi.state import Remembers

LIGHT = 30.0  # added over own inertia, from which on a body carries a reserve


class AddedMassSettings(CouplerSettings):
    """Added mass measured in every step: the default."""

    scheme: Literal["added_mass"] = "added_mass"

    def make(self, bodies: BodySet, source: object = "scene.toml") -> AddedMass:
        return AddedMass(bodies)


class AddedMass(Remembers):
    """Body acceleration and pressure settled together within the step.

    For given positions and velocities the wrench is affine in the joint acceleration a (nv,) that the walls of the
    bodies move with, F(a) = F0 + sum_k R_k (a_k - a0_k). One pressure solution at a0, the acceleration of the last
    step, gives F0 and along with it the linear response R_k to each joint acceleration, and with the jacobian J of the
    bodies the added inertia Ma = -J^T R. `bodies.advance` then solves the equations of motion with (M + Ma), which is
    stable for any ratio of added to own mass, and the pressure is corrected to the acceleration that came out. Very
    light bodies carry a `reserve` besides, for what the fluid answers a step later.

    `acceleration` (nv,) is all that later steps depend on.
    """

    remembered = ("acceleration", "_measured")

    advice = (
        "set a smaller numerics.mach or a finer spacing, or soften what drives the body (a spring, contact or actuator)"
    )
    notes: tuple[str, ...] = ()

    def __init__(self, bodies: BodySet):
        self.acceleration = np.zeros(bodies.motion().jacobian.shape[2])
        self._measured = Measured()

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Advance the bodies by dt [s]; the settled wrench (b, 6) of the fluid about their centres of mass."""
        motion, start = bodies.motion(), self.acceleration
        wrench, response = respond(fluid, bodies, motion, start)
        self._measured.response = response
        if response is None:
            self.acceleration = bodies.advance(dt, wrench, np.zeros((start.size, start.size)), start)
            return wrench
        added = response.inertia()
        self.acceleration = bodies.advance(dt, wrench, added + reserve(bodies.inertia(), added, motion.jacobian), start)
        rise = (self.acceleration - start)[response.dofs]
        for pressure, factor in zip(response.pressures, rise, strict=True):
            fluid.add(pressure, factor)
        return wrench + np.einsum("m,mbi->bi", rise, response.changes)

    def added_inertia(self) -> np.ndarray:
        """Added inertia (nv, nv) of the joints in the last step; 0 where no joint moves a wet body."""
        response = self._measured.response
        return np.zeros((self.acceleration.size,) * 2) if response is None else response.inertia()

    def mass_ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia (b,) of each body in the last step, see `Response.ratio`."""
        return self._measured.ratio(bodies)


def reserve(own: np.ndarray, added: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """Virtual inertia D (nv, nv), a multiple of the mass matrix `own` in each tree of bodies: nothing up to an added inertia of
    `LIGHT` times the own one, a share 1 / `LIGHT` of the added one far above.

    A motion along the surface has no added mass within a step, but the fluid answers the velocity that it leaves a step later,
    like a mass R, about 0.025 rho dr^2 per length for the two sides of a box that hardly dips in. A body with less than
    half of that is thrown back harder in every step. With (M + Ma + D) a = F + (Ma + D) a0 it takes R < M + 2 (Ma + D)
    to be stable, and D acts on changes of the acceleration alone: what it keeps from the body, D (a - a0) dt in a step, adds
    up to D a dt and no more. jacobian (b, 6, nv) tells which joints move a body.
    """
    lightness = np.diag(added) / np.diag(own)
    if lightness.max() <= LIGHT:
        return np.zeros_like(own)
    moved = np.abs(jacobian).max(axis=1) > 0
    linked = moved.T.astype(float) @ moved > 0
    factor = np.zeros(len(own))
    for k in np.argsort(lightness):
        factor[_tree(linked, k)] = lightness[k] / LIGHT - 1
    root = np.sqrt(np.maximum(factor, 0.0))
    return own * np.outer(root, root)


def _tree(linked: np.ndarray, joint: int) -> np.ndarray:
    """Which of the joints (nv,) are linked to this one by bodies that both move, and by others of that kind."""
    tree = linked[joint]
    while (more := linked[tree].any(axis=0)).sum() > tree.sum():
        tree = more
    return tree
