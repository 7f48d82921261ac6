"""Boundary particles that count by the volume each stands for (Akinci et al. 2012): one layer, or several whose particles are
as the fluid's. They have no pressure; a fluid particle is pushed off by its own.

psi_b = gamma / (V sum_k W_bk), k over the particles of the same owner, b itself included, so that where a surface is sampled
too densely each counts for less. gamma is such that a lattice of fluid on a flat layer has the density of the lattice.
"""

from __future__ import annotations

import numpy as np

from fsi.compute.lanes import width
from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.fluid.boundary import BoundaryParticles
from fsi.fluid.response import LinearResponse
from fsi.fluid.workspace import PADDING
from fsi.owners import PISTON
from fsi.particles.cells import Grid
from fsi.particles.layout import Layout
from fsi.particles.neighbours import Neighbours
from fsi.particles.sorts import make_sort
from fsi.particles.state import BoundaryState
from fsi.scene.model import Scene
from fsi.sph import columns, implicit_walls
from fsi.sph.implicit import Scalars
from fsi.sph.shapes import filling, shape


def weights(scene: Scene, layout: Layout, k: Scalars, dtype, team: Team) -> np.ndarray:
    """psi (b,) of the boundary particles of a layout, in its order. Owners are rigid, so that it holds for the whole run."""
    points, dim, h = layout.boundary, scene.dimension, scene.smoothing_length
    psi = np.ones(len(points), dtype)
    if not scene.single_layer or len(points) == 0:
        return psi
    lanes = width(dtype)
    grid = Grid.over(points.min(0), points.max(0), scene.spacing, 2 * h, len(points))
    sort, near = make_sort(grid, team), Neighbours(lanes, dim, scene.spacing, 2 * h, team)
    order = sort.update(points)[: len(points)]
    rows = np.zeros((len(points) + PADDING, columns.field(dim).width("p")), dtype)
    rows[: len(points), :dim] = points[order] - grid.lower
    rows[: len(points), columns.field(dim).p] = layout.owner[order]
    near.update(sort, 0, np.ascontiguousarray(rows[:, :dim].T, np.float32), [(sort, 0)])
    total = np.empty(len(points), dtype)
    team.run(implicit_walls.make_layer_sum(lanes, dim, scene.numerics.kernel), near.bounds, near.groups, rows, total, k)
    full = filling(scene.numerics.kernel, scene.spacing, h, dim)
    flat = full.layer / shape(scene.numerics.kernel, h, dim).alpha
    psi[order] = full.wall * flat / total
    return psi


