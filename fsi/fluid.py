"""The fluid: its state, its packed rows, and the pieces of one step in the order in which they are called.

`begin` (sort, pack, neighbours) -> `predict` -> `pressure`, and `response` and `add` as a coupler asks -> `correct`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fsi import boundary, kernel, sweeps
from fsi.cells import CellSort, Grid, whole
from fsi.lanes import claim
from fsi.layout import FIRST_BODY, Layout
from fsi.neighbours import Neighbours
from fsi.scene import Scene
from fsi.threads import Team

SOUND = 0.378  # sound speed of one Jacobi sweep a step, c = 0.378 h / dt, from sum a_ij = 7 / (rho h^2)


@njit(nogil=True, cache=True)
def _pack_fluid(counter, bounds, order, lower, position, velocity, pressure, label, position2, velocity2, pressure2,
                label2, xs, flow, trial, field, twin):  # fmt: skip
    """Put the particles in cell order and fill their rows."""
    dim = position.shape[1]
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            j = order[i]
            for d in range(dim):
                position2[i, d] = position[j, d]
                velocity2[i, d] = velocity[j, d]
                x = position[j, d] - lower[d]
                xs[d, i] = x
                flow[i, d] = x
                trial[i, d] = x
                field[i, d] = x
                twin[i, d] = x
                flow[i, dim + d] = velocity[j, d]
            pressure2[i] = pressure[j]
            trial[i, dim] = pressure[j]
            label2[i] = label[j]


@njit(nogil=True, cache=True)
def _pack_boundary(order, first, lower, position, velocity, owner, position2, velocity2, owner2, fall, dt, gravity,
                   xs, flow, trial, field, twin):  # fmt: skip
    """The same for the boundary, whose trial velocity is u + dt g, so that the pressure that holds a wall's
    acceleration makes its final velocity."""
    dim = position.shape[1]
    for b in range(order.size):
        j, i = order[b], first + b
        owner2[b] = owner[j]
        for d in range(dim):
            position2[b, d] = position[j, d]
            velocity2[b, d] = velocity[j, d]
            x = position[j, d] - lower[d]
            xs[d, i] = x
            flow[i, d] = x
            trial[i, d] = x
            field[i, d] = x
            twin[i, d] = x
            flow[i, dim + d] = velocity[j, d]
            trial[i, dim + 1 + d] = velocity[j, d]
        trial[i, 2 * dim] -= dt * gravity


@njit(cache=True)
def _fall(position, owner, centre, acceleration, velocity, gravity, fall):
    """g - a_b of each boundary particle from the acceleration and the twist (owners, 6) of its owner about `centre`
    (owners, 3): a_b = a + alpha x r + omega x (omega x r)."""
    dim = position.shape[1]
    r, s = np.zeros(3), np.zeros(3)
    for b in range(position.shape[0]):
        a, w = acceleration[owner[b]], velocity[owner[b], 3:]
        for d in range(dim):
            axis = 2 if d == dim - 1 else d
            r[axis] = position[b, d] - centre[owner[b], axis]
        for d in range(3):
            s[d] = w[(d + 1) % 3] * r[(d + 2) % 3] - w[(d + 2) % 3] * r[(d + 1) % 3]
        for d in range(dim):
            x = 2 if d == dim - 1 else d
            y, z = (x + 1) % 3, (x + 2) % 3
            fall[b, d] = -(a[x] + a[3 + y] * r[z] - a[3 + z] * r[y] + w[y] * s[z] - w[z] * s[y])
        fall[b, dim - 1] -= gravity


def sweep_constants(scene: Scene, depth: float, dtype) -> sweeps.Constants:
    """The scalars of the sweeps for a scene whose fluid is `depth` metres high."""
    dim, dr, h, rho = scene.dimension, scene.spacing, scene.smoothing_length, scene.fluid.density
    volume = dr**dim
    mass = rho * volume
    lattice = kernel.lattice(dr, h, dim)
    slope = float(kernel.gradient_factor(0.0, h, dim))
    numerics = scene.numerics
    relaxation = numerics.density_relaxation
    if relaxation is None:
        relaxation = numerics.sweeps * (SOUND * h * math.pi / (2 * depth)) ** 2 / 2
    sound = math.sqrt(scene.gravity * depth) / numerics.mach
    values = sweeps.Constants(
        inverse_support=0.5 / h,
        eta2=(0.1 * h) ** 2,
        density_factor=float(kernel.value(0.0, h, dim)) / lattice.density,
        divergence_factor=slope * volume,
        laplacian_factor=2 * slope * mass / rho**2,
        gradient_factor=slope * mass / rho**2,
        viscous_factor=2 * scene.fluid.kinematic_viscosity * slope * volume,
        artificial_factor=numerics.artificial_viscosity * sound * h * slope * volume,
        lattice_laplacian=2 * mass / rho**2 * lattice.laplacian,
        surface_factor=lattice.surface_factor,
        relaxation=relaxation,
        gravity=scene.gravity,
        density=rho,
        mass=mass * (scene.tank.width if dim == 2 else 1.0),
        guard2=(numerics.wall_guard * dr) ** 2,
    )
    return sweeps.Constants(*(dtype(v) for v in values))


class Fluid:
    """State and sweeps of the fluid and its boundary.

    position, velocity (n, dim), pressure (n,), label (n,): the fluid in cell order, label its number at t = 0.
    boundary (b, dim), boundary_velocity, owner: the boundary particles in the order of the layout.
    """

    def __init__(self, scene: Scene, layout: Layout, team: Team):
        self.scene, self.team, self.dim = scene, team, scene.dimension
        self.dtype = np.float32 if scene.numerics.precision == "single" else np.float64
        self.lanes = 8 if scene.numerics.precision == "single" else 4
        self.depth = layout.depth
        self.k = sweep_constants(scene, layout.depth, self.dtype)
        self.position, self.velocity = layout.position.copy(), layout.velocity.astype(float)
        self.pressure_values = layout.pressure.astype(self.dtype)
        self.label = np.arange(len(layout.position), dtype=np.int32)
        self.boundary, self.owner = layout.boundary.copy(), layout.owner.copy()
        self.boundary_velocity = np.zeros_like(self.boundary)
        self.owners = int(self.owner.max(initial=0)) + 1
        self.lost = 0
        self.zones = np.array([(z.start, z.end, z.rate) for z in scene.damping]).reshape(-1, 3)
        support = 2 * scene.smoothing_length
        self.grid = Grid.over(layout.domain_min, layout.domain_max, scene.spacing, support)
        self._sort = CellSort(self.grid, len(self.position), team)
        self._boundary_sort = CellSort(self.grid, len(self.boundary), team)
        self._near = Neighbours(self.lanes, self.dim, scene.spacing, support, team)
        self._boundary_near = Neighbours(self.lanes, self.dim, scene.spacing, support, team)
        self._compose()
        self._allocate()

    def _compose(self) -> None:
        """Compile what this scene needs."""
        L, D, numerics = self.lanes, self.dim, self.scene.numerics
        laminar = numerics.viscosity == "laminar" and self.scene.fluid.kinematic_viscosity > 0
        self._predictor = sweeps.make_predictor(L, D, laminar, numerics.artificial_viscosity > 0)
        self._source = sweeps.make_source(L, D)
        self._jacobi = sweeps.make_jacobi(L, D)
        self._echo = sweeps.make_jacobi(L, D, sourced=False)
        guarded = numerics.wall_guard > 0 and len(self.boundary) > 0
        self._corrector = sweeps.make_corrector(L, D, guarded, len(self.zones) > 0)
        self._weights = boundary.make_weights(L, D, laminar)
        self._extrapolation = boundary.make_extrapolation(L, D)
        self._local_extrapolation = boundary.make_extrapolation(L, D, everywhere=False)
        self._force = boundary.make_force(L, D)

    def _allocate(self) -> None:
        n, b, dim = len(self.position), len(self.boundary), self.dim
        rows = n + b + 16
        moves = self.owners > FIRST_BODY
        twin = self.scene.numerics.sweeps > 1
        self._xs = np.zeros((dim, rows), np.float32)
        self._flow = np.zeros((rows, 8 if dim == 3 else 4), self.dtype)
        self._trial = np.zeros((rows, 8 if dim == 3 else 6), self.dtype)
        self._field = np.zeros((rows, 4), self.dtype)
        self._twin = np.zeros((rows, 4), self.dtype) if twin or moves else self._field
        self._echoes = [np.zeros((rows, 4), self.dtype) for _ in range(2)] if moves else []
        self._coefficients = np.zeros((n, 3), self.dtype)
        self._spare = [np.empty_like(a) for a in (self.position, self.velocity, self.pressure_values, self.label)]
        self._sorted_boundary = np.zeros((b, dim))
        self._sorted_velocity = np.zeros((b, dim))
        self._sorted_owner = np.zeros(b, np.int32)
        self._fall_values = np.zeros((b, dim))
        self._shepard = np.zeros((b, 1 + dim), self.dtype)
        self._viscous_force = np.zeros((b, dim))
        self._pressure_force = np.zeros((b, dim))
        self._low, self._high = np.zeros(dim), np.zeros(dim)

    # -------------------------------------------------------------------------------------- one step

    @property
    def count(self) -> int:
        return len(self.position)

    def place(self, owner: int, position: np.ndarray, velocity: np.ndarray) -> None:
        """Move the boundary particles of an owner: position and velocity (b, dim)."""
        chosen = self.of_owner(owner)
        self.boundary[chosen], self.boundary_velocity[chosen] = position, velocity

    def of_owner(self, owner: int) -> slice:
        """Boundary particles of an owner."""
        return slice(*np.searchsorted(self.owner, [owner, owner + 1]))

    def begin(self, dt: float, centre: np.ndarray, twist: np.ndarray) -> None:
        """Sort and pack everything where it stands now, and find the neighbours. centre (owners, 3), twist
        (owners, 6): of the owners now."""
        self.dt, self._centre, self._twist = dt, centre, twist
        order = self._sort.update(self.position)
        n = self._sort.inside
        self.lost += self.count - n
        old = self.position, self.velocity, self.pressure_values, self.label
        spare = [a[:n] for a in self._spare]
        rows = self._flow, self._trial, self._field, self._twin
        if n:
            self.team.run(_pack_fluid, whole(n), order, self.grid.lower, *old, *spare, self._xs, *rows)
        self._spare = list(old)
        self.position, self.velocity, self.pressure_values, self.label = spare
        order = self._boundary_sort.update(self.boundary)[: self._boundary_sort.inside]
        self._solids = b = len(order)
        _pack_boundary(
            order, n, self.grid.lower, self.boundary, self.boundary_velocity, self.owner, self._sorted_boundary,
            self._sorted_velocity, self._sorted_owner, self._fall_values, dt, float(self.k.gravity), self._xs, *rows,
        )  # fmt: skip
        self._boundary_order = order
        kinds = [(self._sort, 0)] + ([(self._boundary_sort, n)] if b else [])
        self._near.update(self._sort, 0, self._xs, kinds)
        if b:
            self._boundary_near.update(self._boundary_sort, n, self._xs, kinds[:1])

    def predict(self) -> None:
        """Trial velocities and the coefficients of the pressure equation."""
        near = self._near
        self.team.run(
            self._predictor, near.bounds, near.groups, self._flow, self._trial, self.velocity, self._coefficients,
            self.k, self.dtype(self.dt),
        )  # fmt: skip
        if self._solids:
            near = self._boundary_near
            self.team.run(
                self._weights, near.bounds, near.groups, self.count, self._flow, self._shepard, self._viscous_force,
                self.k,
            )  # fmt: skip

    def pressure(self, acceleration: np.ndarray) -> np.ndarray:
        """Update the pressure for this acceleration (owners, 6); the wrench (owners, 6) on the moving owners."""
        self._set_fall(acceleration, self._twist, float(self.k.gravity))
        self._extrapolate(self._trial)
        near = self._near
        self.team.run(
            self._source, near.bounds, near.groups, self._trial, self._field, self._coefficients, self.k,
            self.dtype(self.dt),
        )  # fmt: skip
        field, twin = self._field, self._twin
        for _ in range(self.scene.numerics.sweeps - 1):
            self._extrapolate(field)
            self._sweep(self._jacobi, field, twin)
            field, twin = twin, field
        self._field, self._twin = field, twin
        self._extrapolate(field)
        return self.wrench(field, viscous=True) if self.owners > 1 else np.zeros((self.owners, 6))

    def settle(self, acceleration: np.ndarray, tolerance: float = 1e-5, most: int = 5000) -> int:
        """Solve the pressure equation at the start, for fluid released from its initial state: Jacobi sweeps with
        Chebyshev acceleration (Golub & Varga 1961) until a sweep changes the pressure by less than tolerance times its
        maximum. Follows `begin`; leaves the velocities as they were. Returns the number of sweeps."""
        velocity = self.velocity.copy()
        self.predict()
        self.pressure(acceleration)
        n, P = self.count, self.dim
        field, twin = self._field, self._field.copy()
        before = field[:n, P].copy()
        slowest = (SOUND * self.scene.smoothing_length * math.pi / (2 * self.depth)) ** 2 / 2
        radius2 = (1 - min(slowest, 0.5)) ** 2
        weight, sweep = 1.0, 0
        for sweep in range(1, most + 1):
            self._extrapolate(field)
            self._sweep(self._jacobi, field, twin)
            weight = 1 / (1 - 0.5 * radius2) if sweep == 2 else 1 / (1 - 0.25 * radius2 * weight) if sweep > 2 else 1.0
            new = weight * (twin[:n, P] - before) + before
            change = np.abs(new - field[:n, P]).max()
            before[:] = field[:n, P]
            field[:n, P] = new
            if change <= tolerance * np.abs(new).max():
                break
        self._field = field
        self.pressure_values[:] = field[:n, P]
        self.velocity[:] = velocity
        return sweep

    def response(self, acceleration: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Change of the pressure (rows,) and of the wrench (owners, 6) by this acceleration (owners, 6) of the owners,
        exact because the pressure update is linear in it."""
        moving = np.flatnonzero(np.abs(acceleration).max(1) > 0)
        field, twin = self._echoes
        n, P = self.count + self._solids, self.dim
        for rows in (field, twin):
            rows[:n, :P] = self._field[:n, :P]
            rows[:n, P] = 0.0
        self._set_fall(acceleration, np.zeros_like(self._twist), 0.0)
        self._box(moving)
        reach = 2 * self.scene.smoothing_length
        for _ in range(self.scene.numerics.sweeps):
            self._extrapolate(field, local=True)
            self._grow_box(reach)
            self._sweep(self._echo, field, twin)
            self._grow_box(reach)  # as far as the boundary feels the fluid that has changed
            field, twin = twin, field
        self._extrapolate(field, local=True)
        return field[:n, P].copy(), self.wrench(field)

    def add(self, response: np.ndarray, factor: float) -> None:
        """Add factor times a pressure response to the pressure."""
        self._field[: len(response), self.dim] += self.dtype(factor) * response

    def correct(self) -> tuple[np.ndarray, np.ndarray]:
        """New velocities and positions. Returns the sums of `fsi.sweeps` and the impulse (owners, 6) that the wall guard
        handed to the owners."""
        near = self._near
        chunks = len(near.bounds) - 1
        sums, impulse = np.zeros((chunks, sweeps.sums_width(self.dim))), np.zeros((chunks, self.owners, 6))
        self.team.run(
            self._corrector, near.bounds, near.groups, self._flow, self._field, self._coefficients, self.position,
            self.velocity, self.pressure_values, self.k, self.dt, self.zones, self.count, self._sorted_boundary,
            self._sorted_velocity, self._sorted_owner, self._plane(self._centre), impulse, sums,
        )  # fmt: skip
        maxima = sums[:, : sweeps.KINETIC].max(0, initial=0.0)
        return np.concatenate([maxima, sums[:, sweeps.KINETIC :].sum(0)]), impulse.sum(0)

    # -------------------------------------------------------------------------------------- parts of it

    def residual(self) -> float:
        """How much the last sweep changed the pressure, as a share of its largest value."""
        n, P = self.count, self.dim
        last = self._twin if self.scene.numerics.sweeps > 1 else self._trial
        change = np.abs(self._field[:n, P] - last[:n, P]).max(initial=0.0)
        return float(change / max(np.abs(self._field[:n, P]).max(initial=0.0), 1e-300))

    def wrench(self, field=None, viscous: bool = False, walls: bool = False) -> np.ndarray:
        """Wrench (owners, 6) of the fluid on its owners about their centres; the fixed walls only if asked for."""
        out = np.zeros((self.owners, 6))
        near, b = self._boundary_near, self._solids
        if b == 0:
            return out
        rows = self._field if field is None else field
        self.team.run(
            self._force, near.bounds, near.groups, self.count, rows, self._sorted_owner[:b], 0 if walls else 1,
            self._pressure_force, self.k,
        )  # fmt: skip
        forces = [self._pressure_force] + ([self._viscous_force] if viscous else [])
        for force in forces:
            boundary.wrenches(
                self._sorted_boundary[:b], force[:b], self._sorted_owner[:b], self._plane(self._centre), out
            )
        return out

    def _plane(self, points: np.ndarray) -> np.ndarray:
        """Points (o, 3) in the axes of the fluid."""
        return np.ascontiguousarray(points[:, [0, 2]] if self.dim == 2 else points)

    def _set_fall(self, acceleration, twist, gravity) -> None:
        b = self._solids
        _fall(
            self._sorted_boundary[:b], self._sorted_owner[:b], self._centre, acceleration, twist, gravity,
            self._fall_values,
        )  # fmt: skip

    def _extrapolate(self, rows, local: bool = False) -> None:
        if self._solids:
            near = self._boundary_near
            self.team.run(
                self._local_extrapolation if local else self._extrapolation, near.bounds, near.groups, self.count, rows,
                self._shepard, self._fall_values, self.k, self._low, self._high,
            )  # fmt: skip

    def _sweep(self, kernel_, field, new) -> None:
        near = self._near
        self.team.run(
            kernel_, near.bounds, near.groups, field, new, self._coefficients, self.k, self._low, self._high
        )

    def _box(self, owners) -> None:
        """Set the box of the local sweeps around the boundary particles of these owners."""
        chosen = np.isin(self._sorted_owner[: self._solids], owners)
        points = self._sorted_boundary[: self._solids][chosen] - self.grid.lower
        if len(points):
            self._low, self._high = points.min(0), points.max(0)
        else:
            self._low, self._high = np.full(self.dim, np.inf), np.full(self.dim, -np.inf)

    def _grow_box(self, reach: float) -> None:
        self._low, self._high = self._low - reach, self._high + reach

    @property
    def nbytes(self) -> int:
        """Memory of all particle arrays [B]."""
        arrays = [a for a in vars(self).values() if isinstance(a, np.ndarray)] + self._echoes + self._spare
        own = sum(a.nbytes for a in arrays)
        return own + sum(p.nbytes for p in (self._sort, self._boundary_sort, self._near, self._boundary_near))
