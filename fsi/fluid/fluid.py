"""The fluid: one step, put together from its parts.

`begin` (sort, pack, neighbours) -> `predict` -> `pressure`, and `respond` and `add` as a coupler asks -> `correct`.
"""

from __future__ import annotations

import math
from contextlib import nullcontext

import numpy as np

from fsi.compute.lanes import width
from fsi.compute.reduce import SERIAL, Reductions
from fsi.compute.team import Team
from fsi.fluid.body_force import BodyForce
from fsi.fluid.boundary import BoundaryParticles
from fsi.fluid.constants import artificial_kind, impulse_units, sweep_constants
from fsi.fluid.departures import Departures
from fsi.fluid.parts import Parts
from fsi.fluid.pressure import make_solver, two_fields
from fsi.fluid.response import LinearResponse, box_around
from fsi.fluid.rheology import Rheology, varies, viscid
from fsi.fluid.timestep import TimeStep, sound_step
from fsi.fluid.volume import Volume, held
from fsi.fluid.workspace import Workspace
from fsi.owners import FIRST_BODY
from fsi.particles.cells import FEW_CELLS, Grid, whole
from fsi.particles.ghosts import make_halo
from fsi.particles.layout import Layout
from fsi.particles.neighbours import Neighbours
from fsi.particles.rows import pack_fluid
from fsi.particles.sorts import make_sort
from fsi.particles.state import BoundaryState, ParticleState
from fsi.particles.vicinity import Vicinity
from fsi.protocols import Halo
from fsi.scene.model import Scene
from fsi.sph import columns, corrector, predictor, walls
from fsi.sph.gradient import make_strain

ROWS = columns.flow, columns.trial, columns.field
MEMORY = (
    "state", "packed rows", "coefficients, before them orders and positions for the search",
    "lists of the fluid", "cells", "responses", "boundary alone, its lists included",
)  # fmt: skip


