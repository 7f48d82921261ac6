"""The fluid: its state, its packed rows, and the pieces of one step in the order in which they are called.

`begin` (sort, pack, neighbours) -> `predict` -> `pressure`, and `response` and `add` as a coupler asks -> `correct`.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.compute.lanes import width
from fsi.compute.team import Team
from fsi.fluid.boundary import BoundaryParticles
from fsi.fluid.chebyshev import iteration, solution
from fsi.fluid.constants import sweep_constants
from fsi.fluid.response import LinearResponse, box_around
from fsi.fluid.rheology import Rheology, varies, viscid
from fsi.fluid.timestep import TimeStep, sound_step
from fsi.particles.cells import CellSort, Grid, whole
from fsi.particles.ghosts import Periodic
from fsi.particles.layout import FIRST_BODY, Layout
from fsi.particles.neighbours import Neighbours
from fsi.particles.rows import gather, largest_change, pack_fluid
from fsi.scene.model import Scene
from fsi.sph import columns, corrector, predictor, pressure, walls

_PARTICLES = ("position", "velocity", "pressure_values", "label", "_acceleration")
_BOUNDARY = ("boundary", "boundary_velocity", "boundary_normal")
_COUNTS = ("lost", "sweeps", "most_sweeps", "unsolved")


class Fluid:
    """State and sweeps of the fluid and its boundary.

    position, velocity (n, dim), pressure (n,), label (n,): the fluid in cell order, label its number at t = 0.
    boundary (b, dim), boundary_velocity, owner: the boundary particles in the order of the layout; `boundary_skin` is what
    viscosity feels of their velocity, the same array where no body is round (`BodyMotion.smooth`).
    """

    def __init__(self, scene: Scene, layout: Layout, team: Team):
        self.scene, self.team, self.dim = scene, team, scene.dimension
        self.dtype = np.float32 if scene.numerics.precision == "single" else np.float64
        self.lanes = width(self.dtype)
        self.depth = layout.depth
        self._solves = scene.numerics.solver == "converged"
        how = solution(scene, layout.depth) if self._solves else iteration(scene.numerics)
        self.weights = how.weights  # of the sweeps of a step
        self.sweeps, self.most_sweeps, self.unsolved = 0, 0, 0  # so far, in one step, steps that ran out of them
        self.k = sweep_constants(scene, layout.depth, self.dtype)
        self._longest_step = math.inf if scene.closed else sound_step(scene, layout.depth)
        self.position, self.velocity = layout.position.copy(), layout.velocity.astype(float)
        self.pressure_values = layout.pressure.astype(self.dtype)
        self.label = np.arange(len(layout.position), dtype=np.int32)
        self.liquid = layout.liquid  # of each label; None where there is only one
        density = np.array([liquid.density for liquid in scene.all_liquids])
        self._relative = (density / density[0])[self.liquid] if np.ptp(density) > 0 else None
        self.boundary, self.owner = layout.boundary.copy(), layout.owner.copy()
        self.boundary_normal = None if layout.normal is None else layout.normal.copy()
        self.boundary_velocity = self.boundary_skin = np.zeros_like(self.boundary)
        self.owners = int(self.owner.max(initial=0)) + 1
        self._acceleration = np.zeros((self.owners, 6))  # of the owners in the last step
        self.lost = 0
        self.body_force = np.array(scene.fluid.acceleration or (0.0,) * self.dim, float)  # acceleration of all fluid
        self.body_force[-1] -= scene.gravity
        gradient = scene.fluid.acceleration_gradient
        self.body_force_gradient = None if gradient is None else np.array(gradient, float)
        self.periodic = Periodic(scene)
        self.zones = np.array([("xy".index(z.axis), z.start, z.end, z.rate) for z in scene.damping]).reshape(-1, 4)
        support = 2 * scene.smoothing_length
        self.grid = Grid.over(layout.domain_min, layout.domain_max, scene.spacing, support)
        self._sort = CellSort(self.grid, team)
        self._near = Neighbours(self.lanes, self.dim, scene.spacing, support, team)
        self._compose()
        self._allocate()

    def _compose(self) -> None:
        """Compile what this scene needs."""
        L, D, numerics = self.lanes, self.dim, self.scene.numerics
        laminar, implicit = viscid(self.scene), TimeStep(self.scene, self.depth).implicit
        special = varies(self.scene) or implicit
        self.rheology = Rheology(self.scene, implicit, L, self.dtype, self.team) if special else None
        viscosity = numerics.wall_slip if laminar and not special else "none"
        shifted = self.scene.shifting > 0
        dense, surface = self._relative is not None, not self.scene.closed
        artificial = numerics.artificial_viscosity > 0
        self._predictor = predictor.make_predictor(L, D, viscosity, artificial, shifted, dense, surface)
        self._source = pressure.make_source(L, D, dense)
        self._dense = dense
        guarded = self.scene.numerics.wall_guard > 0 and len(self.boundary) > 0
        self._corrector = corrector.make_corrector(
            L, D, guarded, len(self.zones) > 0, shifted, dense, shifted and surface
        )
        no_slip = laminar and numerics.wall_slip == "no_slip"
        self._stiff = implicit and no_slip and self.owners > FIRST_BODY
        self._viscous = laminar or artificial
        drag = self.rheology.drag if special else walls.make_drag(L, D) if no_slip else None
        self.solids = BoundaryParticles(
            self.scene, self.grid, len(self.owner), self.k, self.dtype, self.team, drag=drag if no_slip else None,
            no_slip=no_slip, dense=dense,
        )  # fmt: skip

    def _allocate(self) -> None:
        self._capacity = 0
        self._spare = {}
        self._reserve(len(self.position))

    def _reserve(self, count: int) -> None:
        """Make room for so many fluid particles, ghosts included."""
        if count <= self._capacity:
            return
        self._capacity = n = int(1.2 * count) if self.periodic.axes else count
        dim, b = self.dim, len(self.boundary)
        rows, columns = n + b + 16, 5 if self.scene.shifting else 4
        # Memory for what does not stand at the same time: the orders, then the positions for the search, then the coefficients.
        orders = max(self._sort.room(n), self.solids.sort.room(b))
        size = max(4 * orders, 4 * dim * rows, np.dtype(self.dtype).itemsize * n * columns)
        self._scratch = np.zeros(size, np.uint8)
        self._orders = self._scratch[: 4 * orders].view(np.int32)
        self._xs = self._scratch[: 4 * dim * rows].view(np.float32).reshape(dim, rows)
        self._coefficients = (
            self._scratch[: np.dtype(self.dtype).itemsize * n * columns].view(self.dtype).reshape(n, columns)
        )
        edged = self.scene.shifting > 0 and not self.scene.closed
        self._trial = np.zeros((rows, 2 * dim + 3 if edged else 8 if dim == 3 else 6), self.dtype)
        dense = self._relative is not None
        width = 8 if dim == 3 else 6 if self.rheology or dense else 4
        self._flow = np.zeros((rows, width), self.dtype) if self._viscous else self._trial
        self._field = np.zeros((rows, 5 if dense and dim == 3 else 4), self.dtype)
        self._twin = np.zeros_like(self._field) if len(self.weights) > 1 else self._field
        self._responses, self._silence = [], LinearResponse.none(dim, self.dtype)

    # -------------------------------------------------------------------------------------- one step

    @property
    def relative(self) -> np.ndarray | None:
        """Density over the first liquid's (n,), None where all are the same."""
        return None if self._relative is None else self._relative[self.label]

    @property
    def count(self) -> int:
        return len(self.position)

    @property
    def fields(self) -> dict[str, np.ndarray]:
        """Values (n,) of the fluid particles besides speed and pressure, by name as in `output.fields`, for recorders;
        those of viscosity are of the last step."""
        fields = {} if self.liquid is None else {"liquid": self.liquid[self.label]}
        if self.rheology:
            found = self.rheology.fields(self._flow, self._rows).items()
            fields |= {name: f[self._kept] if len(f) else np.zeros(self.count) for name, f in found}
        return fields

    def place(
        self, owner: int, position: np.ndarray, velocity: np.ndarray, skin: np.ndarray | None = None,
        normal: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Move the boundary particles of an owner: position and velocity (b, dim), `skin` where viscosity feels another
        velocity, and their normals where they turn."""
        chosen = self.of_owner(owner)
        self.boundary[chosen], self.boundary_velocity[chosen] = position, velocity
        if normal is not None:
            self.boundary_normal[chosen] = normal
        if skin is not None and self.boundary_skin is self.boundary_velocity:
            self.boundary_skin = self.boundary_velocity.copy()
        if self.boundary_skin is not self.boundary_velocity:
            self.boundary_skin[chosen] = velocity if skin is None else skin

    def sort_velocities(self) -> None:
        """Take over changes of `boundary_velocity` since `begin`, for the wall guard."""
        solids = self.solids
        np.take(self.boundary_velocity, solids.order, axis=0, out=solids.velocity[: solids.count], mode="clip")

    def of_owner(self, owner: int) -> slice:
        """Boundary particles of an owner."""
        return slice(*np.searchsorted(self.owner, [owner, owner + 1]))

    def begin(self, dt: float, centre: np.ndarray, twist: np.ndarray, smooth: np.ndarray | None = None) -> None:
        """Sort and pack everything where it stands now, and find the neighbours. centre (owners, 3), twist
        (owners, 6): of the owners now; smooth (owners, 6, 6) as in `BodyMotion`."""
        self.dt = dt
        if self._longest_step < math.inf:  # gamma acts once a step: short ones must not make it draw harder
            self.k = self.k._replace(suction=self.dtype(min(1.0, dt / self._longest_step)))
        self.solids.begin(centre, twist, smooth)
        real, sources = self.count, self._add_ghosts()
        order = self._sort.update(self.position, self._orders)
        self._rows = n = self._sort.inside
        self.lost += real - n + self.periodic.link(order, sources, real, n)
        self._state = [self._in_order(a, order, n) for a in self._state]
        self.solids.arrange(self.boundary, self._orders)
        rows, b = (self._flow, self._trial, self._field, self._twin), self.solids.count
        if n:
            self.team.run(pack_fluid, whole(n), self.grid.lower, *self._state[:3], self._xs, *rows)
        solid = self.boundary, self.boundary_velocity, self.boundary_skin, self.owner
        self.solids.pack(n, solid, dt, self.body_force, self._xs, *rows)
        if self.boundary_normal is not None:
            self.solids.face(self.boundary_normal)
        self._kept = slice(None)
        if self._relative is not None:
            self._pack_density(n, b)
        self._near.update(self._sort, 0, self._xs, [(self._sort, 0)] + ([(self.solids.sort, n)] if b else []))
        self.solids.find(self._sort, self._xs)

    def _pack_density(self, n: int, b: int) -> None:
        """The column r of all rows (`fsi.sph.predictor`), also of the ghosts."""
        R, relative = 2 * self.dim + 1, self.relative
        if len(self.periodic.ghosts):
            relative[self.periodic.ghosts] = relative[self.periodic.sources]
        for rows, column in (self._flow, R), (self._trial, R), (self._field, self.dim + 1), (self._twin, self.dim + 1):
            rows[:n, column] = relative
            rows[n : n + b, column] = 0.0

    @property
    def _state(self) -> tuple[np.ndarray, ...]:
        return self.position, self.velocity, self.pressure_values, self.label

    @_state.setter
    def _state(self, arrays) -> None:
        self.position, self.velocity, self.pressure_values, self.label = arrays

    def _in_order(self, values: np.ndarray, order: np.ndarray, count: int) -> np.ndarray:
        """The first `count` values in this order, in the spare array of their size; the old array is the next spare."""
        bits = values.view(f"u{values.itemsize}")
        kind = bits.dtype, bits.shape[1:]
        spare = self._spare.get(kind)
        if spare is None or len(spare) < len(bits):
            spare = np.empty_like(bits)
        if count:
            self.team.run(gather, whole(count), order, bits.reshape(len(bits), -1), spare.reshape(len(spare), -1))
        self._spare[kind] = bits
        return spare[:count].view(values.dtype)

    def _add_ghosts(self) -> np.ndarray:
        """Append the ghosts of periodic axes, with the label -1; the particles they stand for."""
        if not self.periodic.axes:
            return self.periodic.sources
        self._drop_ghosts()
        self.periodic.wrap(self.position)
        sources, images = self.periodic.images(self.position)
        _, velocity, pressure, label = self._state
        ghosts = images, velocity[sources], pressure[sources], np.full(len(sources), -1, label.dtype)
        self._state = [np.concatenate(pair) for pair in zip(self._state, ghosts, strict=True)]
        self._reserve(self.count)
        return sources

    def _drop_ghosts(self) -> None:
        if self.periodic.axes:
            real = self._kept = self.label >= 0
            self._state = [a[real] for a in self._state]

    def predict(self) -> None:
        """Trial velocities and the coefficients of the pressure equation."""
        if self.body_force_gradient is not None:
            self.velocity += self.dt * self.position @ self.body_force_gradient.T
        self.solids.weigh(self._flow)
        near, rheology = self._near, self.rheology
        if rheology:
            kind = np.zeros(self.count, np.int8) if self.liquid is None else self.liquid[self.label]
            rheology.set_viscosity(near, self._flow, kind, self.k, self.periodic)
        self.team.run(
            self._predictor, near.bounds, near.groups, self._flow, self._trial, self.velocity, self._coefficients,
            self.body_force, self.k, self.dtype(self.dt),
        )  # fmt: skip
        if rheology and rheology.implicit:
            boundary_near = self.solids.near if self.solids.count else None
            self.solids.accelerate(self._acceleration, self.body_force)
            self.solids.extrapolate(self._trial)
            rows, skin = (self._flow, self._trial), (self.solids.weights, self.solids.skin)
            self._flow = rheology.solve(near, boundary_near, *rows, self.velocity, skin, self.k, self.dt, self.periodic)
            self._trial[: self.count, self.dim + 1 : 2 * self.dim + 1] = self.velocity
        elif rheology:
            rheology.resist(near, self._flow, self._trial, self.velocity, self.k, self.dt)
        self.periodic.mirror(self._trial, slice(self.dim + 1, None))

    def driven(self) -> np.ndarray:
        """Sum over the particles of r times their acceleration by gravity and other body forces (dim,) [m/s2]."""
        real = self.label >= 0
        r = np.ones(real.sum()) if self._relative is None else self.relative[real]
        total = r.sum() * self.body_force
        return (
            total if self.body_force_gradient is None else total + self.body_force_gradient @ (r @ self.position[real])
        )

    def pressure(self, acceleration: np.ndarray, response: LinearResponse | None = None) -> np.ndarray:
        """Update the pressure for this acceleration (owners, 6); the wrench (owners, 6) on the moving owners."""
        self._acceleration = acceleration
        self.solids.accelerate(acceleration, self.body_force)
        self.solids.extrapolate(self._trial)
        near = self._near
        self.team.run(
            self._source, near.bounds, near.groups, self._trial, self._field, self._twin, self._coefficients, self.k,
            self.dtype(self.dt), self.dtype(self.weights[0][0]),
        )  # fmt: skip
        if self.scene.closed:
            self._take_out_mean()
        self.periodic.mirror(self._field, slice(self.dim, None))
        if response:
            self._rouse(response)
        self._relax(self.weights[1:], self.scene.numerics.pressure_tolerance if self._solves else None, response)
        if self.scene.closed:
            p = self._field[: self.count, self.dim]
            p -= p[self.label >= 0].min() if self.scene.gravity > 0 else p[self.label >= 0].mean()
        self.solids.extrapolate(self._field, response)
        wrench = self.wrench(viscous=True) if self.owners > 1 else np.zeros((self.owners, 6))
        return wrench + self._grasp(acceleration[None])[0] if self._stiff else wrench

    def respond(self, acceleration: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`pressure`, and what each acceleration in `units` (m, owners, 6) adds: the wrench (owners, 6), then the changes
        of the pressure (m, rows), valid until the next call, and of the wrench (m, owners, 6). They are exact, because
        the update is linear in the acceleration, and confined to what the motion of the owners can reach in it."""
        m, n = len(units), self.count + self.solids.count
        if len(self._responses) == 0 or self._responses[0].shape != (len(self._field), m):
            self._responses = [np.zeros((len(self._field), m), self.dtype) for _ in range(2)]
        lift, support = self.solids.lift_of(units), 2 * self.scene.smoothing_length
        response = LinearResponse(*self._responses, lift, self._box_of(units), support)
        wrench = self.pressure(acceleration, response)
        changes = self.solids.press(self._field, response.rows, column=0, columns=m)
        return wrench, response.rows[:n].T, changes + self._grasp(units) if self._stiff else changes

    def _box_of(self, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The box around the boundary particles that move with `units` (m, owners, 6), relative to the grid; a little
        larger, so that none of them is rounded out of it in single precision."""
        owners = np.flatnonzero(np.abs(units).max((0, 2)) > 0)
        clouds = (self.boundary[self.of_owner(owner)] for owner in owners)
        low, high = box_around(clouds, 0.1 * self.scene.spacing, self.dim)
        return low - self.grid.lower, high - self.grid.lower

    def _rouse(self, response: LinearResponse) -> None:
        """The first sweep of responses."""
        response.begin(self.count, self.solids.weights)
        response.spread()
        near = self._near
        self.team.run(
            pressure.make_onset(self.lanes, self.dim, self._dense, response.columns), near.bounds, near.groups, self._field,
            self._coefficients, self.k, self.dtype(self.weights[0][0]), response.rows, response.low, response.high,
        )  # fmt: skip

    def _grasp(self, accelerations: np.ndarray) -> np.ndarray:
        """Change (m, owners, 6) of the viscous wrench by accelerations (m, owners, 6), see `BoundaryParticles.grasp`."""
        grip = self.rheology.grip(self.solids.near, self._flow, self.count, self.solids.count, self.k)
        return self.solids.grasp(grip, self.dt, accelerations)

    def _relax(self, weights, tolerance: float | None, response: LinearResponse | None = None) -> None:
        """Sweeps with these weights, until one changes the pressure by less than tolerance times its maximum."""
        taken = 0
        for alpha, beta in weights:
            self.solids.extrapolate(self._field, response)
            self._advance_pressure(alpha, beta, response)
            taken += 1
            if tolerance and self._change(self._twin) <= tolerance:
                break
        else:
            self.unsolved += tolerance is not None
        self.sweeps, self.most_sweeps = self.sweeps + 1 + taken, max(self.most_sweeps, 1 + taken)

    def settle(self, acceleration: np.ndarray, tolerance: float = 1e-5, most: int = 5000) -> None:
        """Solve the pressure equation at the start, for fluid released from its initial state. Follows `begin`; leaves the
        velocities as they were."""
        velocity = self.velocity.copy()
        self.predict()
        self.pressure(acceleration)
        self._twin = self._field.copy()
        self._relax(solution(self.scene, self.depth, most).weights, tolerance)
        self.sweeps = self.most_sweeps = 0
        self.pressure_values[:] = self._field[: self.count, self.dim]
        self.velocity[:] = velocity

    def add(self, response: np.ndarray, factor: float) -> None:
        """Add factor times a pressure response to the pressure."""
        self._field[: len(response), self.dim] += self.dtype(factor) * response

    def correct(self) -> tuple[np.ndarray, np.ndarray]:
        """New velocities and positions. Returns the sums of `fsi.sph.corrector` and the impulse (owners, 6) that the wall guard
        handed to the owners."""
        near = self._near
        chunks = len(near.bounds) - 1
        sums, impulse = np.zeros((chunks, corrector.sums_width(self.dim))), np.zeros((chunks, self.owners, 6))
        self.team.run(
            self._corrector, near.bounds, near.groups, self._trial, self._field, self._coefficients, self.label,
            self.position, self.velocity, self.pressure_values, self.body_force, self.k, self.dt, self.zones, self.count,
            self.solids.position, self.solids.velocity, self.solids.owner, self.solids.centre, impulse,
            sums,
        )  # fmt: skip
        self._drop_ghosts()
        impulse = self.solids.smoothed(impulse.sum(0))
        maxima = sums[:, : corrector.KINETIC].max(0, initial=0.0)
        return np.concatenate([maxima, sums[:, corrector.KINETIC :].sum(0)]), impulse

    # -------------------------------------------------------------------------------------- parts of it

    def residual(self) -> float:
        """How much the last sweep changed the pressure, as a share of its largest value."""
        return self._change(self._twin if len(self.weights) > 1 else self._trial)

    def _change(self, last: np.ndarray) -> float:
        largest, change = largest_change(self._field, last, self.count, self.dim)
        return change / largest if largest > 0 else 0.0

    def wrench(self, viscous: bool = False, walls: bool = False) -> np.ndarray:
        """Wrench (owners, 6) of the fluid on its owners about their centres; the fixed walls only if asked for."""
        least = 0 if walls else 1
        wrench = self.solids.press(self._field, self._field, column=self.dim, columns=1, least=least)[0]
        return wrench + self.solids.drag(self._flow, least) if viscous else wrench

    def _take_out_mean(self) -> None:
        """Without a free surface the pressure is known up to a constant only, and has a solution only for a source
        without a mean: take the mean out of the source, which the first sweep has used, or the pressure would grow."""
        coefficients = self._coefficients[: self.count]
        mean = coefficients[self.label >= 0, columns.SOURCE].mean()
        coefficients[:, columns.SOURCE] -= mean
        weight = 1 + coefficients[:, columns.INNER] * self.dtype(self.weights[0][0] - 1)
        self._field[: self.count, self.dim] += weight * mean / coefficients[:, columns.DIAGONAL]

    def _advance_pressure(self, alpha: float, beta: float, response: LinearResponse | None = None) -> None:
        """One sweep (`fsi.fluid.chebyshev`)."""
        near, response = self._near, response or self._silence
        response.spread()
        self.team.run(
            pressure.make_sweep(self.lanes, self.dim, self._dense, response.columns), near.bounds, near.groups, self._field,
            self._twin, self._coefficients, self.k, self.dtype(alpha), self.dtype(beta), response.rows, response.twin,
            response.low, response.high,
        )  # fmt: skip
        self.periodic.mirror(self._twin, slice(self.dim, None))
        self._field, self._twin = self._twin, self._field
        response.swap()

    def state(self) -> dict:
        """The particles in their order, the boundary, and the counts of sweeps and losses (`fsi.protocols.Stateful`)."""
        names = [
            *_PARTICLES,
            *_BOUNDARY,
            *(["boundary_skin"] if self.boundary_skin is not self.boundary_velocity else []),
        ]
        arrays = {name: a.copy() for name in names if (a := getattr(self, name)) is not None}
        counts = {name: getattr(self, name) for name in _COUNTS}
        return arrays | counts | {"rheology": self.rheology.state() if self.rheology else None}

    def restore(self, state: dict) -> None:
        """Go on from a state of the same scene. Raises ValueError where it is one of another number of particles."""
        if len(state["boundary"]) != len(self.boundary) or len(state["position"]) > len(self.position):
            raise ValueError("the state is one of other particles")
        for name in _PARTICLES:
            setattr(self, name, state[name].astype(getattr(self, name).dtype))
        self.boundary_skin = self.boundary_velocity
        if "boundary_skin" in state:
            self.boundary_skin = state["boundary_skin"].copy()
        for name in _BOUNDARY:
            if (array := getattr(self, name)) is not None:
                array[:] = state[name]
        for name in _COUNTS:
            setattr(self, name, state[name])
        if self.rheology:
            self.rheology.restore(state["rheology"])

    @property
    def nbytes(self) -> int:
        """Memory of all particle arrays [B]."""
        arrays = [a for a in vars(self).values() if isinstance(a, np.ndarray)] + self._responses
        arrays = {id(whole): whole for whole in map(_memory_of, (*arrays, *self._spare.values()))}.values()
        own = sum(a.nbytes for a in arrays) + (self.rheology.nbytes if self.rheology else 0)
        return own + sum(part.nbytes for part in (self._sort, self._near, self.solids))


def _memory_of(array: np.ndarray) -> np.ndarray:
    """The array that owns the memory of this one."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array
