"""Particles of fluid that are glued to a body, such as those in the gap under a slide.

They are fluid in all but their motion: after every step they are put back where the body carries them. The impulse that
this takes is handed to the body, like that of the wall guard, so that momentum is kept and the body has their weight and
inertia.
"""

from __future__ import annotations

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.owners import FIRST_BODY
from fsi.protocols import BodySet
from fsi.sph.columns import corrector_sums


class Glue:
    """Carries the last particles of the layout, whose owners are `owner` (n,), with their bodies."""

    def __init__(self, fluid: Fluid, bodies: BodySet, owner: np.ndarray):
        self._fluid, self._bodies, self._body = fluid, bodies, owner - FIRST_BODY
        self._first = fluid.count - len(owner)
        self._axes = [0, 2] if fluid.dim == 2 else [0, 1, 2]
        motion = bodies.motion()
        arm = self._in_space(fluid.position[self._first :], motion.position[self._body]) - motion.position[self._body]
        self._local = np.einsum("nij,ni->nj", motion.rotation[self._body], arm)

    @property
    def mass(self) -> float:
        """Of all glued particles [kg]."""
        return len(self._body) * float(self._fluid.k.mass)

    def hold(self, sums: np.ndarray, impulse: np.ndarray) -> None:
        """Put the particles back after a step; takes their change of momentum and of energy out of the `sums` over the
        fluid and adds its opposite to the `impulse` (owners, 6)."""
        fluid, dim, motion = self._fluid, self._fluid.dim, self._bodies.motion()
        where = np.flatnonzero(fluid.label >= self._first)
        number = fluid.label[where] - self._first
        body, mass = self._body[number], float(fluid.k.mass)
        arm = np.einsum("nij,nj->ni", motion.rotation[body], self._local[number])
        held = (motion.velocity[body, :3] + np.cross(motion.velocity[body, 3:], arm))[:, self._axes]
        free, fluid.velocity[where] = fluid.velocity[where], held
        fluid.position[where] = (motion.position[body] + arm)[:, self._axes]
        body, arm, free, held = fluid.reductions.gathered(where, body, arm, free, held)
        lost = mass * (free - held)
        place = corrector_sums(dim)
        sums[place.kinetic] += 0.5 * mass * float((held**2).sum() - (free**2).sum())
        sums[place.momentum : place.damped] -= lost.sum(0)
        force = self._in_space(lost, 0.0)
        np.add.at(impulse, body + FIRST_BODY, np.hstack([force, np.cross(arm, force)]))

    def _in_space(self, points: np.ndarray, elsewhere: np.ndarray | float) -> np.ndarray:
        """Points (n, 3) of points (n, dim) of the fluid; in two dimensions their y is that of `elsewhere`."""
        whole = np.zeros((len(points), 3)) + elsewhere
        whole[:, self._axes] = points
        return whole
