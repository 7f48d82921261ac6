"""The standing pressure: what presses on everything under water anyway, taken out of the sum over pairs.

sum_j (p_i + p_j) grad W vanishes under a uniform pressure on an even arrangement alone; a sheared one resists like a solid
with a modulus of half a percent of the pressure, so that whatever moves deep under water is held back without waves
(docs/theory/numerics.md). So the pressure is split, p = P + p': P is a smooth function of the height alone, whose force
-grad P / rho on a particle is exact; p' acts in pairs. A body feels what P does to a body of water in its place
(Archimedes), and the walls feel the rest, so that the momentum of all is kept.

P is 0 near the surface, where the support is cut off, and grows to the hydrostatic pressure of the lowest `level` that the
water stands to anywhere, by its pressure: the lowest trough, or the floor as soon as fluid runs or falls along it. So p'
stays positive, and splashing scenes are left as they are.
"""

from __future__ import annotations

import math
from contextlib import contextmanager

import numpy as np

from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.fluid.body_force import BodyForce
from fsi.fluid.rheology import varies
from fsi.fluid.timestep import TimeStep
from fsi.owners import FIRST_BODY, PISTON, WALL
from fsi.particles.cells import whole
from fsi.particles.displaced import cells
from fsi.particles.layout import Layout
from fsi.protocols import BodySet
from fsi.scene.model import Scene
from fsi.sph import columns, kernel
from fsi.sph import standing as kernels
from fsi.state import Remembers

START, WIDTH = 1.0, 8.0  # of `fsi.sph.standing` [spacings]
CELLS = 8000  # of the box around a body
RISE = 0.2  # of sqrt(g depth): speed at which the level follows upwards


def stands(scene: Scene, layout: Layout) -> bool:
    """Whether a standing pressure is taken out: of one liquid of one explicit viscosity, under a uniform force, none glued."""
    plain = not scene.liquids and not varies(scene) and not TimeStep(scene, layout.depth).implicit
    force = BodyForce(scene)
    uniform = force.gradient is None and bool(force.uniform.any())
    return plain and uniform and layout.glued is None and scene.numerics.solver != "iisph"


