"""Sweeps of a viscosity that differs from particle to particle: shear rate, viscous forces, explicit or implicit.

Rows are those of `fsi.sph.columns`, with the viscosity [Pa s] in `flow`; how a sweep is made of its functions is told in
`fsi.compute.pairs`. A pair's viscosity is the harmonic mean of the two, so that the shear stress is continuous between
liquids; at a wall it is the fluid's. Pairs of a liquid with a law have that of their own shear rate (`fsi.sph.pair_laws`).
Where scenes hold one Newtonian liquid the predictor does all this (`fsi.sph.predictor`).
"""

from __future__ import annotations

import math
from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lane_sums import small_matrix
from fsi.compute.lanes import dot, load, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import ALL, FLUID, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.gradient import gradient_sums
from fsi.sph.laws import CROSS, HERSCHEL_BULKLEY
from fsi.sph.terms import (
    closeness,
    interface_gradient,
    kernel,
    laplacian_weight,
    mean_viscosity,
    partner,
    pressure_gradient,
    slope,
    viscous,
)

TINY = 1e-12  # shear rate [1/s] below which there is none
LEAST_FILLED = 0.85  # part of the support that counts as filled at the least where pairs share what is missing


@helper()
def shear_rate(gradient, S):
    """sqrt(2 S : S), and the strain rate S of a velocity gradient."""
    total = 0.0
    for a in range(gradient.shape[0]):
        for b in range(gradient.shape[0]):
            S[a, b] = 0.5 * (gradient[a, b] + gradient[b, a])
            total += 2.0 * S[a, b] * S[a, b]
    return math.sqrt(total)


@helper()
def apparent_viscosity(rate, pressure, law):
    """Viscosity [Pa s] at a shear rate [1/s] and, of grains, a confining pressure [Pa]; law: mu_0, mu_inf and the constants
    of `fsi.scene.rheology`."""
    highest, lowest, kind = law[1], law[2], law[3]
    if kind == CROSS:
        return lowest + (highest - lowest) / (1.0 + law[4] * rate)
    s = max(rate, TINY)
    if kind == HERSCHEL_BULKLEY:
        mu = law[4] * s ** (law[5] - 1.0) + law[6] * -math.expm1(-law[7] * s) / s
    else:
        friction = law[4] + (law[5] - law[4]) * s / (s + law[6] * math.sqrt(pressure))
        mu = friction * pressure / s
    return min(max(mu, lowest), highest)


@cache
def make_shear(lanes: int, dim: int, no_slip: bool, keep: str = ""):
    """Shear rate [1/s] of the fluid particles into `rate` (n,), and with it their viscosity into `flow`. It is exact where
    the velocity is linear in space, also at the surface and at free-slip walls; no-slip walls take part with their
    mirrored velocities, which halves the error of the curved profile at a wall. `kind` (n,): the
    liquid of each; `confined` (n,): confining pressure [Pa], empty where no law has one; `laws` (m, 8): the factor
    rho (C_s dr)^2 of the eddies and a law as in `apparent_viscosity`. `keep`: "strain", with the strain rates of
    `fsi.sph.eddies`, "gradient", with what `fsi.sph.pair_laws` needs of each particle, into `kept`."""
    DIM, Z = dim, dim - 1
    (MU,) = columns.flow(dim).of("mu")
    RATE = DIM * DIM  # after the rows of the tensor, as in `fsi.sph.eddies.strain`
    FILLED, OWN, CONFINED, KIND = columns.pair_law(dim).of("filled mu confined kind")

    hold, empty, pair, solve = gradient_sums(lanes, dim)

    def finish(i, sums, flow, kind, confined, laws, rate, kept, k):
        M, gradient, S = small_matrix(DIM, DIM), small_matrix(DIM, DIM), small_matrix(DIM, DIM)
        solve(sums, M, gradient, k)
        rate[i] = shear_rate(gradient, S)
        q = kind[i]
        pressure = confined[i] if confined.size else 0.0
        flow[i, MU] = apparent_viscosity(rate[i], pressure, laws[q]) + laws[q, 0] * rate[i]
        if keep:
            for a in range(DIM):
                for b in range(DIM):
                    kept[i, a * DIM + b] = S[a, b] if keep == "strain" else gradient[a, b]
            if keep == "strain":
                kept[i, RATE] = rate[i]
            else:
                kept[i, OWN], kept[i, CONFINED], kept[i, KIND] = flow[i, MU], pressure, q
                moment = M[0, 0] + M[Z, Z] + (M[1, 1] if DIM == 3 else 0.0)
                kept[i, FILLED] = max(LEAST_FILLED, moment / (DIM * k.filled4))  # 1 on a lattice

    return over_pairs(
        "shear", (lanes, dim, no_slip, keep), takes="flow kind confined laws rate kept k",
        sum=Sum(hold, empty, ((ALL if no_slip else FLUID, pair),), finish),
    )  # fmt: skip


