"""The boundary particles in a step: in the order of cells, with their neighbours in the fluid, and what the two do to each
other."""

from __future__ import annotations

import numpy as np

from fsi.compute.lanes import width
from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.fluid.body_force import BodyForce
from fsi.fluid.response import LinearResponse
from fsi.fluid.workspace import MORE_BOUNDARY, PADDING
from fsi.owners import FIRST_BODY
from fsi.particles.cells import CellSort, Grid, whole
from fsi.particles.neighbours import Neighbours
from fsi.particles.rows import pack_boundary
from fsi.particles.sorts import make_sort
from fsi.particles.state import BoundaryState
from fsi.scene.model import Scene
from fsi.sph import columns, walls
from fsi.sph.columns import Constants

PAST = 0.1  # spacings from the fluid around it, along the surface, at which a boundary particle is past the water line
NOBODY = -1  # owner of boundary particles on which forces are counted elsewhere


class BoundaryParticles:
    """Boundary particles in layers, whose pressure is extrapolated from the fluid (Adami et al. 2012): a `BoundaryTreatment`.
    Owns copies of those near the fluid in the order of cells; the first `count` of b stand, whose rows follow the fluid's
    `first` ones.

    order (count,): their numbers in the layout; position, velocity, skin (b, dim) and owner (b,); shepard (b, 1 + dim): sum W
    and sum r_j W x_bj (`fsi.sph.walls.make_shepard`); `drag`: the sweep of their viscous force, None where nothing drags.
    """

    def __init__(
        self, scene: Scene, grid: Grid, b: int, k: Constants, dtype, team: Team, reductions: Reductions, *, drag, no_slip: bool,
        dense: bool,
    ):  # fmt: skip
        self.team, self.dim, self.lanes, self.k, self._grid = team, scene.dimension, width(dtype), k, grid
        self._reductions = reductions
        self._density, self._drag, dim = scene.fluid.density, drag, self.dim
        self.sort = make_sort(grid, team)
        self.near = Neighbours(self.lanes, dim, scene.spacing, 2 * scene.smoothing_length, team)
        self.first = self.count = 0
        self.order = np.empty(0, np.int32)
        self._dtype, self._most = dtype, b
        self._make_room(0)
        self._lines = scene.gravity > 0 and BodyForce(scene).uniform.any() and not scene.closed and not dense
        self._line, self._steeper = np.zeros((0, dim), dtype), np.zeros(0)
        self._least = PAST * scene.spacing
        self.bent: np.ndarray | None = None  # acceleration (count, dim) besides that of the owners, of flexible walls
        self._silence = LinearResponse.none(dim, dtype)
        self.weigher = walls.make_shepard(self.lanes, dim, no_slip, dense)

    def begin(self, centre: np.ndarray, twist: np.ndarray, smooth: np.ndarray | None) -> None:
        """The owners now: centre (owners, 3), twist (owners, 6), smooth (owners, 6, 6) as in `BodyMotion`."""
        self.owners, self._centre, self._twist, self._smooth = len(centre), centre, twist, smooth
        self.centre = np.ascontiguousarray(centre[:, [0, 2]] if self.dim == 2 else centre)  # in the axes of the fluid

    def _make_room(self, n: int) -> None:
        dim, dtype = self.dim, self._dtype
        self.position, self.velocity, self._skin = np.zeros((n, dim)), np.zeros((n, dim)), None
        self.owner = self._counted = np.zeros(n, np.int32)  # the same until `count_only`
        self.shepard, self._lift = np.zeros((n, columns.shepard(dim).width("lever")), dtype), np.zeros((n, 1), dtype)
        self._force = np.empty((0, n, dim))

    def arrange(self, placed: BoundaryState, scratch: np.ndarray, chosen: np.ndarray) -> None:
        """Find the order of cells of the `chosen` boundary particles, int32, where they were placed."""
        self._placed = placed
        if len(placed.position):
            self.order = chosen[self.sort.update(placed.position[chosen], scratch)[: self.sort.inside]]
        self.count = len(self.order)
        if self.count > len(self.owner):
            self._make_room(min(self._most, int(MORE_BOUNDARY * self.count)))

    def pack(self, first: int, placed: BoundaryState, dt: float, body_force: np.ndarray, xs, rows) -> None:
        """Fill the rows from `first` on, and the arrays here, from where the boundary particles were placed."""
        self.first, self._counted = first, self.owner
        if self._skin is None and placed.skin is not None:
            self._skin = self.velocity.copy()
        if self.count:
            self.team.run(
                pack_boundary, whole(self.count), self.order, first, self._grid.lower, placed.position, placed.velocity,
                placed.felt, placed.owner, self.position, self.velocity, self.skin, self.owner, dt, body_force,
                columns.packed(self.dim), xs, *rows,
            )  # fmt: skip
        if placed.acceleration is not None:
            self.bent = placed.acceleration[self.order]

    def count_only(self, held: np.ndarray) -> None:
        """Count the forces on these boundary particles alone, True in (count,), until the next `pack`."""
        self._counted = np.where(held, self.owner[: self.count], NOBODY).astype(np.int32)

    @property
    def skin(self) -> np.ndarray:
        """Velocity (b, dim) that viscosity feels: `velocity` where no body is round."""
        return self.velocity if self._skin is None else self._skin

    def follow(self, placed: BoundaryState) -> None:
        """Take over velocities that have changed since `pack`, for the wall guard."""
        np.take(placed.velocity, self.order, axis=0, out=self.velocity[: self.count], mode="clip")

    def find(self, fluid: CellSort, xs: np.ndarray) -> None:
        """Find the neighbours in the fluid, of positions `xs` as in `fsi.particles.neighbours`."""
        if self.count:
            self.near.update(self.sort, self.first, xs, [(fluid, 0)])

    def weigh(self, flow: np.ndarray, trial: np.ndarray, body_force: np.ndarray) -> None:
        """The sums of W; no slip: mirrored velocities into `flow`. How steep the last pressures are at water lines."""
        if self.count:
            self.team.run(self.weigher, self.near.bounds, self.near.groups, self.first, flow, self.shepard, self.k)
            if self._lines:
                self._steepen(trial, body_force)

    def _steepen(self, trial: np.ndarray, body_force: np.ndarray) -> None:
        """Find the water lines, and how steep the last pressures are there."""
        b = self.count
        if len(self._line) < b + PADDING:
            room = len(self.owner) + PADDING
            self._line, self._steeper = np.zeros((room, self.dim), self._dtype), np.zeros(room)
        self._steeper[:b] = 0.0
        up, line = -body_force / np.linalg.norm(body_force), self._line[:b]
        self.team.run(walls.water_lines, whole(b), self.order, self._placed.facing, self.shepard, up, self._least, line)
        self.team.run(
            walls.make_steepening(self.lanes, self.dim), self.near.bounds, self.near.groups, self.first, trial, self.shepard,
            self._line, self._steeper, body_force, self._density, self._least, self.k,
        )  # fmt: skip

    # -------------------------------------------------------------------------------------- pressures

    def accelerate(self, acceleration: np.ndarray, body_force: np.ndarray) -> None:
        """Take the walls to move with this acceleration (owners, 6)."""
        self._set_lift(acceleration[None], self._twist, body_force, self._lift)
        if self._lines:
            self._lift[: self.count, 0] += self._steeper[: self.count]
        if self.bent is not None:
            lever = self.shepard[: self.count, columns.shepard(self.dim).all_of("lever")]
            self._lift[: self.count, 0] -= self._density * (self.bent * lever).sum(1)

    def lift_of(self, units: np.ndarray) -> np.ndarray:
        """Lift (count, m) by accelerations (m, owners, 6) alone."""
        lift = np.zeros((self.count, len(units)), self._lift.dtype)
        self._set_lift(units, np.zeros_like(self._twist), np.zeros(self.dim), lift)
        return lift

    def _set_lift(self, accelerations, twist, body_force, lift) -> None:
        b = self.count
        if self._smooth is not None:  # and without the spin that no fluid would feel
            accelerations = np.einsum("moi,oij->moj", accelerations, self._smooth)
            twist = np.einsum("oi,oij->oj", twist, self._smooth)
        if b:
            still = ~(accelerations.any((0, 2)) | twist[:, 3:].any(1))
            normal, first = self._placed.normal, len(self._placed.owner) - len(self._placed.normal)
            self.team.run(
                walls.lift_of, whole(b), self.order, self.position, normal, first, self.owner, self._centre, still,
                accelerations, twist, body_force, self._density, self.shepard, columns.shepard(self.dim).lever, lift,
            )  # fmt: skip

    def extrapolate(self, rows: np.ndarray, response: LinearResponse | None = None) -> None:
        """Pressures of the boundary in `rows`; those of responses with them."""
        if self.count:
            response = response or self._silence
            response.spread()
            self.team.run(
                walls.make_extrapolation(self.lanes, self.dim, response.columns), self.near.bounds, self.near.groups,
                self.first, rows, self.shepard, self._lift, self.k, response.rows, response.lift, response.low, response.high,
            )  # fmt: skip

    # -------------------------------------------------------------------------------------- forces

    def press(self, rows: np.ndarray, values: np.ndarray, column: int, columns: int, least: int = 1) -> np.ndarray:
        """Wrenches (m, owners, 6) of the pressures in so many columns of `values` from `column` on; positions are those of
        `rows`. Owners below `least` are left out."""
        wrench, forces = np.zeros((columns, self.owners, 6)), self._forces()
        end, kernel = self.first + self.count, walls.make_force(self.lanes, self.dim)
        pressures = np.zeros((end + PADDING, 1), self._dtype)
        for m in range(columns):
            if self.count:
                pressures[:end, 0] = values[:end, column + m]
                self.team.run(
                    kernel, self.near.bounds, self.near.groups, self.first, rows, pressures, self._counted[: self.count],
                    least, forces[0], self.k,
                )  # fmt: skip
            self._add(forces, wrench[m : m + 1], least)
        return self.smoothed(wrench)

    def drag(self, flow: np.ndarray, least: int) -> np.ndarray:
        """Wrench (owners, 6) of the viscous forces."""
        wrench = np.zeros((self.owners, 6))
        if not self._drag:
            return wrench
        forces = self._forces()
        if self.count:
            self.team.run(
                self._drag, self.near.bounds, self.near.groups, self.first, flow, self._counted[: self.count], least,
                forces[0], self.k,
            )  # fmt: skip
        self._add(forces, wrench[None], least)
        return wrench

    def felt(self, rows: np.ndarray, column: int, flow: np.ndarray) -> np.ndarray:
        """Force (2, count, dim) of the pressures in a column of `rows`, and of viscosity, on each boundary particle, fixed ones
        among them; 0 on those that are counted elsewhere [N]."""
        force = np.zeros((2, self.count, self.dim))
        self.press(rows, rows, column=column, columns=1, least=0)
        force[0] = self._force[0, : self.count]
        if self._drag:
            self.drag(flow, least=0)
            force[1] = self._force[0, : self.count]
        force[:, ~self.held] = 0.0
        return force

    @property
    def held(self) -> np.ndarray:
        """Whether forces on each boundary particle (count,) are counted here."""
        return self._counted[: self.count] != NOBODY

    def grasp(self, grip: np.ndarray, dt: float, accelerations: np.ndarray) -> np.ndarray:
        """Change (m, owners, 6) of the viscous wrench over a step of dt [s] by accelerations (m, owners, 6): implicit viscosity
        is stiff for bodies too, so that their drag counts with the velocity at the end of the step. grip (count,):
        growth of the force with the velocity [N s/m]."""
        b, axes = self.count, [0, 2] if self.dim == 2 else [0, 1, 2]
        owner, arm = self.owner[:b], np.zeros((b, 3))
        arm[:, axes] = self.position[:b] - self.centre[owner]
        wrenches = np.zeros((len(accelerations), self.owners, 6))
        for a, total in zip(accelerations[:, owner], wrenches, strict=True):
            along = (a[:, :3] + np.cross(a[:, 3:], arm))[:, axes]
            self._add((-dt * grip[:, None] * along)[None], total[None], least=FIRST_BODY)
        return wrenches

    def smoothed(self, wrench: np.ndarray) -> np.ndarray:
        """The wrenches (..., owners, 6), without the moment that no smooth body of their shape would get."""
        return wrench if self._smooth is None else np.einsum("oij,...oj->...oi", self._smooth, wrench)

    def _forces(self) -> np.ndarray:
        """Room (1, b, dim) for a force on each boundary particle."""
        if not len(self._force):
            self._force = np.zeros((1, len(self.position), self.dim))
        return self._force

    def _add(self, forces: np.ndarray, wrenches: np.ndarray, least: int) -> None:
        """Add forces (m, b, dim) to the wrenches (m, owners, 6) of the owners from `least` on."""
        b = self.count

        def add(position, force, owner, wrench) -> None:
            walls.wrenches(position, force, owner, self.centre, least, wrench)

        here = self.order, self.position[:b], self._counted[:b], forces[:, :b]
        self._reductions.loads(add, self._placed, *here, wrenches)

    @property
    def nbytes(self) -> int:
        """Memory of all arrays [B]."""
        arrays = {id(a): a for a in vars(self).values() if isinstance(a, np.ndarray)}.values()
        return sum(a.nbytes for a in arrays) + self.sort.nbytes + self.near.nbytes