class Standing(Remembers):
    """The standing pressure of a fluid whose pressures are `rows` of its workspace.

    level: height along `up` (dim,) that the water stands to everywhere at least [m], None before the first step;
    hulls: of each body the cells (c, 3) [m] in its frame about the centre of mass, and their sizes (c,) [m3].
    """

    remembered = ("level",)

    def __init__(self, scene: Scene, layout: Layout, team: Team, reductions: Reductions):
        self._team, self._reductions, self._dim = team, reductions, scene.dimension
        force = BodyForce(scene).uniform
        self.gravity = float(np.linalg.norm(force))
        self.up, self.weight = -force / self.gravity, scene.fluid.density * self.gravity
        dr, h = scene.spacing, scene.smoothing_length
        self.shape = START * dr, WIDTH * dr, smoothing_moment(dr, h, self._dim)
        self._rise = RISE * np.sqrt(self.gravity * layout.depth)
        self._axes = [0, 2] if self._dim == 2 else [0, 1, 2]
        self._pressure = columns.field(self._dim).p
        self.level: float | None = None
        self.hulls: list[tuple[np.ndarray, np.ndarray]] = []
        self._rotation = np.empty((0, 3, 3))
        self.piston = bool((layout.owner == PISTON).any())
        self._width = scene.tank.width if self._dim == 2 else 1.0
        self._out = False
        self._room = np.empty((0, 1)), np.empty(0)

    def displace(self, bodies: BodySet) -> None:
        """Take the bodies, in their initial pose, for what displaces the water."""
        solids, motion = bodies.solids(), bodies.motion()
        for b, centre in enumerate(motion.position):
            own = [solid for owner, solid in solids if owner == FIRST_BODY + b]
            points, size, _ = cells([*own, *bodies.insides.get(b, ())], CELLS)
            place = np.tile(centre, (len(points), 1))
            place[:, self._axes] = points
            self.hulls.append(((place - centre) @ motion.rotation[b], self._width * size))
        self.turn(motion.rotation)

    def turn(self, rotation: np.ndarray) -> None:
        """The bodies have these rotations (b, 3, 3), body to world, now."""
        self._rotation = rotation

    def begin(self, particles, dt: float) -> None:
        """Find the level from the last pressures; it falls at once and rises slowly."""
        head = np.empty(particles.count)
        self._team.run(
            kernels.heads, whole(particles.count), particles.position, particles.pressure, self.up, self.weight, head
        )
        lowest = float(self._reductions.smallest(head[particles.own]))
        self.level = lowest if self.level is None else min(lowest, self.level + dt * self._rise)

    def stand(self, position: np.ndarray, boundary: np.ndarray, dtype) -> None:
        """The standing pressure of the particles at `position` (n, dim) and `boundary` (b, dim), for this step."""
        n, b = len(position), len(boundary)
        if len(self._room[0]) < n + b:
            self._room = np.empty((n + b + n // 8, 1), dtype), np.empty(n + b + n // 8)
        self.rows, self.growth = self._room[0][: n + b], self._room[1][:n]
        for first, points in ((0, position), (n, boundary)):
            if len(points):
                self._team.run(
                    kernels.stand, whole(len(points)), points, self.up, self.level, self.shape, self.weight, first, self.rows,
                    self._room[1][first:],
                )  # fmt: skip

    def take_out(self, field: np.ndarray) -> None:
        """Leave p' in the rows of `field`."""
        field[: len(self.rows), self._pressure] -= self.rows[:, 0]
        self._out = True

    def give_back(self, field: np.ndarray) -> None:
        field[: len(self.rows), self._pressure] += self.rows[:, 0]
        self._out = False

    @contextmanager
    def whole(self, field: np.ndarray):
        """The whole pressure in the rows of `field`, for what only reads it."""
        out = self._out
        if out:
            self.give_back(field)
        yield
        if out:
            self.take_out(field)

    def push(self, velocity: np.ndarray, dt: float) -> None:
        """Add what -grad P / rho does in a step of dt [s] to velocities (n, dim)."""
        velocity += (dt * self.gravity * self.growth)[:, None] * self.up

    def wrench(self, solids, field: np.ndarray, on_fluid: np.ndarray | None = None) -> np.ndarray:
        """Wrench (owners, 6) of P as long as it is taken out: on a body that on the water in its place, on the piston its sum
        over pairs, on the walls the rest of what it exerts `on_fluid` (6,), about the origin, if that is given."""
        wrench = np.zeros((solids.owners, 6))
        if not self._out:
            return wrench
        if self.piston:
            wrench[PISTON] = solids.press(field, self.rows, column=0, columns=1)[0, PISTON]
        up = np.zeros(3)
        up[self._axes] = self.up
        for b, ((place, size), turn) in enumerate(zip(self.hulls, self._rotation, strict=True)):
            depth = self.level - solids.centre[FIRST_BODY + b] @ self.up - place @ (up @ turn)
            lifted = self.weight * size * growth(depth, *self.shape)
            wrench[FIRST_BODY + b] = np.concatenate([lifted.sum() * up, np.cross(turn @ (lifted @ place), up)])
        wrench = solids.smoothed(wrench)
        if on_fluid is not None:
            centre = np.zeros((solids.owners, 3))
            centre[:, self._axes] = solids.centre
            wrench[WALL] = -on_fluid - wrench.sum(0)
            wrench[WALL, 3:] -= np.cross(centre, wrench[:, :3])[WALL + 1 :].sum(0)
        return wrench

    @property
    def nbytes(self) -> int:
        """Memory of all arrays [B]."""
        return sum(a.nbytes for a in (*self._room, *(a for hull in self.hulls for a in hull)))

    def on_fluid(self, particles, mass: float) -> np.ndarray:
        """Wrench (6,) of P on the fluid particles, about the origin."""
        own = particles.own
        push = self.growth[own] * self.gravity * mass
        total, moment = self._reductions.total(push), self._reductions.weighted(push, particles.position[own])
        force, place = np.zeros(3), np.zeros(3)
        force[self._axes], place[self._axes] = self.up * total, moment
        return np.concatenate([force, np.cross(place, force / max(total, 1e-300))])


def growth(depth: np.ndarray, start: float, width: float, moment: float) -> np.ndarray:
    """How P over the weight of the water grows with the depth (n,) [m], as in `fsi.sph.standing.standing`."""
    t = np.clip((depth - start) / width, 0.0, 1.0)
    return t**3 * (10.0 - 15.0 * t + 6.0 * t * t) + moment / width**2 * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t)


def smoothing_moment(spacing: float, h: float, dim: int) -> float:
    """m4 / 6 [m2], m4 = V sum F x^4 on the lattice: the symmetric gradient of a function is its first derivative and so many
    times its third one."""
    reach = math.ceil(2 * h / spacing)
    axis = np.arange(-reach, reach + 1) * spacing
    grid = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    factor = kernel.gradient_factor(np.sqrt((grid**2).sum(1)), h, dim)
    return float(spacing**dim * (factor * grid[:, 0] ** 4).sum() / 6)