@cache
def make_mirror(lanes: int, dim: int):
    """No slip: the velocity of a boundary row becomes 2 u_b - sum W u_j / sum W, as in `fsi.sph.walls.make_shepard`, for
    velocities that change within a step. `shepard` (b, 1 + DIM) as there, `velocity` (b, DIM) of the walls."""
    L, DIM = lanes, dim
    X, U = columns.flow(dim).of("x u")
    (TOTAL,) = columns.shepard(dim).of("total")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM)

    def empty(flow):
        return (zero_vector(flow, L, DIM),)

    def pair(sums, x_i, j, flow, k):
        (carried,) = sums
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (carried + other_vector(flow, j, U, L, DIM) * w,)

    def finish(i, sums, first, flow, shepard, velocity):
        (carried,), b = sums, i - first
        for d in range(DIM):
            if shepard[b, TOTAL] > 0.0:
                flow[i, U + d] = 2.0 * velocity[b, d] - carried[d] / shepard[b, TOTAL]

    return over_pairs(
        "mirror", (lanes, dim), takes="first flow shepard velocity k", sum=Sum(hold, empty, ((FLUID, pair),), finish)
    )


@cache
def make_viscosity(lanes: int, dim: int, no_slip: bool, dense: bool, implicit: bool, paired: bool = False):
    """Viscous acceleration A(u) of the velocities in `flow`. Explicit: `velocity` (n, DIM) and the trial velocity in
    `trial` gain dt A. Implicit: one Chebyshev sweep of change = dt A(velocity + change), from the velocities of `flow`
    into those of `trial`, which has the same columns; `change` and `before` (n, DIM) are those of the last two sweeps.
    `paired`: the weights of the fluid's pairs are those that `fsi.sph.pair_laws` left in `weights`."""
    L, DIM = lanes, dim
    X, U, MU, R = columns.flow(dim).of("x u mu r")
    (U_NEW,) = (columns.flow if implicit else columns.trial)(dim).of("u")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM), own(flow, s, MU, L)

    def empty(flow):
        return (zero_vector(flow, L, DIM),)

    def fluid_pair(sums, mine, j, flow, k):
        (stress,), (x_i, u_i, mu_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        mu = mean_viscosity(mu_i, other(flow, j, MU, L))
        return (stress + viscous(a * mu, u_i - other_vector(flow, j, U, L, DIM)),)

    def weighted_pair(sums, mine, j, n, flow, weights):
        (stress,), (_, u_i, _) = sums, mine
        return (stress + viscous(load(weights, n * L, L), u_i - other_vector(flow, j, U, L, DIM)),)

    def wall_pair(sums, mine, j, flow, k):
        (stress,), (x_i, u_i, mu_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        return (stress + viscous(a * mu_i, u_i - other_vector(flow, j, U, L, DIM)),)

    def finish(i, sums, flow, trial, velocity, change, before, k, dt, alpha, beta):
        (stress,), factor = sums, k.stress_factor
        if dense:
            factor = factor / flow[i, R]
        for d in range(DIM):
            gain = -dt * factor * stress[d]
            if implicit:
                last = change[i, d]
                now = last + alpha * (gain - last) + beta * (last - before[i, d])
                before[i, d] = now
                trial[i, U_NEW + d] = velocity[i, d] + now
            else:
                velocity[i, d] += gain
                trial[i, U_NEW + d] = velocity[i, d]

    inner = FLUID, weighted_pair if paired else fluid_pair
    return over_pairs(
        "resist", (lanes, dim, no_slip, dense, implicit, paired),
        takes="flow trial velocity change before weights k dt alpha beta",
        sum=Sum(hold, empty, (inner, (WALLS, wall_pair)) if no_slip else (inner,), finish),
    )  # fmt: skip


@cache
def make_push(lanes: int, dim: int, dense: bool):
    """Acceleration of the fluid by the pressures in `trial`, into `push` (n, DIM); as in `fsi.sph.corrector`."""
    L, DIM = lanes, dim
    X, P, R = columns.trial(dim).of("x p r")

    def hold(s, trial):
        r_i = own(trial, s, R, L) if dense else zero(trial, L)
        return own_vector(trial, s, X, L, DIM), own(trial, s, P, L), r_i

    def empty(trial):
        return (zero_vector(trial, L, DIM),)

    def pair(sums, mine, j, trial, k):
        (force,), (x_i, p_i, r_i) = sums, mine
        x_ij = x_i - other_vector(trial, j, X, L, DIM)
        f, p_j = slope(closeness(dot(x_ij, x_ij), k.inverse_support)), other(trial, j, P, L)
        if dense:
            r_j = partner(r_i, other(trial, j, R, L))
            return (force + interface_gradient(f, p_i, p_j, r_i, r_j, x_ij) / r_i,)
        return (force + pressure_gradient(f, p_i, p_j, x_ij),)

    def finish(i, sums, push, k):
        (force,) = sums
        for d in range(DIM):
            push[i, d] = k.gradient_factor * force[d]

    return over_pairs(
        "accelerate", (lanes, dim, dense), takes="trial push k", sum=Sum(hold, empty, ((ALL, pair),), finish)
    )


@cache
def make_grip(lanes: int, dim: int):
    """How much the viscous force on each boundary particle grows with its velocity, into `grip` (b,) [N s/m], for mirrored
    velocities and a fluid that stays as it is."""
    L, DIM = lanes, dim
    X, MU = columns.flow(dim).of("x mu")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM)

    def empty(flow):
        return (zero(flow, L),)

    def pair(sums, x_i, j, flow, k):
        (total,) = sums
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        return (total + a * other(flow, j, MU, L),)

    def finish(i, sums, first, grip, k):
        grip[i - first] = 2.0 * k.mass * k.stress_factor * sums[0]

    return over_pairs("hold", (lanes, dim), takes="first flow grip k", sum=Sum(hold, empty, ((FLUID, pair),), finish))
