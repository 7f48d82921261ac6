"""What moves in the boundary: the wavemaker and the bodies, and where their boundary particles are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.fluid.gauges import Surface
from fsi.owners import FIRST_BODY, PISTON
from fsi.protocols import BodyMotion, BodySet


@dataclass(frozen=True)
class Motion:
    """All owners at one instant: centre (owners, 3) [m], twist (owners, 6) [m/s, rad/s] about it, and the acceleration
    (2, 6) over the coming step of those that are no bodies; smooth (owners, 6, 6) as in `BodyMotion`."""

    centre: np.ndarray
    twist: np.ndarray
    others: np.ndarray
    smooth: np.ndarray | None


class Movers:
    """Carries the boundary particles of the piston and of the bodies with their owners."""

    def __init__(self, fluid: Fluid, piston, bodies: BodySet | None, absorber=None):
        self.fluid, self.piston, self.bodies, self.absorber = fluid, piston, bodies, absorber
        self._surface = Surface(fluid) if absorber else None
        self._axes = [0, 2] if fluid.dim == 2 else [0, 1, 2]
        self._start = fluid.boundary[fluid.of_owner(PISTON)].copy()
        self._local = []  # boundary particles of each body in its own frame, about its centre of mass
        self._normal = []  # their outward normals likewise
        self._arm = []  # the same in the world, where they stand
        self.reach = np.zeros(max(0, fluid.owners - FIRST_BODY))  # (b,) distance of the farthest from there [m]
        motion = bodies.motion() if bodies else None
        for b in range(fluid.owners - FIRST_BODY if bodies else 0):
            centre = motion.position[b]
            points = np.tile(centre, (len(fluid.boundary[fluid.of_owner(FIRST_BODY + b)]), 1))
            points[:, self._axes] = fluid.boundary[fluid.of_owner(FIRST_BODY + b)]
            self._local.append((points - centre) @ motion.rotation[b])
            normals = np.zeros_like(points)
            normals[:, self._axes] = fluid.placed.normal_of(FIRST_BODY + b)
            self._normal.append(normals @ motion.rotation[b])
            self._arm.append(points - centre)
            self.reach[b] = np.linalg.norm(points - centre, axis=1).max(initial=0.0)
        if bodies and fluid.standing:
            fluid.standing.displace(bodies)

    def place(self, time: float, dt: float) -> Motion:
        """Put every moving boundary particle where it is at `time`."""
        fluid = self.fluid
        centre, twist = np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6))
        others, smooth = np.zeros((min(FIRST_BODY, fluid.owners), 6)), None
        if self.piston:
            (x, u, _), (_, next_u, _) = self.piston(time), self.piston(time + dt)
            if self.absorber:
                shift, rate, next_rate = self.absorber.step(time, dt, self._surface, x)
                x, u, next_u = x + shift, u + rate, next_u + next_rate
            twist[PISTON, 0], others[PISTON, 0] = u, (next_u - u) / dt
            along = np.eye(fluid.dim)[0]
            fluid.placed.place(PISTON, self._start + x * along, u * along)
        if fluid.sea:
            fluid.sea.place(fluid.placed, time, dt)
        if self.bodies:
            motion = self.bodies.motion()
            centre[FIRST_BODY:], twist[FIRST_BODY:] = motion.position, motion.velocity
            if motion.smooth is not None:
                smooth = np.tile(np.eye(6), (fluid.owners, 1, 1))
                smooth[FIRST_BODY:] = motion.smooth
            for b, local in enumerate(self._local):
                self._carry(b, local, motion)
            if fluid.standing:
                fluid.standing.turn(motion.rotation)
        return Motion(centre, twist, others, smooth)

    def _carry(self, b: int, local: np.ndarray, motion: BodyMotion) -> None:
        """Put the boundary particles of a body where it takes them."""
        twist, skin = motion.velocity[b], None
        if motion.smooth is None:
            turn = motion.rotation[b]
            arm = local @ turn.T
        else:
            turn = motion.turn[b]
            pivot = motion.pivot[b]
            arm = motion.rotation[b] @ pivot + (local - pivot) @ turn.T
            skin = _velocities(twist, arm)[:, self._axes]
            twist = twist @ motion.smooth[b]
        self._arm[b] = arm
        velocity, position = _velocities(twist, arm), motion.position[b] + arm
        normal = (self._normal[b] @ turn.T)[:, self._axes]
        self.fluid.placed.place(FIRST_BODY + b, position[:, self._axes], velocity[:, self._axes], skin, normal)

    def follow(self) -> None:
        """Give the boundary particles of the bodies the velocities that the bodies have come to in the step, where they stand:
        those that the wall guard keeps the fluid off by. With those before the step it would stop fluid that a light
        body runs ahead of, and hand the body more momentum than it has."""
        fluid, motion = self.fluid, self.bodies.motion()
        for b, arm in enumerate(self._arm):
            twist = motion.velocity[b] if motion.smooth is None else motion.velocity[b] @ motion.smooth[b]
            fluid.boundary_velocity[fluid.of_owner(FIRST_BODY + b)] = _velocities(twist, arm)[:, self._axes]
        fluid.solids.follow(fluid.placed)

    def speed(self) -> float:
        """Largest speed of a moving boundary particle [m/s]."""
        moving = self.fluid.boundary_velocity[self.fluid.of_owner(0).stop :]
        return float(np.sqrt(self.fluid.reductions.largest(np.einsum("bd,bd->b", moving, moving))))


def _velocities(twist: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Velocities (n, 3) of points of a body with this twist (6,), at `arm` (n, 3) from its centre of mass."""
    x, y, z = twist[3:]
    return twist[:3] + arm @ np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # omega x arm
