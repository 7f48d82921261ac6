"""Liquids whose viscosity differs from particle to particle, and viscosity that is implicit in time.

The laws are those of `fsi.scene.rheology`, of the shear rate s = sqrt(2 S : S); Cross's with K = mu_0 / tau tends to a Bingham
plastic of yield stress tau as mu_0 grows (Shao & Lo 2003). Smagorinsky (1963): the eddies that the spacing dr does not
resolve add rho (C_s dr)^2 s, with a C_s of the scene or one that the flow gives (`fsi.fluid.eddies`).

Implicit viscosity solves u = u* + dt A(u), A the viscous acceleration, by Chebyshev's sweeps (`fsi.fluid.chebyshev`). Every
sweep is a sum of pair forces that cancel, so momentum is kept whatever the tolerance.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.chebyshev import HIGHEST, chebyshev
from fsi.scene.model import Liquid, Scene
from fsi.scene.rheology import Granular
from fsi.sph import kernel, viscosity, walls
from fsi.sph.laws import CROSS
from fsi.state import Remembers

LEAST = 1e-30  # [Pa s] of an inviscid liquid, so that the harmonic mean of two of them is a number
EXPLICIT = 0.125  # dt nu / h^2 up to which explicit viscosity is stable (Morris et al. 1997, eq. 21)
WORTH = 2.0  # other limits of the time step over that of explicit viscosity, from which on implicit is taken
STIFFEST = 1e5  # largest dt times rate of viscous decay for implicit viscosity, which takes 5 sqrt of it sweeps
LEVELS, WHOLE = 2, 2.0**24  # in a spacing of the columns above grains, and what a particle in them counts
CUT = 0.9  # share of a column, below which it is taken for cut by a wall
SOLVED = 1e-4  # share of the change of the velocities that the implicit sweeps may leave


def law(liquid: Liquid) -> tuple[float, ...]:
    """mu_0 [Pa s], mu_inf [Pa s], and the constants of `fsi.scene.rheology`; a Newtonian liquid has mu_0 = mu_inf."""
    if liquid.rheology is None:
        mu = max(liquid.density * liquid.kinematic_viscosity, LEAST)
        return mu, mu, CROSS, 0.0, 0.0, 0.0, 0.0
    return liquid.rheology.rest_viscosity, max(liquid.rheology.mu_inf, LEAST), *liquid.rheology.constants


def buoyant_density(scene: Scene, number: int) -> float:
    """Density [kg/m3] of a granular liquid less that of what fills its pores; 0 for the others, whose law has no pressure."""
    liquid = scene.all_liquids[number]
    if not isinstance(liquid.rheology, Granular):
        return 0.0
    pores = liquid.rheology.pore_density
    return liquid.density - (pores if pores is not None else scene.fluid.density * (number > 0))


def viscid(scene: Scene) -> bool:
    """True where there is any viscosity."""
    eddies = scene.numerics.turbulence != "none"
    return scene.numerics.viscosity != "none" and (eddies or any(law(q)[0] > LEAST for q in scene.all_liquids))


def shears(scene: Scene) -> bool:
    """True where the viscosity depends on the shear rate."""
    depends = scene.numerics.turbulence != "none" or any(liquid.rheology for liquid in scene.all_liquids)
    return viscid(scene) and depends


def varies(scene: Scene) -> bool:
    """True where the viscosity is not one number."""
    return viscid(scene) and (shears(scene) or len(scene.all_liquids) > 1)


def by_pairs(scene: Scene) -> bool:
    """True where pairs of particles have the viscosity of their own shear rate: a liquid has a law, and the eddies, if any, a
    coefficient of the scene's."""
    return shears(scene) and scene.numerics.turbulence != "dynamic" and any(q.rheology for q in scene.all_liquids)


def largest(scene: Scene) -> float:
    """Largest kinematic viscosity [m2/s] that a pair of particles can show; eddies, which never limit the step, aside."""
    if not viscid(scene):
        return 0.0
    laws = [(law(liquid)[0], liquid.density) for liquid in scene.all_liquids]
    top = max(mu for mu, _ in laws)
    return max(min(2 * mu, top) / rho for mu, rho in laws)  # a harmonic mean stays below twice the smaller one


def decay_rate(scene: Scene) -> float:
    """Bound [1/s] on the rate at which viscosity evens out velocities from particle to particle (Gershgorin)."""
    dim, dr = scene.dimension, scene.spacing
    lattice = kernel.lattice(dr, scene.smoothing_length, dim)
    return 2 * largest(scene) * 2 * dr**dim * lattice.laplacian / lattice.second_moment


def explicit_limit(scene: Scene) -> float:
    """Largest time step [s] of explicit viscosity."""
    nu = largest(scene)
    return EXPLICIT * scene.smoothing_length**2 / nu if nu > 0 else math.inf


def viscous_sweeps(span: float) -> int:
    """Sweeps of implicit viscosity whose spectrum spans 1 + dt `decay_rate`."""
    return math.ceil(math.acosh(1 / SOLVED) / math.acosh((span + 1) / (span - 1)))


