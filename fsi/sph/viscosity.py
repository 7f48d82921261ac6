"""Sweeps of a viscosity that differs from particle to particle: shear rate, viscous forces, explicit or implicit.

The rows of `flow` are [x, u, mu]: DIM components each of place and velocity, then the viscosity [Pa s] in the column
2 DIM. A pair's viscosity is the harmonic mean of the two, so that the shear stress is continuous between liquids; at a
wall it is the fluid's. Where scenes hold one Newtonian liquid the predictor does all this (`fsi.sph.predictor`).
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numba.extending import register_jitable

from fsi.compute.jit import compiled
from fsi.compute.lanes import at, claim, component, dot, other, other_vector, own, own_vector, store, zero, zero_vector
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

WELL_SPREAD = (
    0.02  # of neighbours: determinant of their moments over that of equal moments, 1 on a lattice, 0 on a line
)


@register_jitable
def shear_rate(G, M):
    """sqrt(2 S : S) of the velocity gradient G M^-1, G[a, b] = sum V F u_ij,a x_ij,b, M the same of x_ij (Randles &
    Libersky 1996); of G itself where the neighbours are nearly in a line or plane. 2 x 2 or 3 x 3."""
    dim = G.shape[0]
    inverse = np.zeros((dim, dim))
    if dim == 2:
        det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        inverse[0, 0], inverse[1, 1] = M[1, 1], M[0, 0]
        inverse[0, 1], inverse[1, 0] = -M[0, 1], -M[1, 0]
    else:
        for a in range(3):
            for b in range(3):
                p, q, r, s = (b + 1) % 3, (b + 2) % 3, (a + 1) % 3, (a + 2) % 3
                inverse[a, b] = M[p, r] * M[q, s] - M[p, s] * M[q, r]
        det = M[0, 0] * inverse[0, 0] + M[0, 1] * inverse[1, 0] + M[0, 2] * inverse[2, 0]
    even = 0.0
    for a in range(dim):
        even += M[a, a] / dim
    if det > WELL_SPREAD * even**dim:
        gradient = np.zeros((dim, dim))
        for a in range(dim):
            for b in range(dim):
                for c in range(dim):
                    gradient[a, b] += G[a, c] * inverse[c, b] / det
    else:
        gradient = G
    total = 0.0
    for a in range(dim):
        for b in range(dim):
            strain = 0.5 * (gradient[a, b] + gradient[b, a])
            total += 2.0 * strain * strain
    return math.sqrt(total)


@cache
def make_shear(lanes: int, dim: int, no_slip: bool):
    """Shear rate [1/s] of the fluid particles into `rate` (n,), and with it their viscosity into `flow`. It is exact where
    the velocity is linear in space, also at the surface and at free-slip walls; no-slip walls take part with their
    mirrored velocities, which halves the error of the curved profile at a wall. `kind` (n,): the
    liquid of each; `laws` (m, 4): mu_0, mu_inf, K and the factor rho (C_s dr)^2 of the eddies (`fsi.fluid.rheology`)."""
    L, DIM = lanes, dim
    MU, LAST, KINDS = 2 * dim, dim - 1, 2 if no_slip else 1

    @compiled(lanes, dim, no_slip)
    def shear(counter, bounds, groups, flow, kind, laws, rate, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(2 * DIM * DIM * L, flow.dtype)
        G, M = np.zeros((DIM, DIM)), np.zeros((DIM, DIM))
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, u_i = own_vector(flow, s, 0, L, DIM), own_vector(flow, s, DIM, L, DIM)
                gx, gy, gz = zero_vector(flow, L, DIM), zero_vector(flow, L, DIM), zero_vector(flow, L, DIM)
                mx, my, mz = zero_vector(flow, L, DIM), zero_vector(flow, L, DIM), zero_vector(flow, L, DIM)
                for n in range(base + span[g, 0], base + span[g, KINDS]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    u_ij = u_i - other_vector(flow, j, DIM, L, DIM)
                    fx = x_ij * slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    gx, mx = gx + fx * component(u_ij, 0), mx + fx * component(x_ij, 0)
                    if DIM == 3:
                        gy, my = gy + fx * component(u_ij, 1), my + fx * component(x_ij, 1)
                    gz, mz = gz + fx * component(u_ij, LAST), mz + fx * component(x_ij, LAST)
                store(t_, 0, gx)
                store(t_, LAST * DIM * L, gz)
                store(t_, DIM * DIM * L, mx)
                store(t_, (DIM + LAST) * DIM * L, mz)
                if DIM == 3:
                    store(t_, DIM * L, gy)
                    store(t_, (DIM + 1) * DIM * L, my)
                for i in range(s, e):
                    for a in range(DIM):
                        for b in range(DIM):
                            G[a, b] = k.divergence_factor * t_[(a * DIM + b) * L + i - s]
                            M[a, b] = k.divergence_factor * t_[((DIM + a) * DIM + b) * L + i - s]
                    rate[i] = shear_rate(G, M)
                    q = kind[i]
                    mu = laws[q, 1] + (laws[q, 0] - laws[q, 1]) / (1.0 + laws[q, 2] * rate[i])
                    flow[i, MU] = mu + laws[q, 3] * rate[i]

    return shear


@cache
def make_mirror(lanes: int, dim: int):
    """No slip: the velocity of a boundary row becomes 2 u_b - sum W u_j / sum W, as in `fsi.sph.walls.make_weights`, for
    velocities that change within a step. `weights` (b, 1 + DIM) with sum W first, `velocity` (b, DIM) of the walls."""
    L, DIM = lanes, dim

    @compiled(lanes, dim)
    def mirror(counter, bounds, groups, first, flow, weights, velocity, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(flow, s, 0, L, DIM)
                carried = zero_vector(flow, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
                    carried = carried + other_vector(flow, j, DIM, L, DIM) * w
                store(t_, 0, carried)
                for i in range(s, e):
                    b, m = i - first, i - s
                    for d in range(DIM):
                        if weights[b, 0] > 0.0:
                            flow[i, DIM + d] = 2.0 * velocity[b, d] - t_[d * L + m] / weights[b, 0]

    return mirror


@cache
def make_viscosity(lanes: int, dim: int, no_slip: bool, dense: bool, implicit: bool):
    """Viscous acceleration A(u) of the velocities in `flow`. Explicit: `velocity` (n, DIM) and the trial velocity in
    `trial` gain dt A. Implicit: one Chebyshev sweep of change = dt A(velocity + change), from the velocities of `flow`
    into those of `trial`, which has the same columns; `change` and `before` (n, DIM) are those of the last two sweeps."""
    L, DIM = lanes, dim
    MU, DENSITY = 2 * dim, 2 * dim + 1

    @compiled(lanes, dim, no_slip, dense, implicit)
    def resist(counter, bounds, groups, flow, trial, velocity, change, before, k, dt, alpha, beta):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, u_i = own_vector(flow, s, 0, L, DIM), own_vector(flow, s, DIM, L, DIM)
                mu_i = own(flow, s, MU, L)
                stress = zero_vector(flow, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
                    mu = mean_viscosity(mu_i, other(flow, j, MU, L))
                    stress = stress + viscous(a * mu, u_i - other_vector(flow, j, DIM, L, DIM))
                if no_slip:
                    for n in range(base + span[g, 1], base + span[g, 2]):
                        j = at(lst, n)
                        x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                        r2 = dot(x_ij, x_ij)
                        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
                        stress = stress + viscous(a * mu_i, u_i - other_vector(flow, j, DIM, L, DIM))
                store(t_, 0, stress)
                for i in range(s, e):
                    factor = k.stress_factor
                    if dense:
                        factor = factor / flow[i, DENSITY]
                    for d in range(DIM):
                        gain = -dt * factor * t_[d * L + i - s]
                        if implicit:
                            last = change[i, d]
                            now = last + alpha * (gain - last) + beta * (last - before[i, d])
                            before[i, d] = now
                            trial[i, DIM + d] = velocity[i, d] + now
                        else:
                            velocity[i, d] += gain
                            trial[i, DIM + 1 + d] = velocity[i, d]

    return resist


@cache
def make_push(lanes: int, dim: int, dense: bool):
    """Acceleration of the fluid by the pressures in `trial`, into `push` (n, DIM); as in `fsi.sph.corrector`."""
    L, DIM = lanes, dim
    P, R = dim, 2 * dim + 1

    @compiled(lanes, dim, dense)
    def accelerate(counter, bounds, groups, trial, push, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * L, trial.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, p_i = own_vector(trial, s, 0, L, DIM), own(trial, s, P, L)
                force = zero_vector(trial, L, DIM)
                if dense:
                    r_i = own(trial, s, R, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(trial, j, 0, L, DIM)
                    f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    if dense:
                        r_j = partner(r_i, other(trial, j, R, L))
                        force = force + interface_gradient(f, p_i, other(trial, j, P, L), r_i, r_j, x_ij) / r_i
                    else:
                        force = force + pressure_gradient(f, p_i, other(trial, j, P, L), x_ij)
                store(t_, 0, force)
                for i in range(s, e):
                    for d in range(DIM):
                        push[i, d] = k.gradient_factor * t_[d * L + i - s]

    return accelerate


@cache
def make_drag(lanes: int, dim: int):
    """Viscous force of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM): the exact
    opposite of its forces on the fluid in `make_viscosity`."""
    L, DIM = lanes, dim
    MU = 2 * dim

    @compiled(lanes, dim)
    def drag(counter, bounds, groups, first, flow, owner, least, force, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if owner[s - first : e - first].max() < least:
                    continue
                x_i, u_i = own_vector(flow, s, 0, L, DIM), own_vector(flow, s, DIM, L, DIM)
                total = zero_vector(flow, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
                    total = total + viscous(a * other(flow, j, MU, L), u_i - other_vector(flow, j, DIM, L, DIM))
                store(t_, 0, total)
                for i in range(s, e):
                    for d in range(DIM):
                        force[i - first, d] = -k.mass * k.stress_factor * t_[d * L + i - s]

    return drag


@cache
def make_grip(lanes: int, dim: int):
    """How much the viscous force on each boundary particle grows with its velocity, into `grip` (b,) [N s/m], for mirrored
    velocities and a fluid that stays as it is."""
    L, DIM = lanes, dim
    MU = 2 * dim

    @compiled(lanes, dim)
    def hold(counter, bounds, groups, first, flow, grip, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(flow, s, 0, L, DIM)
                total = zero(flow, L)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
                    total = total + a * other(flow, j, MU, L)
                store(t_, 0, total)
                for i in range(s, e):
                    grip[i - first] = 2.0 * k.mass * k.stress_factor * t_[i - s]

    return hold
