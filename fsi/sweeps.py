"""Sweeps over the neighbours of the fluid, composed from the pair terms a scene needs and compiled for exactly those.

Packed rows, fluid first and boundary after (DIM components a vector): `flow` [x, u], `trial` [x, p, u*], `field` [x, p].
Sums over a group's list run in vector lanes; what follows for each particle is plain scalar code. A factory returns the
kernel for its arguments; a term that is switched off there is not compiled.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from fsi.compiled import helper
from fsi.compiled import kernel as compiled
from fsi.lanes import at, claim, dot, minimum, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.terms import (
    artificial_viscosity,
    closeness,
    divergence,
    kernel,
    laplacian_weight,
    pressure_gradient,
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
    artificial_factor: float  # alpha c h C V
    lattice_laplacian: float  # sum a_ij on the lattice
    surface_factor: float  # weight of the missing part of the support at the free surface
    relaxation: float  # gamma
    density: float
    mass: float
    shifting: float  # A h C V of the shift
    guard: float  # distance that the wall guard keeps
    guard2: float  # squared distance within which it looks


# Columns of the coefficients of the pressure equation, one row a fluid particle.
DIAGONAL, DEFICIT, SOURCE, INNER, SUPPORT = 0, 1, 2, 3, 4


@register_jitable
def surface_gate(position_divergence):
    """1 at the free surface, 0 inside, from div r / dim: below 0.78 and above 0.88."""
    return min(1.0, max(0.0, (0.88 - position_divergence) / 0.1))


@cache
def make_predictor(lanes: int, dim: int, viscosity: str, artificial: bool, shifted: bool):
    """Viscosity and gravity (`fall`) turn `velocity` into the trial velocity u*; the same pass collects the coefficients
    of the pressure equation: the diagonal, with the missing support of the free surface as particles at p = 0, and the
    deficit of the density against the lattice's. `viscosity`: "none", "no_slip" where walls drag, "free_slip"."""
    L, DIM = lanes, dim
    U = dim + 1
    no_slip, free_slip = viscosity == "no_slip", viscosity == "free_slip"

    @compiled(lanes, dim, viscosity, artificial, shifted)
    def predict(counter, bounds, groups, flow, trial, velocity, coefficients, fall, k, dt):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((3 + DIM) * L, flow.dtype)
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
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    t = closeness(r2, k.inverse_support)
                    f = slope(t)
                    a = laplacian_weight(f, r2, k.eta2)
                    weight = weight + a
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
                            force = force + artificial_viscosity(f, r2, k.eta2, u_ij, x_ij) * k.artificial_factor
                        if free_slip:
                            force = force + viscous(laplacian_weight(f, r2, k.eta2), u_ij) * k.viscous_factor
                store(t_, 0, weight)
                store(t_, L, density)
                store(t_, 2 * L, spread)
                store(t_, 3 * L, force)
                for i in range(s, e):
                    m = i - s
                    a_ii = k.laplacian_factor * t_[m]
                    filled = k.divergence_factor * t_[2 * L + m] / DIM
                    gate = surface_gate(filled)
                    missing = max(0.0, k.lattice_laplacian - a_ii)
                    deficit = 1.0 - k.density_factor * t_[L + m]
                    coefficients[i, DIAGONAL] = a_ii + k.surface_factor * gate * missing
                    coefficients[i, INNER] = 1.0 - gate
                    coefficients[i, DEFICIT] = min(deficit, 0.0) + (1.0 - gate) * max(deficit, 0.0)
                    if shifted:
                        coefficients[i, SUPPORT] = min(1.0, max(0.0, (filled - 0.93) / 0.04))
                    for d in range(DIM):
                        velocity[i, d] += dt * (fall[d] - t_[(3 + d) * L + m])
                        trial[i, U + d] = velocity[i, d]

    return predict