class WeightedWalls(BoundaryParticles):
    """A `BoundaryTreatment` for implicit ISPH. Owns psi (b,), in the order of the layout, and what the boundary particles of
    moving owners do."""

    def __init__(
        self, scene: Scene, grid: Grid, layout: Layout, k: Scalars, dtype, team: Team, reductions: Reductions, friction: bool
    ):  # fmt: skip
        b, dim, kernel = len(layout.owner), scene.dimension, scene.numerics.kernel
        super().__init__(scene, grid, b, k, dtype, team, reductions, drag=None, no_slip=False, dense=False)
        self._kernel = kernel
        self.psi = weights(scene, layout, k, dtype, team)
        self.weight = self.psi  # of those that stand, in the order of cells
        self._friction = implicit_walls.make_friction(self.lanes, dim, kernel) if friction else None
        self._acceleration = np.zeros((1, 6))

    def pack(self, first: int, placed: BoundaryState, dt: float, body_force: np.ndarray, xs, rows) -> None:
        """See `BoundaryTreatment`; psi stands where the fluid has its viscosity and its pressure."""
        super().pack(first, placed, 0.0, body_force, xs, rows)
        self.weight = self.psi[self.order]
        flow, trial, field, _ = rows
        self.mark(flow, columns.flow(self.dim).mu)
        for some in (trial, field):
            self.mark(some, columns.field(self.dim).p)

    def mark(self, rows: np.ndarray, column: int) -> None:
        """Put psi into a column of the boundary's rows."""
        rows[self.first : self.first + self.count, column] = self.weight

    def weigh(self, flow: np.ndarray, trial: np.ndarray, body_force: np.ndarray) -> None:
        """Nothing: the weights are those of the layout."""

    def extrapolate(self, rows: np.ndarray, response: LinearResponse | None = None) -> None:
        """Nothing: the boundary has no pressure."""

    def accelerate(self, acceleration: np.ndarray, body_force: np.ndarray) -> None:
        """See `BoundaryTreatment`."""
        self._acceleration = acceleration

    def move(self, rows: np.ndarray, column: int, dt: float) -> None:
        """Put the velocities at the end of a step of dt [s] into the columns from this one on."""
        moving = np.flatnonzero(self.owner[: self.count] >= PISTON)
        if len(moving):
            change = self._accelerations(self._acceleration, self._twist, moving)
            rows[self.first + moving, column : column + self.dim] = self.velocity[moving] + dt * change

    def stir(self, rows: np.ndarray, column: int, unit: np.ndarray) -> None:
        """Put the accelerations that `unit` (owners, 6) gives all boundary particles into the columns from this one on."""
        every = np.arange(self.count)
        rows[self.first : self.first + self.count, column : column + self.dim] = self._accelerations(
            unit, np.zeros_like(self._twist), every
        )

    def _accelerations(self, acceleration: np.ndarray, twist: np.ndarray, which: np.ndarray) -> np.ndarray:
        """a + alpha x r + omega x (omega x r) (m, dim) of boundary particles (m,)."""
        if self._smooth is not None:  # without the spin that no fluid would feel
            acceleration = np.einsum("oi,oij->oj", acceleration, self._smooth)
            twist = np.einsum("oi,oij->oj", twist, self._smooth)
        axes, owner = [0, 2] if self.dim == 2 else [0, 1, 2], self.owner[which]
        arm = np.zeros((len(which), 3))
        arm[:, axes] = self.position[which]
        arm -= self._centre[owner]
        if self.dim == 2:
            arm[:, 1] = 0.0
        a, spin = acceleration[owner], twist[owner, 3:]
        return (a[:, :3] + np.cross(a[:, 3:], arm) + np.cross(spin, np.cross(spin, arm)))[:, axes]

    def press(self, rows: np.ndarray, values: np.ndarray, column: int, columns: int, least: int = 1) -> np.ndarray:
        """See `BoundaryTreatment`."""
        wrenches = [self._pressed(rows, values, column + m, least, linear=False) for m in range(columns)]
        return self.smoothed(np.array(wrenches))

    def press_change(self, rows: np.ndarray, column: int) -> np.ndarray:
        """Change of the wrench (owners, 6) by a change of the pressure in a column of `rows`."""
        return self.smoothed(self._pressed(rows, rows, column, 1, linear=True)[None])[0]

    def _pressed(self, rows: np.ndarray, values: np.ndarray, column: int, least: int, linear: bool) -> np.ndarray:
        wrench, forces = np.zeros((1, self.owners, 6)), self._forces()
        if self.count:
            kernel = implicit_walls.make_force(self.lanes, self.dim, self._kernel, column, linear)
            self.team.run(
                kernel, self.near.bounds, self.near.groups, self.first, rows, values, self._counted[: self.count], least,
                self.weight, forces[0], self.k,
            )  # fmt: skip
        self._add(forces, wrench, least)
        return wrench[0]

    def drag(self, flow: np.ndarray, least: int) -> np.ndarray:
        """See `BoundaryTreatment`."""
        wrench = np.zeros((self.owners, 6))
        if not self._friction:
            return wrench
        forces = self._forces()
        if self.count:
            self.team.run(
                self._friction, self.near.bounds, self.near.groups, self.first, flow, self._counted[: self.count], least,
                self.weight, forces[0], self.k,
            )  # fmt: skip
        self._add(forces, wrench[None], least)
        return wrench
