"""Implicit incompressible SPH (Ihmsen et al. 2014): the solver `iisph`, and the fluid that is stepped with it.

Nothing of it is imported or compiled for a scene with another solver (`fsi.fluid.fluid.make_fluid`).
"""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.body_force import BodyForce
from fsi.fluid.fluid import Fluid
from fsi.fluid.parts import Parts
from fsi.fluid.response import LinearResponse
from fsi.fluid.weighted_walls import WeightedWalls
from fsi.fluid.workspace import Workspace
from fsi.particles.layout import Layout
from fsi.scene.model import Scene
from fsi.sph import columns, implicit, wall_guard
from fsi.sph.implicit import Scalars
from fsi.sph.shapes import filling, roughest, shape

OMEGA = 0.5  # relaxation of a sweep, at most
STABLE = 1.42  # a sweep's largest eigenvalue on a lattice times the relaxation: 0.5 for the cubic spline in 3D
SOURCE = 1.0  # density relaxation of the source's scheme: a step takes the whole error of the density away
RELAXATION = (
    0.1  # share that one takes away without a value and without bodies; 0.02 to 0.3 do alike (docs/guide/implicit.md)
)
ROOM = 0.2  # lack of density of a particle that may be approached: under a flat surface it is 0.16
# Of the last step's pressure, that the sweeps start from: half with the source's scheme, where all of it makes probes in still
# water wrong by 40 %; all of it where the divergence of the velocities is most of the source.
HALF, WHOLE = 0.5, 1.0
LEAST, MOST = 3, 1000  # iterations of a step
SETTLED = 0.01  # of the tolerance, that the pressure at the start is solved to


def density_share(scene: Scene) -> float:
    """gamma: the share of the error of the density that a step takes away; without a value in the scene all of it where there
    are bodies, which a part of it damps."""
    if scene.numerics.density_relaxation is not None:
        return scene.numerics.density_relaxation
    return SOURCE if scene.bodies else RELAXATION


def scalars(scene: Scene, layout: Layout, dtype) -> Scalars:
    """The scalars of the scheme for a scene with this layout."""
    dim, dr, h, rho, numerics = (
        scene.dimension,
        scene.spacing,
        scene.smoothing_length,
        scene.fluid.density,
        scene.numerics,
    )
    form, volume = shape(numerics.kernel, h, dim), 1 / filling(numerics.kernel, layout.volume ** (1 / dim), h, dim).density
    sound = math.sqrt(scene.gravity * layout.depth) / numerics.mach
    slope, force = form.factor * volume, BodyForce(scene).uniform
    relaxation = density_share(scene)
    values = Scalars(
        inverse_support=0.5 / h,
        eta2=(0.1 * h) ** 2,
        density_factor=form.alpha * volume,
        divergence_factor=slope,
        gradient_factor=slope / rho,
        diagonal_factor=slope**2 / rho,
        artificial_factor=numerics.artificial_viscosity * sound * h * slope,
        friction_factor=0.5 * numerics.wall_friction * sound * h * slope,
        omega=min(OMEGA, STABLE / roughest(numerics.kernel, numerics.smoothing_ratio, dim)),
        head_x=rho * force[0],
        head_y=rho * force[1] if dim == 3 else 0.0,
        head_z=rho * force[-1],
        relaxation=relaxation,
        room=0.0 if relaxation == SOURCE else ROOM,
        density=rho,
        mass=rho * layout.volume * (scene.tank.width if dim == 2 else 1.0),
        suction=1.0,
        draw=0.0,
        guard_level=wall_guard.level(numerics.wall_guard),
        guard_reach2=(wall_guard.REACH * dr) ** -2,
        guard_piece=wall_guard.PIECE * dr,
        guard2=(1.1 * numerics.wall_guard * dr + 1.5 * numerics.courant * h) ** 2,  # and a long step on
    )
    return Scalars(*(dtype(value) for value in values))