class Fluid:
    """The order of one step. Owns the time step's scalars and these parts:

    particles: the fluid particles; placed: the boundary particles where their owners have put them; solids: how these act on
    the fluid, a `BoundaryTreatment`; solver: a `PressureSolver`; rheology: of viscosities that vary, None without; standing:
    the pressure that stands anyway, None without; volume: of a sea without bodies, None elsewhere; force: the body force;
    halo: the ghosts; near: the neighbours of the fluid particles; work: the memory of a step; departed: what has left the
    domain; reductions: sums over all particles.
    `k`, `dt`: scalars of the scheme and time step [s], of this step.
    """

    SEEN = ParticleState.NAMES  # what `seen` gives besides the fields

    def __init__(
        self, scene: Scene, layout: Layout, team: Team, halo: Halo | None = None, reductions: Reductions = SERIAL
    ):
        self.scene, self.team, self.dim, self.depth = scene, team, scene.dimension, layout.depth
        self.dtype = np.float32 if scene.numerics.precision == "single" else np.float64
        self.lanes = width(self.dtype)
        self.k = self._scalars(layout)
        self.mean_spacing = layout.volume ** (1 / self.dim)  # side of the cube of a particle's volume [m], in 2D the square
        self._longest_step = math.inf if scene.closed else sound_step(scene, layout.depth)
        self.particles, self.placed = ParticleState(layout, self.dtype, team), BoundaryState(layout)
        self.owners = int(layout.owner.max(initial=0)) + 1
        self.labels = len(layout.position)  # of the particles at the start
        self.liquid = layout.liquid  # of each label; None where there is only one
        density = np.array([liquid.density for liquid in scene.all_liquids])
        self._relative = (density / density[0])[self.liquid] if np.ptp(density) > 0 else None
        self.force = BodyForce(scene)
        self.zones = np.array([("xy".index(z.axis), z.start, z.end, z.rate) for z in scene.damping]).reshape(-1, 4)
        self.halo, self.reductions = halo or make_halo(scene), reductions
        self.sea = None
        if scene.sea:
            from fsi.fluid.sea import Sea

            self.sea = Sea(scene, self.placed, float(self.k.mass))
        support = 2 * scene.smoothing_length
        count = len(layout.position) + len(layout.owner)
        self.grid = Grid.over(
            layout.domain_min, layout.domain_max, scene.spacing, support, count / reductions.processes
        )
        self.sort = make_sort(self.grid, team)
        self.near = Neighbours(self.lanes, self.dim, scene.spacing, support, team)
        reach = 4.4 * scene.reading_length  # what fills the room that a gauge looks at, and the way of a step
        box = layout.domain_min, layout.domain_max
        self.vicinity = Vicinity(*box, reach, max(FEW_CELLS, count / reductions.processes), team)
        self._acceleration = np.zeros((self.owners, 6))  # of the owners in the last step
        self.volume = Volume(self.reductions) if held(scene) else None
        self.loads = None
        if layout.loads is not None:
            from fsi.fluid.loads import FixedLoads

            self.loads = FixedLoads(scene, layout.loads, self.owners)
        self.standing = None
        if scene.numerics.standing_pressure == "apart":
            from fsi.fluid.standing import Standing, stands

            self.standing = Standing(scene, layout, team, reductions) if stands(scene, layout) else None
        self.departed = Departures(scene.tank, self.grid)
        self._units = impulse_units(scene, self.depth, float(self.k.mass))
        self._compose(layout)
        self._rows, self._kept, self._last = 0, slice(None), None
        self._weighed = False  # whether `field` holds pressures times how often they count

    def _scalars(self, layout: Layout):
        """The scalars of the scheme, for `k`."""
        return sweep_constants(self.scene, layout, self.dtype)

    def _compose(self, layout: Layout) -> None:
        """Make the parts that depend on what the scene has, and compile what it needs."""
        L, D, scene = self.lanes, self.dim, self.scene
        laminar, implicit = viscid(scene), TimeStep(scene, self.depth).implicit
        special, artificial = varies(scene) or implicit, artificial_kind(scene)
        dense, shifted, no_slip = self._relative is not None, scene.shifting > 0, scene.numerics.wall_slip == "no_slip"
        self.rheology = Rheology(scene, implicit, L, self.dtype, self.team) if special else None
        drag = None
        if laminar and no_slip:
            drag = self.rheology.drag if special else walls.make_drag(L, D)
        b = len(self.owner)
        self.solids = BoundaryParticles(
            scene, self.grid, b, self.k, self.dtype, self.team, self.reductions, drag=drag, no_slip=laminar and no_slip,
            dense=dense,
        )  # fmt: skip
        self._stiff = implicit and laminar and no_slip and self.owners > FIRST_BODY
        self.work = Workspace(
            scene, b, self.dtype, lambda n, b: max(self.sort.room(n), self.solids.sort.room(b)), spare=self.halo.room,
            viscous=laminar, artificial=artificial, varies=special, dense=dense, two_fields=two_fields(scene),
        )  # fmt: skip
        self.work.reserve(self.halo.expected(self.count))
        shared = self.particles, self.work, self.near, self.solids, self.halo, self.reductions
        self.solver = make_solver(Parts(scene, self.depth, dense, self.dtype, L, self.team, *shared))
        viscosity = scene.numerics.wall_slip if laminar and not special else "none"
        surface = not scene.closed
        self._strain = make_strain(L, D) if artificial == "linear" else None
        self._predictor = predictor.make_predictor(L, D, viscosity, artificial, shifted, dense, surface)
        guarded = scene.numerics.wall_guard > 0 and b > 0
        self._corrector = corrector.make_corrector(L, D, guarded, len(self.zones) > 0, shifted, dense, surface)

    # -------------------------------------------------------------------------------------- one step

    def begin(self, dt: float, centre: np.ndarray, twist: np.ndarray, smooth: np.ndarray | None = None) -> None:
        """Sort and pack everything where it stands now, and find the neighbours. centre (owners, 3), twist
        (owners, 6): of the owners now; smooth (owners, 6, 6) as in `BodyMotion`."""
        self.dt, self._last, self._weighed = dt, None, False
        if self._longest_step < math.inf:  # gamma acts once a step: short ones must not make it draw harder
            self.k = self.k._replace(suction=self.dtype(min(1.0, dt / self._longest_step)))
        self.solids.begin(centre, twist, smooth)
        self._sort()
        xs = self._pack()
        others = [(self.sort, 0)] + ([(self.solids.sort, self._rows)] if self.solids.count else [])
        self.near.update(self.sort, 0, xs, others, self.halo.idle())
        self.solids.find(self.sort, xs)
        self.work.arena.begin("coefficients")

    def _sort(self) -> None:
        """Put fluid, ghosts and boundary in the order of cells, without what has left the domain."""
        own = self.halo.exchange(self.particles)
        chosen = self._near_boundary()
        self.work.reserve(self.count, len(chosen))
        scratch = self.work.arena.begin("orders")
        order = self.sort.update(self.position, scratch)
        self._rows = n = self.sort.inside
        ghosts = self.halo.locate(order, self.sort)
        if self.reductions.combined(own - (n - ghosts)):
            self._lose(order[n:][order[n:] < own])
        self.particles.reorder(order, n, self.work.trial)  # which holds nothing before it is packed
        self.solids.arrange(self.placed, scratch, chosen)

    def _near_boundary(self) -> np.ndarray:
        """Numbers (k,) of the boundary particles that act on this fluid, or on what gauges read of it."""
        chosen = self.halo.nearby(self.placed)
        places = self.boundary if chosen is None else self.boundary[chosen]
        near = self.vicinity.holds(self.position, places)
        return (np.flatnonzero(near) if chosen is None else chosen[near]).astype(np.int32)

    def _lose(self, which: np.ndarray) -> None:
        """Note the particles (m,) that are outside the domain and are dropped."""
        r = np.ones(len(which)) if self._relative is None else self.relative[which]
        gone = self.reductions.together(self.label[which], r, self.position[which], self.velocity[which])
        _, r, position, velocity = (values[np.argsort(gone[0])] for values in gone)
        self.departed.note(r, position, velocity)

    def _pack(self) -> np.ndarray:
        """Fill the packed rows; the positions for the search."""
        n, xs, packed, state = self._rows, self.work.arena.begin("xs"), self.work.packed, self.particles
        if n:
            self.team.run(
                pack_fluid, whole(n), self.grid.lower, state.position, state.velocity, state.pressure,
                columns.packed(self.dim), xs, *packed,
            )  # fmt: skip
        self.solids.pack(n, self.placed, self.dt, self.force.uniform, xs, packed)
        held = self.halo.holds(self.solids.position[: self.solids.count])
        if held is not None:
            self.solids.count_only(held)
        self._kept = slice(None)
        if self._relative is not None:
            flow, trial, field, relative = *(of(self.dim).r for of in ROWS), self.relative
            for rows, column in zip(packed, (flow, trial, field, field), strict=True):
                rows[:n, column] = relative
                rows[n : n + self.solids.count, column] = 0.0
                self.halo.refresh(rows, slice(column, column + 1))
        return xs

    def predict(self) -> None:
        """Trial velocities and the coefficients of the pressure equation."""
        work, near, rheology = self.work, self.near, self.rheology
        self.force.kick(self.velocity, self.position, self.dt)
        if self.sea:
            self.sea.draw(self.particles, self.dt, self.team, self.reductions)
        self.solids.weigh(work.flow, work.trial, self.force.uniform)
        if rheology:
            kind = np.zeros(self.count, np.int8) if self.liquid is None else self.liquid[self.label]
            if rheology.granular:  # of which also ghosts weigh on others
                self.halo.refresh(kind[:, None], slice(0, 1))
            rheology.set_viscosity(near, work.flow, kind, self.k, self.halo)
        if self._strain:
            self.team.run(self._strain, near.bounds, near.groups, work.flow, work.strains, self.k)
            self.halo.refresh(work.strains, slice(None))
        self.team.run(
            self._predictor, near.bounds, near.groups, work.flow, work.strains, work.trial, self.velocity, work.coefficients,
            self.force.uniform, self.k, self.dtype(self.dt),
        )  # fmt: skip
        if self.volume:
            self.volume.update(work.coefficients[: self.count, columns.DEFICIT][self.particles.own], self.k.relaxation)
            self.k = self.k._replace(draw=self.dtype(self.volume.draw))
        if rheology and rheology.implicit:
            boundary_near = self.solids.near if self.solids.count else None
            self.solids.accelerate(self._acceleration, self.force.uniform)
            self.solids.extrapolate(work.trial)
            rows, skin = (work.flow, work.trial), (self.solids.shepard, self.solids.skin)
            last = work.trial[: self.count, columns.trial(self.dim).p]
            kept = last.copy()
            self._weigh_rows(last)  # as in the gradient that will act
            work.flow = rheology.solve(near, boundary_near, *rows, self.velocity, skin, self.k, self.dt, self.halo)
            last[:] = kept
            work.trial[: self.count, columns.trial(self.dim).all_of("u")] = self.velocity
        elif rheology:
            rheology.resist(near, work.flow, work.trial, self.velocity, self.k, self.dt)
        self.halo.refresh(work.trial, slice(columns.trial(self.dim).u, None))
        if self.standing:
            self.standing.begin(self.particles, self.dt)
            self.standing.stand(self.position, self.solids.position[: self.solids.count], self.dtype)

    def pressure(self, acceleration: np.ndarray, response: LinearResponse | None = None) -> np.ndarray:
        """Update the pressure for this acceleration (owners, 6); the wrench (owners, 6) on the moving owners."""
        self._acceleration = acceleration
        self.solids.accelerate(acceleration, self.force.uniform)
        self.solver.update(self.k, self.dt, response)
        self._weigh_rows(self.work.field[: self.count, columns.field(self.dim).p], response)
        self._weighed = self._counts is not None
        if self.standing:
            self.standing.take_out(self.work.field)
        wrench = self.wrench(viscous=True) if self.owners > 1 else np.zeros((self.owners, 6))
        return wrench + self._grasp(acceleration[None])[0] if self._stiff else wrench

    @property
    def _counts(self) -> np.ndarray | None:
        """How often the pressure of each particle (n,) counts in the gradient; None without a free surface."""
        return None if self.scene.closed else self.work.coefficients[: self.count, columns.COUNTS]

    def _weigh_rows(self, pressure: np.ndarray, response: LinearResponse | None = None) -> None:
        """Let pressures (n,) and their responses count in the gradient as the rows under a free surface need it
        (`fsi.sph.kernel.surface_rows`), for the forces on the fluid and on the bodies alike."""
        if self._counts is None:
            return
        self.halo.refresh(self.work.coefficients, slice(columns.COUNTS, columns.COUNTS + 1))
        pressure *= self._counts
        if response:
            response.rows[: self.count] *= self._counts[:, None]

    def respond(self, acceleration: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`pressure`, and what each acceleration in `units` (m, owners, 6) adds: the wrench (owners, 6), then the changes
        of the pressure (m, rows), valid until the next call, and of the wrench (m, owners, 6). They are exact, because
        the update is linear in the acceleration, and confined to what the motion of the owners can reach in it."""
        m, n = len(units), self.count + self.solids.count
        lift, support = self.solids.lift_of(units), 2 * self.scene.smoothing_length
        response = LinearResponse(*self.work.responses(m), lift, self._box_of(units), support)
        wrench = self.pressure(acceleration, response)
        pressed = self.solids.press(self.work.field, response.rows, column=0, columns=m)
        return wrench, response.rows[:n].T, pressed + self._grasp(units) if self._stiff else pressed

    def _box_of(self, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The box around the boundary particles that move with `units` (m, owners, 6), relative to the grid; a little
        larger, so that none of them is rounded out of it in single precision."""
        owners = np.flatnonzero(np.abs(units).max((0, 2)) > 0)
        clouds = (self.boundary[self.of_owner(owner)] for owner in owners)
        low, high = box_around(clouds, 0.1 * self.scene.spacing, self.dim)
        return low - self.grid.lower, high - self.grid.lower

    def _grasp(self, accelerations: np.ndarray) -> np.ndarray:
        """Change (m, owners, 6) of the viscous wrench by accelerations (m, owners, 6), see `BoundaryParticles.grasp`."""
        grip = self.rheology.grip(self.solids.near, self.work.flow, self.count, self.solids.count, self.k)
        return self.solids.grasp(grip, self.dt, accelerations)

    def add(self, response: np.ndarray, factor: float) -> None:
        """Add factor times a pressure response to the pressure."""
        self.work.field[: len(response), columns.field(self.dim).p] += self.dtype(factor) * response

    def correct(self) -> tuple[np.ndarray, np.ndarray]:
        """New velocities and positions. Returns the sums of `columns.corrector_sums` and the impulse (owners, 6) that the wall
        guard handed to the owners."""
        near, work, solids, state = self.near, self.work, self.solids, self.particles
        if self.standing:
            self.standing.push(state.velocity, self.dt)
        chunks = len(near.bounds) - 1
        place = columns.corrector_sums(self.dim)
        owner, centre = (solids.owner, solids.centre) if self.loads is None else self.loads.booked(solids)
        sums = np.zeros((chunks, place.width("loss")))
        impulse = np.zeros((chunks, len(centre), 6), np.int64)
        centre = np.hstack([centre, np.tile(1 / self._units[[0, 3]], (len(centre), 1))])  # in which they are counted
        self.team.run(
            self._corrector, near.bounds, near.groups, work.trial, work.field, work.coefficients, state.label,
            state.position, state.velocity, state.pressure, self.force.uniform, self.k, self.dt, self.zones, state.count,
            solids.position, solids.velocity, owner, centre, impulse, sums,
        )  # fmt: skip
        if self.standing:
            self._restore_standing()
        self._kept = self.halo.drop(state)
        maxima = self.reductions.largest(sums[:, : place.kinetic])
        totals = self.reductions.total(sums[:, place.kinetic :])
        impulse = self.reductions.total(impulse) * self._units
        if self.loads is not None:
            impulse = self.loads.unbooked(impulse)
        return np.concatenate([maxima, totals]), solids.smoothed(impulse)

    def _restore_standing(self) -> None:
        """The whole pressure, for the rows and for the next step."""
        self.standing.give_back(self.work.field)
        pressure = self.work.field[: self.count, columns.field(self.dim).p]
        self.particles.pressure[:] = pressure if self._counts is None else pressure / self._counts

    def sums(self) -> np.ndarray:
        """After `correct`: kinetic energy, r height, volume / dr^dim and momentum (dim,) of all fluid as in its sums, in an
        order that does not depend on where particles are held."""
        state, mass = self.particles, float(self.k.mass)
        r = np.ones(self.count) if self._relative is None else self.relative
        deficit = self.work.coefficients[: self._rows][self._kept, columns.DEFICIT].astype(float)
        kinetic = 0.5 * mass * r * (state.velocity**2).sum(1)
        values = [kinetic, r * state.position[:, -1], 1.0 / (1.0 - deficit), *(mass * r * state.velocity.T)]
        return self.reductions.by_label(self.label, np.stack(values, axis=1), self.labels)

    # -------------------------------------------------------------------------------------- about it

    def settle(self, acceleration: np.ndarray, tolerance: float = 1e-5, most: int = 5000) -> None:
        """Solve the pressure equation at the start, for fluid released from its initial state. Follows `begin`; leaves the
        velocities as they were."""
        velocity = self.velocity.copy()
        self.predict()
        self.solids.accelerate(acceleration, self.force.uniform)
        self.solver.update(self.k, self.dt)
        self.solver.settle(self.k, tolerance, most)
        self.particles.pressure[:] = self.work.field[: self.count, columns.field(self.dim).p]
        self.velocity[:] = velocity

    def wrench(self, viscous: bool = False, walls: bool = False) -> np.ndarray:
        """Wrench (owners, 6) of the fluid on its owners about their centres; the fixed walls only if asked for."""
        least, field = 0 if walls else 1, self.work.field
        wrench = self.solids.press(field, field, column=columns.field(self.dim).p, columns=1, least=least)[0]
        if self.standing:
            on_fluid = self.standing.on_fluid(self.particles, float(self.k.mass)) if walls else None
            wrench = wrench + self.standing.wrench(self.solids, field, on_fluid)
        return wrench + self.solids.drag(self.work.flow, least) if viscous else wrench

    def felt(self) -> np.ndarray:
        """Force (2, count, dim) of the whole pressure, and of viscosity, on each boundary particle [N]."""
        field, column = self.work.field, columns.field(self.dim).p
        with self.standing.whole(field) if self.standing else nullcontext():
            return self.solids.felt(field, column, self.work.flow)

    def driven(self) -> np.ndarray:
        """Sum over the particles of r times their acceleration by gravity and other body forces (dim,) [m/s2]."""
        own = self.particles.own
        r = np.ones(own.sum()) if self._relative is None else self.relative[own]
        return self.force.total(r, self.position[own], self.reductions)

    def residual(self) -> float:
        """How much the last sweep changed the pressure, as a share of its largest value."""
        if self._last:
            return self._last["residual"]
        counts = self.work.coefficients[: self._rows, columns.COUNTS] if self._weighed else None
        return self.solver.residual(self._rows, counts)

    @property
    def fields(self) -> dict[str, np.ndarray]:
        """Values (n,) of the fluid particles besides speed and pressure, by name as in `output.fields`, for recorders;
        those of viscosity are of the last step."""
        fields = {} if self.liquid is None else {"liquid": self.liquid[self.label]}
        return fields | (self._last["fields"] if self._last else self._viscosities())

    def _whole(self, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Those of all particles of all processes (`Reductions.whole`)."""
        return dict(zip(arrays, self.reductions.whole(*arrays.values()), strict=True))

    def seen(self) -> dict[str, np.ndarray]:
        """Position, velocity, pressure, label and the fields of all particles of all processes, for recorders."""
        return self._whole({name: getattr(self.particles, name) for name in self.SEEN} | self.fields)

    def _viscosities(self) -> dict[str, np.ndarray]:
        found = self.rheology.fields(self.work.flow, self._rows).items() if self.rheology else ()
        return {name: f[self._kept] if len(f) else np.zeros(self.count) for name, f in found}

    # -------------------------------------------------------------------------------------- what is remembered

    def state(self) -> dict:
        """All that the fluid remembers between two steps: arrays (copies), numbers, and dictionaries of them. To be taken after
        `correct` or before the first `begin`."""
        viscosities = self._last["fields"] if self._last else self._viscosities()
        return {
            "particles": self._whole(self.particles.state()),
            "boundary": self.placed.state(),
            "solver": self.solver.state(),
            "rheology": self.rheology.state() if self.rheology else None,
            "acceleration": self._acceleration.copy(),
            "suction": float(self.k.suction),
            **self.departed.state(),
            "residual": float(self.residual()),
            **({"standing": self.standing.state()} if self.standing else {}),
            **({"volume": self.volume.state()} if self.volume else {}),
            "fields": self._whole({name: values.copy() for name, values in viscosities.items()}),
        }

    def restore(self, state: dict) -> None:
        """Go on from `state`, of a fluid of the same scene, bit for bit. Raises ValueError where it is one of another."""
        if state["boundary"]["owner"].tolist() != self.owner.tolist() or len(state["acceleration"]) != self.owners:
            raise ValueError("the state is one of other boundary particles")
        if state["particles"]["position"].shape[1] != self.dim or bool(state["rheology"]) != bool(self.rheology):
            raise ValueError("the state is one of another kind of fluid")
        self.particles.restore(state["particles"])
        self.placed.restore(state["boundary"])
        self.solver.restore(state["solver"])
        if self.standing:
            self.standing.restore(state["standing"])
        if self.rheology:
            self.rheology.restore(state["rheology"])
        if self.volume:
            self.volume.restore(state["volume"])
        self.work.reserve(self.count)
        self.sort.inside, self.solids.count = -1, 0  # the cells and places are those of another step
        self._acceleration = np.array(state["acceleration"])
        self.k = self.k._replace(suction=self.dtype(state["suction"]))
        self.departed.restore(state)
        fields = {name: np.array(values) for name, values in state["fields"].items()}
        self._last = {"residual": float(state["residual"]), "fields": fields}

    # -------------------------------------------------------------------------------------- short names

    @property
    def count(self) -> int:
        """Fluid particles, ghosts included within a step."""
        return self.particles.count

    @property
    def total_count(self) -> int:
        """Fluid particles of all processes, ghosts included within a step."""
        return int(self.reductions.combined(self.count))

    @property
    def lost(self) -> int:
        """Particles that have left the domain, of all processes."""
        return self.departed.lost

    @property
    def position(self) -> np.ndarray:
        return self.particles.position

    @position.setter
    def position(self, position: np.ndarray) -> None:
        self.particles.position = position

    @property
    def velocity(self) -> np.ndarray:
        return self.particles.velocity

    @velocity.setter
    def velocity(self, velocity: np.ndarray) -> None:
        self.particles.velocity = velocity

    @property
    def pressure_values(self) -> np.ndarray:
        return self.particles.pressure

    @property
    def label(self) -> np.ndarray:
        return self.particles.label

    @property
    def relative(self) -> np.ndarray | None:
        """Density over the first liquid's (n,), None where all are the same."""
        return None if self._relative is None else self._relative[self.label]

    @property
    def boundary(self) -> np.ndarray:
        return self.placed.position

    @property
    def boundary_velocity(self) -> np.ndarray:
        return self.placed.velocity

    @property
    def owner(self) -> np.ndarray:
        return self.placed.owner

    def boundary_around(self, point: np.ndarray, reach: float) -> np.ndarray:
        """Boundary particles (b, dim) within reach [m] of the vertical through a point (dim - 1,), in the order of cells, of
        all processes."""
        near = ((self.boundary[:, :-1] - point) ** 2).sum(1) < reach**2
        return self.boundary[near][self.grid.order(self.boundary[near])]

    def of_owner(self, owner: int) -> slice:
        """Boundary particles of an owner."""
        return self.placed.of_owner(owner)

    @property
    def memory(self) -> dict[str, int]:
        """Memory [B] of what holds particles, by part (`MEMORY`)."""
        work, liquids = self.work.nbytes, (self.liquid, self._relative)
        sizes = (
            self.particles.nbytes + sum(a.nbytes for a in liquids if a is not None),
            work["rows"] + sum(part.nbytes for part in (self.rheology, self.standing) if part), work["arena"], self.near.nbytes,
            self.sort.nbytes, work["responses"], self.placed.nbytes + self.solids.nbytes,
        )  # fmt: skip
        return dict(zip(MEMORY, sizes, strict=True))

    @property
    def nbytes(self) -> int:
        """Memory of all particle arrays [B]."""
        return sum(self.memory.values())
