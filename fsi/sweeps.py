"""Sweeps over the neighbours of the fluid, composed from the pair terms a scene needs and compiled for exactly those.

Packed rows, fluid first and boundary after (DIM components a vector): `flow` [x, u], `trial` [x, p, u*], `field` [x, p].
Between liquids of unequal density (`dense`) they also hold r, the density over the first liquid's and 0 for walls, in the
column 2 DIM + 1 of `flow` and `trial` and after the pressures of `field`. Where particles are shifted along a surface,
column 2 DIM + 2 of `trial` holds how full their support is.
Sums over a group's list run in vector lanes; what follows for each particle is plain scalar code. A factory returns the
kernel for its arguments; a term that is switched off there is not compiled.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from fsi.compiled import helper
from fsi.compiled import kernel as compiled
from fsi.lanes import at, claim, dot, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.terms import (
    artificial_viscosity,
    closeness,
    divergence,
    kernel,
    laplacian_weight,
    lightness,
    partner,
    slope,
    viscous,
)


class Constants(NamedTuple):
    """Scalars of the scheme, in the precision of the sweeps; the symbols are those of `fsi.terms`."""

    inverse_support: float  # 1 / (2 h)
    eta2: float  # (0.1 h)^2
    density_factor: float  # alpha / (sum W on the lattice): sums of `kernel` to rho / rho_lattice
    divergence_factor: float  # C V
    laplacian_factor: float  # 2 C m / rho^2
    gradient_factor: float  # C m / rho^2
    viscous_factor: float  # 2 nu C V over the lattice's second moment
    stress_factor: float  # 2 C V / rho over the lattice's second moment
    artificial_factor: float  # alpha c h C V
    lattice_laplacian: float  # sum a_ij on the lattice
    surface_factor: float  # weight of the missing part of the support at the free surface
    relaxation: float  # gamma
    suction: float  # share of gamma where the density is too small, see `Fluid.begin`
    density: float
    mass: float
    shifting: float  # beta h^2 C V of the shift
    guard_level: float  # crowding by wall particles that the guard allows
    guard_reach2: float  # 1 / R^2 of that crowding
    guard_piece: float  # length of way that it follows at a time
    guard2: float  # squared distance within which it looks


# Columns of the coefficients of the pressure equation, one row a fluid particle.
DIAGONAL, DEFICIT, SOURCE, INNER, SUPPORT = 0, 1, 2, 3, 4


@register_jitable
def surface_gate(position_divergence):
    """1 at the free surface, 0 inside, from div r / dim: below 0.78 and above 0.88."""
    return min(1.0, max(0.0, (0.88 - position_divergence) / 0.1))


@cache
def make_predictor(lanes: int, dim: int, viscosity: str, artificial: bool, shifted: bool, dense: bool, surface: bool):
    """Viscosity and gravity (`fall`) turn `velocity` into the trial velocity u*; the same pass collects the coefficients
    of the pressure equation: the diagonal, with the missing support of the free surface as particles at p = 0, and the
    deficit of the density against the lattice's. `viscosity`: "none", "no_slip" where walls drag, "free_slip". Without a
    `surface` a gap between particles is no free surface, and the shift closes it."""
    L, DIM = lanes, dim
    U, R, FULL = dim + 1, 2 * dim + 1, 2 * dim + 2
    no_slip, free_slip = viscosity == "no_slip", viscosity == "free_slip"

    @compiled(lanes, dim, viscosity, artificial, shifted, dense, surface)
    def predict(counter, bounds, groups, flow, trial, velocity, coefficients, fall, k, dt):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((4 + DIM) * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(flow, s, 0, L, DIM)
                if no_slip or free_slip or artificial:
                    u_i = own_vector(flow, s, DIM, L, DIM)
                weight, density, spread = zero(flow, L), zero(flow, L), zero(flow, L)
                force = zero_vector(flow, L, DIM)
                if dense:
                    r_i, linked = own(flow, s, R, L), zero(flow, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    t = closeness(r2, k.inverse_support)
                    f = slope(t)
                    a = laplacian_weight(f, r2, k.eta2)
                    weight = weight + a
                    if dense:
                        linked = linked + a * lightness(r_i, partner(r_i, other(flow, j, R, L)))
                    density = density + kernel(t)
                    spread = spread + f * r2
                    if no_slip:
                        force = force + viscous(a, u_i - other_vector(flow, j, DIM, L, DIM)) * k.viscous_factor
                if artificial or free_slip:
                    for n in range(base + span[g, 0], base + span[g, 1]):
                        j = at(lst, n)
                        x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                        u_ij = u_i - other_vector(flow, j, DIM, L, DIM)
                        r2 = dot(x_ij, x_ij)
                        f = slope(closeness(r2, k.inverse_support))
                        if artificial:
                            damping = artificial_viscosity(f, r2, k.eta2, u_ij, x_ij) * k.artificial_factor
                            if dense:
                                r_j = other(flow, j, R, L)
                                damping = damping * (r_j * lightness(r_i, r_j))
                            force = force + damping
                        if free_slip:
                            force = force + viscous(laplacian_weight(f, r2, k.eta2), u_ij) * k.viscous_factor
                store(t_, 0, weight)
                store(t_, L, density)
                store(t_, 2 * L, spread)
                store(t_, 3 * L, force)
                if dense:
                    store(t_, (3 + DIM) * L, linked)
                for i in range(s, e):
                    m = i - s
                    a_ii = k.laplacian_factor * t_[m]
                    filled = k.divergence_factor * t_[2 * L + m] / DIM
                    gate = surface_gate(filled) if surface else 0.0
                    missing = max(0.0, k.lattice_laplacian - a_ii)
                    deficit = 1.0 - k.density_factor * t_[L + m]
                    if dense:
                        a_ii, missing = k.laplacian_factor * t_[(3 + DIM) * L + m], missing / flow[i, R]
                    coefficients[i, DIAGONAL] = a_ii + k.surface_factor * gate * missing
                    coefficients[i, INNER] = 1.0 - gate
                    coefficients[i, DEFICIT] = min(deficit, 0.0) + k.suction * (1.0 - gate) * max(deficit, 0.0)
                    if shifted:
                        inside = min(1.0, max(0.0, (filled - 0.93) / 0.04)) if surface else 1.0
                        coefficients[i, SUPPORT] = inside
                        if surface:
                            trial[i, FULL] = filled
                    for d in range(DIM):
                        velocity[i, d] += dt * (fall[d] - t_[(3 + d) * L + m])
                        trial[i, U + d] = velocity[i, d]

    return predict


@cache
def make_source(lanes: int, dim: int, dense: bool):
    """The source of the pressure equation, div u*/dt + gamma (1 - rho/rho_lattice)/dt^2, and its first sweep, from the
    pressures of `trial` into `field`: p + alpha (J(p) - p), J(p) = (sum a_ij p_j - s_i) / a_ii (`fsi.pressure`). `before`,
    which may be `field`, keeps p for the next sweep."""
    L, DIM = lanes, dim
    P, U, R = dim, dim + 1, 2 * dim + 1

    @compiled(lanes, dim, dense)
    def source(counter, bounds, groups, trial, field, before, coefficients, k, dt, alpha):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(2 * L, trial.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, u_i = own_vector(trial, s, 0, L, DIM), own_vector(trial, s, U, L, DIM)
                outflow, pull = zero(trial, L), zero(trial, L)
                if dense:
                    r_i = own(trial, s, R, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(trial, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    f = slope(closeness(r2, k.inverse_support))
                    a, out = (
                        laplacian_weight(f, r2, k.eta2),
                        divergence(f, u_i - other_vector(trial, j, U, L, DIM), x_ij),
                    )
                    if dense:
                        r_j = partner(r_i, other(trial, j, R, L))
                        a, out = a * lightness(r_i, r_j), out * (r_j * lightness(r_i, r_j))
                    outflow = outflow + out
                    pull = pull + a * other(trial, j, P, L)
                store(t_, 0, outflow)
                store(t_, L, pull)
                for i in range(s, e):
                    m = i - s
                    s_i = k.divergence_factor * t_[m] / dt + k.relaxation * coefficients[i, DEFICIT] / (dt * dt)
                    coefficients[i, SOURCE] = s_i
                    p, jacobi = trial[i, P], (k.laplacian_factor * t_[L + m] - s_i) / coefficients[i, DIAGONAL]
                    inner = coefficients[i, INNER]
                    before[i, P] = p
                    field[i, P] = p + (1.0 + inner * (alpha - 1.0)) * (jacobi - p)

    return source


@cache
def make_weight(lanes: int, dim: int, dense: bool):
    """The weight of a neighbour's pressure, a_ij over `laplacian_factor`, for rows of `field`."""
    L, DIM, R = lanes, dim, dim + 1

    @helper(lanes, dim, dense)
    def weight(field, x_i, r_i, j, k):
        x_ij = x_i - other_vector(field, j, 0, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        if dense:
            a = a * lightness(r_i, partner(r_i, other(field, j, R, L)))
        return a

    return weight


@cache
def make_sweep(lanes: int, dim: int, dense: bool, columns: int = 0):
    """One more sweep, from the pressures of `field` into `new`, which holds those before: p + alpha (J(p) - p) +
    beta (p - p_before) inside, plain J(p) at the free surface and in spray. With `columns` the responses in `echo` (n, m)
    are taken along into `new_echo`, in the groups that touch the box `low` to `high` (`fsi.echo`); they have no source."""
    L, DIM, M = lanes, dim, columns
    P, R = dim, dim + 1
    weight = make_weight(lanes, dim, dense)

    @compiled(lanes, dim, dense, columns)
    def sweep(counter, bounds, groups, field, new, coefficients, k, alpha, beta, echo, new_echo, low, high):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((1 + M) * L, field.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, pull = own_vector(field, s, 0, L, DIM), zero(field, L)
                r_i = own(field, s, R, L) if dense else zero(field, L)
                reached = touches(field, s, e, low, high, 1.0 / k.inverse_support) if M > 0 else False
                if reached:
                    pulls = zero_vector(field, L, M)
                    for n in range(base + span[g, 0], base + span[g, 2]):
                        j = at(lst, n)
                        a = weight(field, x_i, r_i, j, k)
                        pull = pull + a * other(field, j, P, L)
                        pulls = pulls + a * other_vector(echo, j, 0, L, M)
                    store(t_, L, pulls)
                else:
                    for n in range(base + span[g, 0], base + span[g, 2]):
                        j = at(lst, n)
                        pull = pull + weight(field, x_i, r_i, j, k) * other(field, j, P, L)
                store(t_, 0, pull)
                for i in range(s, e):
                    jacobi = (k.laplacian_factor * t_[i - s] - coefficients[i, SOURCE]) / coefficients[i, DIAGONAL]
                    p = field[i, P]
                    inner = coefficients[i, INNER]
                    step = 1.0 + inner * (alpha - 1.0)
                    new[i, P] = p + step * (jacobi - p) + inner * beta * (p - new[i, P])
                    if reached:
                        for m in range(M):
                            q, jacobi = (
                                echo[i, m],
                                k.laplacian_factor * t_[(1 + m) * L + i - s] / coefficients[i, DIAGONAL],
                            )
                            new_echo[i, m] = q + step * (jacobi - q) + inner * beta * (q - new_echo[i, m])

    return sweep


@cache
def make_onset(lanes: int, dim: int, dense: bool, columns: int):
    """The first sweep of the responses, in which only the boundary acts, into the fluid's rows of `echo` (n, m)."""
    L, DIM, M, R = lanes, dim, columns, dim + 1
    weight = make_weight(lanes, dim, dense)

    @compiled(lanes, dim, dense, columns)
    def onset(counter, bounds, groups, field, coefficients, k, alpha, echo, low, high):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(M * L, field.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if span[g, 1] == span[g, 2] or not touches(field, s, e, low, high, 1.0 / k.inverse_support):
                    continue
                x_i, pulls = own_vector(field, s, 0, L, DIM), zero_vector(field, L, M)
                r_i = own(field, s, R, L) if dense else zero(field, L)
                for n in range(base + span[g, 1], base + span[g, 2]):
                    j = at(lst, n)
                    pulls = pulls + weight(field, x_i, r_i, j, k) * other_vector(echo, j, 0, L, M)
                store(t_, 0, pulls)
                for i in range(s, e):
                    step = 1.0 + coefficients[i, INNER] * (alpha - 1.0)
                    for m in range(M):
                        echo[i, m] = step * k.laplacian_factor * t_[m * L + i - s] / coefficients[i, DIAGONAL]

    return onset


@register_jitable
def touches(field, s, e, low, high, margin):
    """True where one of the rows s to e lies in the box. They are in the order of cells, no longer than `margin` along x, so
    that their ends tell most groups."""
    if field[e - 1, 0] < low[0] - margin or field[s, 0] > high[0] + margin:
        return False
    for i in range(s, e):
        inside = True
        for d in range(low.size):
            inside &= low[d] <= field[i, d] <= high[d]
        if inside:
            return True
    return False