def step_limit(scene: Scene, others: float) -> tuple[float, bool]:
    """Limit of the time step [s] by viscosity, and whether it is implicit, for a scene whose other limits at t = 0 are
    `others` [s]."""
    how, explicit = scene.numerics.viscous_step, explicit_limit(scene)
    worth = math.isfinite(others) and others > WORTH * explicit
    if math.isfinite(explicit) and (how == "implicit" or (how == "auto" and worth)):
        return STIFFEST / decay_rate(scene), True
    return explicit, False


def height_above(position: np.ndarray, dr: float, volume: float) -> np.ndarray:
    """Height (n,) [m] of what stands above each of the particles at `position` (n, dim), half of itself included, if it were
    packed as a lattice: particles of this volume [m^dim], summed up in columns a spacing wide that blend into each other.

    A sum, not the way to the top: that lies a tenth of a spacing off where the top row does, and 1 % of stress is 10 % of
    the speed of grains. A column that a wall cuts holds less and counts as full. Weights are whole numbers, so that sums
    depend on no order."""
    n, dim = position.shape
    if n == 0:
        return np.empty(0)
    place = position / dr * np.array([1.0] * (dim - 1) + [float(LEVELS)])
    lowest = np.floor(place).astype(np.int64)
    part, lowest = place - lowest, lowest - lowest.min(0)
    shape = tuple(lowest.max(0) + 2)
    corners = [np.array(corner) for corner in np.ndindex(*(2,) * dim)]
    index = [np.ravel_multi_index(tuple((lowest + corner).T), shape) for corner in corners]
    weight = [np.where(corner, part, 1 - part).prod(1) for corner in corners]
    held = np.zeros(math.prod(shape))
    for i, w in zip(index, weight, strict=True):
        held += np.bincount(i, np.rint(w * WHOLE), len(held))
    held = held.reshape(shape)
    above = np.cumsum(held[..., ::-1], axis=-1)[..., ::-1] - 0.5 * held
    levels = np.maximum((held > 0).sum(-1, keepdims=True) - 1, 1)
    share = LEVELS * held.sum(-1, keepdims=True) / (WHOLE * levels)  # of a column of this height that is filled
    above = (above / np.where((share > 0) & (share < CUT), share, 1.0)).ravel()
    total = sum(w * above[i] for i, w in zip(index, weight, strict=True))
    return total * (volume / dr ** (dim - 1) / WHOLE)