@cache
def make_source(lanes: int, dim: int):
    """The source of the pressure equation, div u*/dt + gamma (1 - rho/rho_lattice)/dt^2, and its first sweep, from the
    pressures of `trial` into `field`: p + alpha (J(p) - p), J(p) = (sum a_ij p_j - s_i) / a_ii (`fsi.pressure`)."""
    L, DIM = lanes, dim
    P, U = dim, dim + 1

    @compiled(lanes, dim)
    def source(counter, bounds, groups, trial, field, coefficients, k, dt, alpha):
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
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(trial, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    f = slope(closeness(r2, k.inverse_support))
                    outflow = outflow + divergence(f, u_i - other_vector(trial, j, U, L, DIM), x_ij)
                    pull = pull + laplacian_weight(f, r2, k.eta2) * other(trial, j, P, L)
                store(t_, 0, outflow)
                store(t_, L, pull)
                for i in range(s, e):
                    m = i - s
                    s_i = k.divergence_factor * t_[m] / dt + k.relaxation * coefficients[i, DEFICIT] / (dt * dt)
                    coefficients[i, SOURCE] = s_i
                    p, jacobi = trial[i, P], (k.laplacian_factor * t_[L + m] - s_i) / coefficients[i, DIAGONAL]
                    inner = coefficients[i, INNER]
                    field[i, P] = p + (1.0 + inner * (alpha - 1.0)) * (jacobi - p)

    return source


@cache
def make_sweep(lanes: int, dim: int):
    """One more sweep, from the pressures of `field` into `new`, which holds those before: p + alpha (J(p) - p) +
    beta (p - p_before) inside, plain J(p) at the free surface and in spray."""
    L, DIM = lanes, dim
    P = dim

    @compiled(lanes, dim)
    def sweep(counter, bounds, groups, field, new, coefficients, k, alpha, beta):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(L, field.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(field, s, 0, L, DIM)
                pull = zero(field, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(field, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    f = slope(closeness(r2, k.inverse_support))
                    pull = pull + laplacian_weight(f, r2, k.eta2) * other(field, j, P, L)
                store(t_, 0, pull)
                for i in range(s, e):
                    jacobi = (k.laplacian_factor * t_[i - s] - coefficients[i, SOURCE]) / coefficients[i, DIAGONAL]
                    p = field[i, P]
                    inner = coefficients[i, INNER]
                    new[i, P] = p + (1.0 + inner * (alpha - 1.0)) * (jacobi - p) + inner * beta * (p - new[i, P])

    return sweep


@cache
def make_echo(lanes: int, dim: int, columns: int):
    """The sweep without source, for the response of the pressure to motions of the boundary: several columns of
    pressures at once, in the groups that touch the box `low` to `high`."""
    L, DIM, M = lanes, dim, columns
    P = dim

    @compiled(lanes, dim, columns)
    def echo(counter, bounds, groups, field, new, coefficients, k, alpha, beta, low, high):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(M * L, field.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if not touches(field, s, e, low, high):
                    continue
                x_i = own_vector(field, s, 0, L, DIM)
                pull = zero_vector(field, L, M)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(field, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    f = slope(closeness(r2, k.inverse_support))
                    pull = pull + laplacian_weight(f, r2, k.eta2) * other_vector(field, j, P, L, M)
                store(t_, 0, pull)
                for i in range(s, e):
                    inner = coefficients[i, INNER]
                    for m in range(M):
                        p, jacobi = field[i, P + m], k.laplacian_factor * t_[m * L + i - s] / coefficients[i, DIAGONAL]
                        change = (1.0 + inner * (alpha - 1.0)) * (jacobi - p)
                        new[i, P + m] = p + change + inner * beta * (p - new[i, P + m])

    return echo


@register_jitable
def touches(field, s, e, low, high):
    """True where one of the rows s to e lies in the box."""
    for i in range(s, e):
        inside = True
        for d in range(low.size):
            inside &= low[d] <= field[i, d] <= high[d]
        if inside:
            return True
    return False


# Columns of the sums that the corrector leaves for each chunk.
SPEED2, ACCELERATION2, KINETIC, HEIGHT, VOLUME, GUARDED, MOMENTUM = 0, 1, 2, 3, 4, 5, 6


def sums_width(dim: int) -> int:
    """Columns: maxima of speed^2 and acceleration^2, then sums of kinetic energy, height, volume / dr^dim and guarded
    particles, then the momentum and the momentum lost in the sponge, component by component."""
    return MOMENTUM + 2 * dim


@cache
def make_corrector(lanes: int, dim: int, guarded: bool, sponge: bool, shifted: bool):
    """The pressure gradient gives the new velocity, and that the new position, x += dt u_new.

    The wall guard slows a fluid particle that would come closer to a wall particle than `guard` within the step; the
    impulse is handed to the owner of the wall particle in `impulse` (chunks, owners, 6), force part
    first, moment about `centre` (owners, DIM). In the sponge u' = -rate s^2 u, with s from 0 at the start to 1 at the end
    of each of the zones (z, 4) [axis, start, end, rate]."""
    L, DIM = lanes, dim
    P = dim

    @helper(dim)
    def guard(i, near, far, lst, position, velocity, first, boundary, boundary_velocity, owner, centre, k, dt, taken):
        """Slow particle i against the wall particles of its list; returns whether it was slowed."""
        stopped = False
        for n in range(near, far):
            b = lst[n] - first
            r2, approach = 0.0, 0.0
            for d in range(DIM):
                x = position[i, d] - boundary[b, d]
                r2 += x * x
                approach += x * (velocity[i, d] - boundary_velocity[b, d])
            if r2 < k.guard2:
                slowest = math.sqrt(r2) * min(0.0, k.guard - math.sqrt(r2)) / dt  # to stay off by `guard`
                if approach >= slowest:
                    continue
                stopped = True
                take_moment(i, b, (approach - slowest) / r2, position, velocity, boundary, owner, centre, k.mass, taken)
        return stopped

    @helper(dim)
    def take_moment(i, b, rate, position, velocity, boundary, owner, centre, mass, taken):
        o = owner[b]
        for d in range(DIM):
            change = -rate * (position[i, d] - boundary[b, d])
            velocity[i, d] += change
            impulse = -mass * change
            axis = 2 if d == DIM - 1 else d
            taken[o, axis] += impulse
            for a in range(DIM):  # moment = arm x impulse, in right-handed (x, y, z)
                arm = position[i, a] - centre[o, a]
                axis_a = 2 if a == DIM - 1 else a
                if axis_a != axis:
                    sign = 1.0 if (axis - axis_a) % 3 == 1 else -1.0
                    taken[o, 3 + 3 - axis - axis_a] += sign * arm * impulse

    @compiled(lanes, dim, guarded, sponge, shifted)
    def correct(
        counter, bounds, groups, trial, field, coefficients, label, position, velocity, pressure, fall, k, dt, zones,
        first, boundary, boundary_velocity, owner, centre, impulse, sums,
    ):  # fmt: skip
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((2 * DIM + 1) * L, field.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            impulse[c] = 0.0
            sums[c] = 0.0
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, p_i = own_vector(field, s, 0, L, DIM), own(field, s, P, L)
                force, sparse = zero_vector(field, L, DIM), zero_vector(field, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(field, j, 0, L, DIM)
                    f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    force = force + pressure_gradient(f, p_i, other(field, j, P, L), x_ij)
                    if shifted:
                        sparse = sparse + x_ij * f
                store(t_, 0, force)
                if shifted:
                    store(t_, (DIM + 1) * L, sparse)
                if guarded:
                    nearest = zero(field, L) + k.guard2
                    for n in range(base + span[g, 1], base + span[g, 2]):
                        x_ij = x_i - other_vector(field, at(lst, n), 0, L, DIM)
                        nearest = minimum(nearest, dot(x_ij, x_ij))
                    store(t_, DIM * L, nearest)
                for i in range(s, e):
                    if label[i] < 0:  # a ghost, dropped after this
                        continue
                    m = i - s
                    acceleration2, speed2 = 0.0, 0.0
                    for d in range(DIM):
                        velocity[i, d] += dt * k.gradient_factor * t_[d * L + m]
                        a = (velocity[i, d] - trial[i, P + 1 + d]) / dt + fall[d]
                        acceleration2 += a * a
                    if guarded and t_[DIM * L + m] < k.guard2:
                        sums[c, GUARDED] += guard(
                            i, base + span[g, 1], base + span[g, 2], lst, position, velocity,
                            first, boundary, boundary_velocity, owner, centre, k, dt, impulse[c],
                        )  # fmt: skip
                    if sponge:
                        for z in range(zones.shape[0]):
                            into = (position[i, int(zones[z, 0])] - zones[z, 1]) / (zones[z, 2] - zones[z, 1])
                            if 0.0 < into <= 1.0:
                                kept = 1.0 / (1.0 + dt * zones[z, 3] * into * into)
                                for d in range(DIM):
                                    sums[c, MOMENTUM + DIM + d] += k.mass * (1.0 - kept) * velocity[i, d]
                                    velocity[i, d] *= kept
                    for d in range(DIM):
                        speed2 += velocity[i, d] * velocity[i, d]
                        position[i, d] += dt * velocity[i, d]
                    if shifted:
                        reach = dt * k.shifting * math.sqrt(speed2) * coefficients[i, SUPPORT]
                        for d in range(DIM):
                            position[i, d] += reach * t_[(DIM + 1 + d) * L + m]
                    for d in range(DIM):
                        sums[c, MOMENTUM + d] += k.mass * velocity[i, d]
                    pressure[i] = field[i, P]
                    sums[c, SPEED2] = max(sums[c, SPEED2], speed2)
                    sums[c, ACCELERATION2] = max(sums[c, ACCELERATION2], acceleration2)
                    sums[c, KINETIC] += 0.5 * k.mass * speed2
                    sums[c, HEIGHT] += position[i, DIM - 1]
                    sums[c, VOLUME] += 1.0 / (1.0 - coefficients[i, DEFICIT])

    return correct