class ImplicitFluid(Fluid):
    """The order of one step with `iisph`; walls act by weights (`WeightedWalls`)."""

    def _scalars(self, layout: Layout) -> Scalars:
        return scalars(self.scene, layout, self.dtype)

    def _compose(self, layout: Layout) -> None:
        L, D, scene = self.lanes, self.dim, self.scene
        numerics = scene.numerics
        friction, b = numerics.wall_friction > 0 and scene.gravity > 0, len(self.owner)
        self.rheology, self._strain, self._stiff = None, None, False
        self.solids = WeightedWalls(scene, self.grid, layout, self.k, self.dtype, self.team, self.reductions, friction)
        self.work = Workspace(
            scene, b, self.dtype, lambda n, b: max(self.sort.room(n), self.solids.sort.room(b)), spare=self.halo.room,
            viscous=True, varies=True, dense=False, two_fields=False,
        )  # fmt: skip
        self.work.reserve(self.halo.expected(self.count))
        shared = self.particles, self.work, self.near, self.solids, self.halo, self.reductions
        self.solver = ImplicitPressure(Parts(scene, self.depth, False, self.dtype, L, self.team, *shared))
        artificial = numerics.artificial_viscosity > 0 and scene.gravity > 0
        self._predictor = implicit.make_predictor(L, D, numerics.kernel, artificial, friction)
        guarded = numerics.wall_guard > 0 and b > 0
        self._corrector = implicit.make_corrector(L, D, numerics.kernel, guarded, len(self.zones) > 0)

    def predict(self) -> None:
        """See `Fluid`; a new step, which takes as many iterations as its first pressure needs."""
        self.solver.begin()
        super().predict()

    @property
    def _counts(self) -> None:
        """Pressures count once (`Fluid`)."""
        return None

    def respond(self, acceleration: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Fluid`: the answer of the particles that are under pressure, after as many iterations as the pressure took."""
        wrench, n = self.pressure(acceleration), self.count
        changes, pressures = np.zeros((len(units), self.owners, 6)), np.empty((len(units), n), self.dtype)
        for m, unit in enumerate(units):
            rows = self.solver.respond(self.k, self.dt, unit)
            pressures[m] = rows[:n, columns.field(self.dim).p]
            changes[m] = self.solids.press_change(rows, columns.field(self.dim).p)
        return wrench, pressures, changes


class ImplicitPressure:
    """A `PressureSolver`: relaxed Jacobi sweeps until the mean density error of a step is below the tolerance, at least `LEAST`
    iterations; all pressure updates of a step take as many as the first. With the source's scheme the error is that of what
    is too dense, else what is left of the equation, so that no pressure of the last step stays too high. Owns the
    accelerations by pressure (rows of x and a), and the counts."""

    def __init__(self, parts: Parts):
        self._parts, scene = parts, parts.scene
        self.tolerance, self._dim, self._kernel = (
            scene.numerics.density_tolerance,
            scene.dimension,
            scene.numerics.kernel,
        )
        variant = parts.lanes, self._dim, self._kernel
        self._source, self._push, self._relax = (
            make(*variant) for make in (implicit.make_source, implicit.make_push, implicit.make_relax)
        )
        self._pressure, self._a = columns.field(self._dim).p, columns.flow(self._dim).all_of("u")
        self._pushed = np.empty((0, 0), parts.dtype)
        self._iterations: int | None = None
        self._start = HALF if density_share(scene) == SOURCE else WHOLE
        self.sweeps, self.most_sweeps, self.unsolved, self.error = 0, 0, 0, 0.0

    def begin(self) -> None:
        """A new step."""
        self._iterations = None

    def update(self, k: Scalars, dt: float, response: LinearResponse | None = None) -> None:
        """See `PressureSolver`."""
        parts, work = self._parts, self._parts.work
        parts.boundary.move(work.trial, columns.trial(self._dim).u, dt)
        self._run(self._source, work.trial, work.field, work.coefficients, k, parts.dtype(dt), parts.dtype(self._start))
        parts.halo.refresh(work.field, slice(self._pressure, None))
        self._ready(work.field)
        if self._iterations is None:
            self._iterations = self._solve(k, dt, self.tolerance, MOST)
            self.unsolved += self.error >= self.tolerance
        else:
            self._solve(k, dt, None, self._iterations)
        self.sweeps, self.most_sweeps = self.sweeps + 2 * self._iterations, max(self.most_sweeps, 2 * self._iterations)

    def settle(self, k: Scalars, tolerance: float, most: int) -> None:
        """See `PressureSolver`; to a small part of the tolerance of a step."""
        self._solve(k, self._parts.dtype(self._dt), SETTLED * self.tolerance, most)
        self.sweeps = self.most_sweeps = 0

    def respond(self, k: Scalars, dt: float, unit: np.ndarray) -> np.ndarray:
        """Change of the pressure, rows as those of `field`, by an acceleration `unit` (owners, 6) of the boundary."""
        parts, work, n = self._parts, self._parts.work, self._parts.particles.count
        make = parts.lanes, self._dim, self._kernel
        rows, source = work.field.copy(), np.empty(n, parts.dtype)
        rows[:n, self._pressure] = 0.0
        parts.boundary.stir(self._pushed, self._a.start, unit)
        self._run(implicit.make_change(*make), self._pushed, source, k, parts.dtype(dt * dt))
        push, linear = (kernel(*make, linear=True) for kernel in (implicit.make_push, implicit.make_relax))
        for _ in range(self._iterations):
            self._run(push, rows, self._pushed, k)
            parts.halo.refresh(self._pushed, self._a)
            self._sweep(linear, rows, k, dt, source)
        return rows

    def residual(self, rows: int, counts: np.ndarray | None = None) -> float:
        """Mean density error of a step, as a share of that at rest, after the last update."""
        return self.error

    def state(self) -> dict:
        """See `PressureSolver`."""
        return {name: getattr(self, name) for name in ("sweeps", "most_sweeps", "unsolved", "error")}

    def restore(self, state: dict) -> None:
        """See `PressureSolver`."""
        self.sweeps, self.most_sweeps, self.unsolved = (int(state[k]) for k in ("sweeps", "most_sweeps", "unsolved"))
        self.error = float(state["error"])

    def _ready(self, field: np.ndarray) -> None:
        """Rows for the accelerations: the places of `field`, and psi."""
        parts, dim = self._parts, self._dim
        if self._pushed.shape[0] != len(field):
            self._pushed = np.zeros((len(field), columns.flow(dim).width("mu")), parts.dtype)
        self._pushed[:, :dim] = field[:, :dim]
        parts.boundary.mark(self._pushed, columns.flow(dim).mu)

    def _solve(self, k: Scalars, dt: float, tolerance: float | None, most: int) -> int:
        """Iterate up to so often, or until the error is below the tolerance; how often it was."""
        parts, field, self._dt = self._parts, self._parts.work.field, dt
        for number in range(1, most + 1):
            self._run(self._push, field, self._pushed, k)
            parts.halo.refresh(self._pushed, self._a)
            excess = self._sweep(self._relax, field, k, dt, np.empty(0, parts.dtype))
            if tolerance is not None and number >= LEAST:
                self.error = excess
                if excess < tolerance:
                    break
        return number

    def _sweep(self, kernel, field: np.ndarray, k: Scalars, dt: float, source: np.ndarray) -> float:
        """One sweep; the mean of the density in excess before it."""
        parts, work = self._parts, self._parts.work
        excess = np.zeros(len(parts.near.bounds) - 1)
        self._run(
            kernel, self._pushed, field, work.coefficients, parts.particles.label, excess, k, parts.dtype(dt), source,
            work.field,
        )  # fmt: skip
        parts.halo.refresh(field, slice(self._pressure, self._pressure + 1))
        total, count = parts.reductions.total(excess), parts.reductions.combined(int(parts.particles.own.sum()))
        return float(total) / max(int(count), 1)

    def _run(self, kernel, *args) -> None:
        self._parts.team.run(kernel, self._parts.near.bounds, self._parts.near.groups, *args)
