"""The sums over pairs of implicit incompressible SPH (Ihmsen et al. 2014), with walls whose particles count by weights
(Akinci et al. 2012).

Densities are relative to that of a perfect lattice; V is the volume of a particle on it, and psi_b the volume that boundary
particle b stands for, over V. With u* the velocities before pressure acts,

    rho*_i = 1 + gamma (rho_i - 1) - dt V [sum_j C f (u*_i - u*_j) . x_ij + sum_b psi_b C f (u*_i - u_b) . x_ib]   (source)
    a_i    = V / rho_0 [sum_j (p_i + p_j) C f x_ij + sum_b psi_b (p_i + p_ib) C f x_ib]                              (push)
    rho_i  = rho*_i - dt^2 V [sum_j C f (a_i - a_j) . x_ij + sum_b psi_b C f a_i . x_ib] = 1                        (relax)

as grad W_ij = -C f x_ij. The last is solved for p by relaxed Jacobi sweeps p_i += omega (1 - rho_i) / a_ii, p_i >= 0, with

    a_ii = -dt^2 V^2 / rho_0 [(L_i + 2 M_i) . (L_i + M_i) + sum_j (C f)^2 r^2],
    L_i = sum_j C f x_ij,  M_i = sum_b psi_b C f x_ib.

gamma = 1 is the scheme of the source. Below, gamma is the share of the error of the density that a step takes away, of what is
too dense alone, and the divergence of the velocities is most of the source: a free surface, whose density is too small, is
then not pulled together, and what little the density is off makes no pressure that the next step has to undo.

p_ib is the pressure at a wall particle as fluid particle i sees it: its own, extended hydrostatically, p_i - rho_0 g . x_ib
(`pair_pressure`; Akinci et al. 2012 take p_ib = 0). A lattice at rest on a layer is then in equilibrium.

No matrix is stored; an iteration is a `push` and a `relax`. Forces take the density rho_0, which the solution keeps to its
tolerance.

Rows are those of `fsi.sph.columns`; psi stands in the rows of the boundary, where the fluid's have `mu` (flow) and `p`.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from fsi.compute.jit import helper
from fsi.compute.lane_sums import plus
from fsi.compute.lanes import component, dot, maximum, minimum, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import FLUID, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.advance import make_advance
from fsi.sph.columns import DEFICIT, DIAGONAL, INNER, SOURCE
from fsi.sph.shapes import functions
from fsi.sph.terms import artificial_viscosity, closeness, divergence, pressure_gradient

MIRROR = 2.0  # pressures of a pair that change with that of the fluid particle, at a wall particle
LIMIT = 2.0  # times its pressure, by which the wall particle's may be higher
RAW = INNER  # the column of 1 - rho, whose part below zero alone stands in DEFICIT


class Scalars(NamedTuple):
    """Scalars of the scheme, in the precision of the sweeps: as in `columns.Constants` where they have the same name."""

    inverse_support: float
    eta2: float
    density_factor: float  # alpha V: sums of the kernel to rho / rho_lattice
    divergence_factor: float  # C V
    gradient_factor: float  # C V / rho_0
    diagonal_factor: float  # (C V)^2 / rho_0
    artificial_factor: float  # alpha c h C V
    friction_factor: float  # sigma c h C V / 2, of walls
    omega: float  # relaxation of a sweep
    head_x: float  # rho_0 times the body force: the gradient of the pressure in water at rest
    head_y: float
    head_z: float
    relaxation: float  # gamma: share of the error of the density that a step takes away
    room: float  # lack of density beyond which a particle may be approached; 0 for the source's scheme
    density: float
    mass: float
    suction: float  # not used
    draw: float  # not used
    guard_level: float
    guard_reach2: float
    guard_piece: float
    guard2: float


@cache
def make_predictor(lanes: int, dim: int, kernel: str, artificial: bool, friction: bool):
    """Viscosity and gravity turn `velocity` into u*; the same pass collects density and diagonal."""
    L, DIM = lanes, dim
    X, U, PSI = columns.flow(dim).of("x u mu")
    (U_NEW,) = columns.trial(dim).of("u")
    value, slope = functions(kernel)

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        none = zero_vector(flow, L, DIM)
        return zero(flow, L), none, zero(flow, L), none, none

    def pair(sums, mine, j, flow, k):
        (density, lever, square, force, solid), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        t = closeness(r2, k.inverse_support)
        f = slope(t)
        if artificial:
            u_ij = u_i - other_vector(flow, j, U, L, DIM)
            force = plus(force, artificial_viscosity(f, r2, k.eta2, dot(u_ij, x_ij), x_ij) * k.artificial_factor)
        return plus(density, value(t)), plus(lever, x_ij * f), plus(square, f * f * r2), force, solid

    def wall_pair(sums, mine, j, flow, k):
        (density, lever, square, force, solid), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        t, psi = closeness(r2, k.inverse_support), other(flow, j, PSI, L)
        f = slope(t) * psi
        if friction:
            u_ij = u_i - other_vector(flow, j, U, L, DIM)
            force = plus(force, artificial_viscosity(f, r2, k.eta2, dot(u_ij, x_ij), x_ij) * k.friction_factor)
        return plus(density, value(t) * psi), lever, square, force, plus(solid, x_ij * f)

    def finish(i, sums, trial, velocity, coefficients, body_force, k, dt):
        density, lever, square, force, solid = sums
        raw, length2 = 1.0 - k.density_factor * density, square
        for d in range(DIM):
            length2 += (lever[d] + MIRROR * solid[d]) * (lever[d] + solid[d])
            velocity[i, d] += dt * (body_force[d] - force[d])
            trial[i, U_NEW + d] = velocity[i, d]
        coefficients[i, DIAGONAL] = -k.diagonal_factor * length2
        coefficients[i, RAW] = raw
        coefficients[i, DEFICIT] = min(raw, 0.0)

    return over_pairs(
        "implicit_predict", (lanes, dim, kernel, artificial, friction),
        takes="flow strains trial velocity coefficients body_force k dt",  # as `fsi.sph.predictor`, without a use for strains
        sum=Sum(hold, empty, ((FLUID, pair), (WALLS, wall_pair)), finish),
    )  # fmt: skip


@cache
def make_source(lanes: int, dim: int, kernel: str):
    """The source 1 - rho* of the pressure equation, and the pressures that the sweeps start from: the last step's times
    `start`."""
    L, DIM = lanes, dim
    X, P, U = columns.trial(dim).of("x p u")
    _, slope = functions(kernel)

    def hold(s, trial):
        return own_vector(trial, s, X, L, DIM), own_vector(trial, s, U, L, DIM)

    def empty(trial):
        return (zero(trial, L),)

    def pair(sums, mine, j, trial, k):
        (outflow,), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(trial, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(outflow, divergence(f, u_i - other_vector(trial, j, U, L, DIM), x_ij)),)

    def wall_pair(sums, mine, j, trial, k):
        (outflow,), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(trial, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support)) * other(trial, j, P, L)
        return (plus(outflow, divergence(f, u_i - other_vector(trial, j, U, L, DIM), x_ij)),)

    def finish(i, sums, trial, field, coefficients, k, dt, start):
        error = k.relaxation * coefficients[i, DEFICIT] + max(0.0, coefficients[i, RAW] - k.room)
        coefficients[i, SOURCE] = error + dt * k.divergence_factor * sums[0]
        field[i, P] = start * trial[i, P]

    return over_pairs(
        "implicit_source", (lanes, dim, kernel), takes="trial field coefficients k dt start",
        sum=Sum(hold, empty, ((FLUID, pair), (WALLS, wall_pair)), finish),
    )  # fmt: skip


@helper()
def pair_pressure(p, rise):
    """Sum of the pressure p of a fluid particle and that of a wall particle, which is higher by `rise`; between 1 and
    `MIRROR` + `LIMIT` times p, so that what has no pressure is pushed by no wall."""
    return MIRROR * p + maximum(minimum(rise, LIMIT * p), 0.0 - p)


@cache
def make_pressing(dim: int, linear: bool):
    """`pressing(p, x_ij, k)`: `pair_pressure` of fluid particle i, x_ij from wall particle j; `linear`: its change with p."""
    DIM, Z = dim, dim - 1

    @helper(dim, linear, inline=True)
    def pressing(p, x_ij, k):
        if linear:
            return MIRROR * p
        rise = component(x_ij, 0) * k.head_x + component(x_ij, Z) * k.head_z
        if DIM == 3:
            rise = rise + component(x_ij, 1) * k.head_y
        return pair_pressure(p, 0.0 - rise)

    return pressing


@cache
def make_push(lanes: int, dim: int, kernel: str, linear: bool = False):
    """The accelerations by the pressures in `field`, into `pushed`, rows of x and a; `linear`: by changes of the pressure."""
    DIM, A = dim, columns.flow(dim).u
    hold, empty, pair, wall_pair = _gradient(lanes, dim, kernel, linear)

    def finish(i, sums, pushed, k):
        for d in range(DIM):
            pushed[i, A + d] = k.gradient_factor * sums[0][d]

    return over_pairs(
        "implicit_push", (lanes, dim, kernel, linear), takes="field pushed k",
        sum=Sum(hold, empty, ((FLUID, pair), (WALLS, wall_pair)), finish),
    )  # fmt: skip


def _gradient(lanes: int, dim: int, kernel: str, linear: bool):
    """hold, empty, pair and wall_pair of the acceleration by pressure over C V / rho_0."""
    L, DIM = lanes, dim
    pressing = make_pressing(dim, linear)
    X, P = columns.field(dim).of("x p")
    _, slope = functions(kernel)

    def hold(s, field):
        return own_vector(field, s, X, L, DIM), own(field, s, P, L)

    def empty(field):
        return (zero_vector(field, L, DIM),)

    def pair(sums, mine, j, field, k):
        x_i, p_i = mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(sums[0], pressure_gradient(f, p_i, other(field, j, P, L), x_ij)),)

    def wall_pair(sums, mine, j, field, k):
        x_i, p_i = mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(sums[0], x_ij * (f * other(field, j, P, L) * pressing(p_i, x_ij, k))),)

    return hold, empty, pair, wall_pair


@cache
def make_relax(lanes: int, dim: int, kernel: str, linear: bool = False):
    """The density that the accelerations in `pushed` lead to, and the pressures in `field` a sweep further on. The density in
    excess of 1 of the particles that are no ghosts, or what the sweep found left of the equation, is summed up in `excess`
    (chunks,).

    `linear`: for the response to a change of the source, which stands in `source` (n,); the pressures in `field` that are
    zero in `held` stay so."""
    L, DIM = lanes, dim
    X, A, PSI = columns.flow(dim).of("x u mu")
    (P,) = columns.field(dim).of("p")
    _, slope = functions(kernel)

    def start(chunk, excess):
        excess[chunk] = 0.0

    def hold(s, pushed):
        return own_vector(pushed, s, X, L, DIM), own_vector(pushed, s, A, L, DIM)

    def empty(pushed):
        return (zero(pushed, L),)

    def pair(sums, mine, j, pushed, k):
        x_i, a_i = mine
        x_ij = x_i - other_vector(pushed, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(sums[0], divergence(f, a_i - other_vector(pushed, j, A, L, DIM), x_ij)),)

    def wall_pair(sums, mine, j, pushed, k):
        x_i, a_i = mine
        x_ij = x_i - other_vector(pushed, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support)) * other(pushed, j, PSI, L)
        return (plus(sums[0], divergence(f, a_i, x_ij)),)

    def finish(i, sums, chunk, field, coefficients, label, excess, k, dt):
        a_ii, before = dt * dt * coefficients[i, DIAGONAL], field[i, P]
        missing = coefficients[i, SOURCE] + dt * dt * k.divergence_factor * sums[0]
        field[i, P] = max(0.0, before + k.omega * missing / a_ii) if a_ii < 0.0 else 0.0
        if label[i] >= 0:
            excess[chunk] += max(0.0, -missing) if k.room == 0.0 else abs((field[i, P] - before) * a_ii) / k.omega

    def finish_linear(i, sums, chunk, field, coefficients, label, excess, k, dt, source, held):
        a_ii = dt * dt * coefficients[i, DIAGONAL]
        missing = source[i] + dt * dt * k.divergence_factor * sums[0]
        field[i, P] = field[i, P] + k.omega * missing / a_ii if a_ii < 0.0 and held[i, P] > 0.0 else 0.0

    return over_pairs(
        "implicit_relax", (lanes, dim, kernel, linear), start=start,
        takes="pushed field coefficients label excess k dt source held",
        sum=Sum(hold, empty, ((FLUID, pair), (WALLS, wall_pair)), finish_linear if linear else finish),
    )  # fmt: skip


@cache
def make_change(lanes: int, dim: int, kernel: str):
    """The change of the source in `source` (n,) when the boundary moves with the velocities in `pushed` besides."""
    L, DIM = lanes, dim
    X, A, PSI = columns.flow(dim).of("x u mu")
    _, slope = functions(kernel)

    def hold(s, pushed):
        return own_vector(pushed, s, X, L, DIM)

    def empty(pushed):
        return (zero(pushed, L),)

    def pair(sums, x_i, j, pushed, k):
        x_ij = x_i - other_vector(pushed, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support)) * other(pushed, j, PSI, L)
        return (plus(sums[0], divergence(f, other_vector(pushed, j, A, L, DIM), x_ij)),)

    def finish(i, sums, source, k, dt):
        source[i] = -dt * k.divergence_factor * sums[0]

    return over_pairs(
        "implicit_change",
        (lanes, dim, kernel),
        takes="pushed source k dt",
        sum=Sum(hold, empty, ((WALLS, pair),), finish),
    )


@cache
def make_corrector(lanes: int, dim: int, kernel: str, guarded: bool, sponge: bool):
    """The pressure gives the new velocity, and that the new position; arguments as in `fsi.sph.corrector.make_corrector`."""
    L, DIM = lanes, dim
    X, P = columns.field(dim).of("x p")
    hold, pressing = _gradient(lanes, dim, kernel, linear=False)[0], make_pressing(dim, linear=False)

    def start(chunk, impulse, totals):
        impulse[chunk] = 0
        totals[chunk] = 0.0

    def empty(field, k):
        none = zero_vector(field, L, DIM)
        return none, none, none, zero(field, L) + k.guard2

    _, slope = functions(kernel)

    def pair(sums, mine, j, field, k):
        (force, none, nothing, nearest), (x_i, p_i) = sums, mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return plus(force, pressure_gradient(f, p_i, other(field, j, P, L), x_ij)), none, nothing, nearest

    def wall_pair(sums, mine, j, field, k):
        (force, none, nothing, nearest), (x_i, p_i) = sums, mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        f = slope(closeness(r2, k.inverse_support))
        push = f * other(field, j, P, L) * pressing(p_i, x_ij, k)
        return plus(force, x_ij * push), none, nothing, minimum(nearest, r2)

    return over_pairs(
        "implicit_correct", (lanes, dim, kernel, guarded, sponge), start=start,
        sum=Sum(hold, empty, ((FLUID, pair), (WALLS, wall_pair)), make_advance(dim, guarded, sponge, False, False, False)),
        takes="trial field coefficients label position velocity pressure body_force k dt zones first boundary "
        "boundary_velocity owner centre impulse totals",
    )  # fmt: skip