class Rheology(Remembers):
    """Viscosity of one run: the laws of its liquids and the sweeps that apply them. Owns the laws, the second copy of the rows
    that implicit sweeps need, and `rate` (n,), the shear rate [1/s] of the particles in their present order, where the scene
    needs it."""

    remembered = ("sweeps",)

    def __init__(self, scene: Scene, implicit: bool, lanes: int, dtype, team):
        dim, self.scene, self.team, self.dtype = scene.dimension, scene, team, dtype
        self.implicit, self.shears = implicit, shears(scene)
        self.no_slip = scene.numerics.wall_slip == "no_slip"
        self.columns = 8 if dim == 3 else 6
        eddy = (scene.numerics.smagorinsky * scene.spacing) ** 2 if scene.numerics.turbulence == "smagorinsky" else 0.0
        self.dynamic = None
        if scene.numerics.turbulence == "dynamic":
            from fsi.fluid.eddies import DynamicEddies

            self.dynamic = DynamicEddies(scene, lanes, dtype, team)
        self.laws = np.array([(liquid.density * eddy, *law(liquid)) for liquid in scene.all_liquids])
        self._buoyant = np.array([buoyant_density(scene, q) for q in range(len(scene.all_liquids))])
        self.granular = bool(self._buoyant.any())
        self.eddy, self.decay = eddy, decay_rate(scene)
        self.rate = np.empty(0, dtype)
        self.sweeps = 1
        dense = len({liquid.density for liquid in scene.all_liquids}) > 1
        self.pairs = None
        if by_pairs(scene):
            from fsi.fluid.pair_laws import PairLaws

            self.pairs = PairLaws(dim, self.no_slip, lanes, dtype, team)
        keep = "gradient" if self.pairs else "strain" if self.dynamic else ""
        self._shear = viscosity.make_shear(lanes, dim, self.no_slip, keep) if self.shears else None
        self._viscosity = viscosity.make_viscosity(lanes, dim, self.no_slip, dense, implicit, self.pairs is not None)
        self._mirror = viscosity.make_mirror(lanes, dim) if implicit and self.no_slip else None
        self._push = viscosity.make_push(lanes, dim, dense) if implicit else None
        self.drag, self._grip = walls.make_drag(lanes, dim, varies=True), viscosity.make_grip(lanes, dim)
        self._nothing = np.empty((0, dim), dtype)
        self._twin = np.empty((0, self.columns), dtype)

    def set_viscosity(self, near, flow, kind, k, halo) -> None:
        """Viscosity [Pa s] of the fluid's rows in `flow`, for the liquid `kind` (n,) of each."""
        n, MU = len(kind), 2 * self.scene.dimension
        if self.shears:
            self.rate = np.empty(n, self.dtype)
            confined = self._confinement(flow[:n], kind, k)
            special = self.dynamic or self.pairs
            kept = special.reserve(len(flow)) if special else self._nothing
            self.team.run(self._shear, near.bounds, near.groups, flow, kind, confined, self.laws, self.rate, kept, k)
            if self.dynamic:
                self.dynamic.add(near, flow, kind, k, halo)
            if self.pairs:
                self.pairs.weigh(near, flow, self.laws, k, halo)
        else:
            flow[:n, MU] = self.laws[kind, 1]
        halo.refresh(flow, slice(MU, MU + 1))

    def _confinement(self, flow, kind, k) -> np.ndarray:
        """Confining pressure (n,) [Pa] of granular liquids: the weight of what stands above within the liquid, less what its
        pores carry; empty where no liquid is granular."""
        if not self.granular:
            return np.empty(0)
        scene, dim = self.scene, self.scene.dimension
        volume = float(k.mass) / (scene.fluid.density * (scene.tank.width if dim == 2 else 1.0))
        pressure = np.zeros(len(flow))
        for q in np.flatnonzero(self._buoyant):
            mine = kind == q
            above = height_above(flow[mine, :dim].astype(float), scene.spacing, volume)
            pressure[mine] = self._buoyant[q] * scene.gravity * above
        return pressure

    def resist(self, near, flow, trial, velocity, k, dt) -> None:
        """Explicit: velocity (n, dim) and the trial velocities gain dt A(u), u the velocities in `flow`."""
        self.team.run(
            self._viscosity, near.bounds, near.groups, flow, trial, velocity, self._nothing, self._nothing,
            self._weights, k,
            self.dtype(dt), self.dtype(1), self.dtype(0),
        )  # fmt: skip

    def solve(self, near, boundary_near, flow, trial, velocity, walls, k, dt, halo) -> np.ndarray:
        """Implicit: velocity (n, dim) gains dt A(u) of the solution u of u = velocity + dt (A(u) + B), B the acceleration
        by the pressures in `trial`; the fluid's rows of `flow`, which is returned, become u. Without the last step's
        pressure in the equation, viscosity would hold up part of the weight (van Kan 1986). `boundary_near`: neighbours of the
        boundary, None without one; `walls` (sum W (b, .), velocity (b, dim))."""
        n, dim = velocity.shape
        U = slice(dim, 2 * dim)
        push = np.zeros((n, dim), self.dtype)
        self.team.run(self._push, near.bounds, near.groups, trial, push, k)
        velocity += dt * push
        now = flow
        flow[:n, U] = velocity
        if len(self._twin) != len(flow):
            self._twin = np.empty_like(flow)
        new = self._twin
        halo.refresh(flow, U)
        new[:] = flow
        change, before = np.zeros((2, n, dim), self.dtype)
        span = 1 + dt * self.decay
        self.sweeps = viscous_sweeps(span)
        for alpha, beta in chebyshev(self.sweeps, span).weights:
            self._reflect(boundary_near, now, n, walls, k)
            self.team.run(
                self._viscosity, near.bounds, near.groups, now, new, velocity, change, before, self._weights, k, self.dtype(dt),
                self.dtype(alpha * HIGHEST / span), self.dtype(beta),
            )  # fmt: skip
            halo.refresh(new, U)
            now, new, change, before = new, now, before, change
        self._reflect(boundary_near, now, n, walls, k)
        velocity += change - dt * push
        self._twin = new
        return now

    @property
    def _weights(self) -> np.ndarray:
        return self.pairs.weights if self.pairs else np.empty(0, self.dtype)

    def grip(self, boundary_near, flow, first: int, b: int, k) -> np.ndarray:
        """Growth (b,) [N s/m] of the viscous force on each boundary particle with its velocity."""
        grip = np.zeros(b)
        self.team.run(self._grip, boundary_near.bounds, boundary_near.groups, first, flow, grip, k)
        return grip

    def _reflect(self, boundary_near, flow, first, walls, k) -> None:
        if self._mirror and boundary_near is not None:
            self.team.run(self._mirror, boundary_near.bounds, boundary_near.groups, first, flow, *walls, k)

    def fields(self, flow, n: int) -> dict[str, np.ndarray]:
        """Fields of the fluid particles for the recorders: `viscosity` [Pa s], `eddy_viscosity` [m2/s] (n,)."""
        own = self.pairs and len(self.pairs.known) >= n
        fields = {"viscosity": self.pairs.viscosity(n) if own else flow[:n, 2 * self.scene.dimension]}
        if self.eddy:
            fields["eddy_viscosity"] = self.eddy * self.rate
        if self.dynamic:
            fields["eddy_viscosity"] = self.dynamic.viscosity(self.rate)
        return fields

    def state(self) -> dict:
        """What is remembered between steps; the fields of the last one are in that of the fluid."""
        return {"sweeps": self.sweeps}

    def restore(self, state: dict) -> None:
        self.sweeps = int(state["sweeps"])

    @property
    def nbytes(self) -> int:
        return self._twin.nbytes + self.rate.nbytes + sum(part.nbytes for part in (self.dynamic, self.pairs) if part)
