"""Sweeps over the fluid neighbours of boundary particles: pressure extrapolated from the fluid, forces on the owners.

Rows are those of `fsi.sweeps`; boundary particle b of the sorted order has row first + b. An owner is a solid: 0 the fixed
walls, 1 the wavemaker, 2 + b the bodies.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit

from fsi.compiled import kernel as compiled
from fsi.lanes import at, claim, dot, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.sweeps import touches
from fsi.terms import closeness, kernel, laplacian_weight, pressure_gradient, slope, viscous


@cache
def make_weights(lanes: int, dim: int, laminar: bool):
    """Once a step: sum W and sum W x_bj of each boundary particle into `weights` (b, 1 + DIM), and the viscous force of
    the fluid on it into `force` (b, DIM), the exact opposite of its forces on the fluid."""
    L, DIM = lanes, dim

    @compiled(lanes, dim, laminar)
    def collect(counter, bounds, groups, first, flow, weights, force, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((1 + 2 * DIM) * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(flow, s, 0, L, DIM)
                total, lever, drag = zero(flow, L), zero_vector(flow, L, DIM), zero_vector(flow, L, DIM)
                if laminar:
                    u_i = own_vector(flow, s, DIM, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    t = closeness(r2, k.inverse_support)
                    w = kernel(t)
                    total = total + w
                    lever = lever + x_ij * w
                    if laminar:
                        a = laplacian_weight(slope(t), r2, k.eta2)
                        drag = drag + viscous(a, u_i - other_vector(flow, j, DIM, L, DIM))
                store(t_, 0, total)
                store(t_, L, lever)
                store(t_, (1 + DIM) * L, drag)
                for i in range(s, e):
                    b, m = i - first, i - s
                    weights[b, 0] = t_[m]
                    for d in range(DIM):
                        weights[b, 1 + d] = t_[(1 + d) * L + m]
                        force[b, d] = -k.mass * k.viscous_factor * t_[(1 + DIM + d) * L + m]

    return collect


@cache
def make_extrapolation(lanes: int, dim: int, everywhere: bool = True):
    """Pressure of the boundary particles from the fluid's (Adami et al. 2012, eq. 27):
    p_b = (sum W p_j + rho (g - a_b) . sum W x_bj) / sum W, with `fall` = g - a_b (b, DIM). With `everywhere` off only
    groups that touch the box `low` to `high` take part."""
    L, DIM = lanes, dim
    P = dim

    @compiled(lanes, dim, everywhere)
    def extrapolate(counter, bounds, groups, first, rows, weights, fall, k, low, high):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(L, rows.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if not everywhere and not touches(rows, s, e, low, high):
                    continue
                x_i = own_vector(rows, s, 0, L, DIM)
                total = zero(rows, L)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(rows, j, 0, L, DIM)
                    w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
                    total = total + w * other(rows, j, P, L)
                store(t_, 0, total)
                for i in range(s, e):
                    b = i - first
                    p = t_[i - s]
                    for d in range(DIM):
                        p += k.density * fall[b, d] * weights[b, 1 + d]
                    rows[i, P] = p / weights[b, 0] if weights[b, 0] > 0.0 else 0.0

    return extrapolate


@cache
def make_force(lanes: int, dim: int):
    """Pressure force of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM): the
    exact opposite of its forces on the fluid."""
    L, DIM = lanes, dim
    P = dim

    @compiled(lanes, dim)
    def press(counter, bounds, groups, first, rows, owner, least, force, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * L, rows.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if owner[s - first : e - first].max() < least:
                    continue
                x_i, p_i = own_vector(rows, s, 0, L, DIM), own(rows, s, P, L)
                total = zero_vector(rows, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(rows, j, 0, L, DIM)
                    f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    total = total + pressure_gradient(f, p_i, other(rows, j, P, L), x_ij)
                store(t_, 0, total)
                for i in range(s, e):
                    for d in range(DIM):
                        force[i - first, d] = k.mass * k.gradient_factor * t_[d * L + i - s]

    return press


@njit(cache=True)
def wrenches(position, force, owner, centre, wrench):
    """Add the forces (b, DIM) on boundary particles to the wrench (owners, 6) of their owners about `centre`
    (owners, DIM): force (x, y, z), then torque."""
    dim = position.shape[1]
    arm, load = np.zeros(3), np.zeros(3)
    for b in range(position.shape[0]):
        o = owner[b]
        for d in range(dim):
            axis = 2 if d == dim - 1 else d
            arm[axis] = position[b, d] - centre[o, d]
            load[axis] = force[b, d]
        for d in range(3):
            wrench[o, d] += load[d]
            wrench[o, 3 + d] += arm[(d + 1) % 3] * load[(d + 2) % 3] - arm[(d + 2) % 3] * load[(d + 1) % 3]
