"""The pressure equation: its source, and the sweeps that update the pressure and its linear responses.

Rows are those of `fsi.sph.columns`.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba.extending import register_jitable

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import at, claim, dot, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.sph.columns import DEFICIT, DIAGONAL, INNER, SOURCE
from fsi.sph.terms import closeness, divergence, laplacian_weight, lightness, partner, slope


@cache
def make_source(lanes: int, dim: int, dense: bool):
    """The source of the pressure equation, div u*/dt + gamma (1 - rho/rho_lattice)/dt^2, and its first sweep, from the
    pressures of `trial` into `field`: p + alpha (J(p) - p), J(p) = (sum a_ij p_j - s_i) / a_ii (`fsi.fluid.chebyshev`).
    `before`, which may be `field`, keeps p for the next sweep."""
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
    beta (p - p_before) inside, plain J(p) at the free surface and in spray. With `columns` the responses in `response` (n, m)
    are taken along into `new_response`, in the groups that touch the box `low` to `high` (`fsi.fluid.response`); they
    have no source."""
    L, DIM, M = lanes, dim, columns
    P, R = dim, dim + 1
    weight = make_weight(lanes, dim, dense)

    @compiled(lanes, dim, dense, columns)
    def sweep(counter, bounds, groups, field, new, coefficients, k, alpha, beta, response, new_response, low, high):
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
                        pulls = pulls + a * other_vector(response, j, 0, L, M)
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
                                response[i, m],
                                k.laplacian_factor * t_[(1 + m) * L + i - s] / coefficients[i, DIAGONAL],
                            )
                            new_response[i, m] = q + step * (jacobi - q) + inner * beta * (q - new_response[i, m])

    return sweep


@cache
def make_onset(lanes: int, dim: int, dense: bool, columns: int):
    """The first sweep of the responses, in which only the boundary acts, into the fluid's rows of `response` (n, m)."""
    L, DIM, M, R = lanes, dim, columns, dim + 1
    weight = make_weight(lanes, dim, dense)

    @compiled(lanes, dim, dense, columns)
    def onset(counter, bounds, groups, field, coefficients, k, alpha, response, low, high):
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
                    pulls = pulls + weight(field, x_i, r_i, j, k) * other_vector(response, j, 0, L, M)
                store(t_, 0, pulls)
                for i in range(s, e):
                    step = 1.0 + coefficients[i, INNER] * (alpha - 1.0)
                    for m in range(M):
                        response[i, m] = step * k.laplacian_factor * t_[m * L + i - s] / coefficients[i, DIAGONAL]

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
