"""Sweeps over the fluid neighbours of boundary particles: pressure extrapolated from the fluid, forces on the owners.

Rows are those of `fsi.sph.columns`; boundary particle b of the sorted order has row first + b. An owner is a solid: 0 the
fixed walls, 1 the wavemaker, 2 + b the bodies.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import at, claim, component, dot, other, other_vector, own_vector, store, zero, zero_vector
from fsi.sph.pressure import touches
from fsi.sph.terms import closeness, kernel, laplacian_weight, pressure_gradient, slope, viscous


@cache
def make_weights(lanes: int, dim: int, no_slip: bool, dense: bool):
    """Once a step: sum W and sum r_j W x_bj of each boundary particle into `weights` (b, 1 + DIM). With `no_slip` the
    velocity of its row in `flow` becomes 2 u_b - sum W u_j / sum W, so that the fluid's velocity between the two is
    the wall's (Adami et al. 2012, eq. 22-23)."""
    L, DIM, R = lanes, dim, 2 * dim + 1

    @compiled(lanes, dim, no_slip, dense)
    def collect(counter, bounds, groups, first, flow, weights, k):
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
                total, lever, carried = zero(flow, L), zero_vector(flow, L, DIM), zero_vector(flow, L, DIM)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, 0, L, DIM)
                    w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
                    total = total + w
                    lever = lever + x_ij * (w * other(flow, j, R, L) if dense else w)
                    if no_slip:
                        carried = carried + other_vector(flow, j, DIM, L, DIM) * w
                store(t_, 0, total)
                store(t_, L, lever)
                store(t_, (1 + DIM) * L, carried)
                for i in range(s, e):
                    b, m = i - first, i - s
                    weights[b, 0] = t_[m]
                    for d in range(DIM):
                        weights[b, 1 + d] = t_[(1 + d) * L + m]
                        if no_slip and t_[m] > 0.0:
                            flow[i, DIM + d] = 2.0 * flow[i, DIM + d] - t_[(1 + DIM + d) * L + m] / t_[m]

    return collect


@cache
def make_drag(lanes: int, dim: int):
    """Viscous force of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM): the exact
    opposite of its forces on the fluid at a no-slip wall."""
    L, DIM = lanes, dim

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
                    total = total + viscous(a, u_i - other_vector(flow, j, DIM, L, DIM))
                store(t_, 0, total)
                for i in range(s, e):
                    for d in range(DIM):
                        force[i - first, d] = -k.mass * k.viscous_factor * t_[d * L + i - s]

    return drag


@cache
def make_extrapolation(lanes: int, dim: int, columns: int = 0):
    """Pressure of the boundary particles from the fluid's (Adami et al. 2012, eq. 27):
    p_b = (sum W p_j + lift_b) / sum W, with lift_b = rho (g - a_b) . sum r_j W x_bj (`lift_of`). With `columns` also that of
    the responses in `response` (n, m) with theirs, in the groups that touch the box `low` to `high` (`fsi.fluid.response`)."""
    L, DIM, M = lanes, dim, columns
    P = dim

    @helper(lanes, dim)
    def weight(rows, x_i, j, k):
        x_ij = x_i - other_vector(rows, j, 0, L, DIM)
        return kernel(closeness(dot(x_ij, x_ij), k.inverse_support))

    @compiled(lanes, dim, columns)
    def extrapolate(counter, bounds, groups, first, rows, weights, lift, k, response, response_lift, low, high):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((1 + M) * L, rows.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, total = own_vector(rows, s, 0, L, DIM), zero(rows, L)
                reached = touches(rows, s, e, low, high, 1.0 / k.inverse_support) if M > 0 else False
                if reached:
                    totals = zero_vector(rows, L, M)
                    for n in range(base + span[g, 0], base + span[g, 1]):
                        j = at(lst, n)
                        w = weight(rows, x_i, j, k)
                        total = total + w * other(rows, j, P, L)
                        totals = totals + w * other_vector(response, j, 0, L, M)
                    store(t_, L, totals)
                else:
                    for n in range(base + span[g, 0], base + span[g, 1]):
                        j = at(lst, n)
                        total = total + weight(rows, x_i, j, k) * other(rows, j, P, L)
                store(t_, 0, total)
                for i in range(s, e):
                    b, full = i - first, weights[i - first, 0]
                    rows[i, P] = (t_[i - s] + lift[b, 0]) / full if full > 0.0 else 0.0
                    if reached:
                        for m in range(M):
                            response[i, m] = (
                                (t_[(1 + m) * L + i - s] + response_lift[b, m]) / full if full > 0.0 else 0.0
                            )

    return extrapolate


@njit(nogil=True, cache=True)
def _project(vector, normal):
    """Take what is at right angles to the normal out of a vector, unless the normal is 0."""
    length2, along = 0.0, 0.0
    for d in range(vector.size):
        length2 += normal[d] * normal[d]
        along += normal[d] * vector[d]
    if length2 > 0.0:
        for d in range(vector.size):
            vector[d] = along * normal[d]


@njit(nogil=True, cache=True)
def lift_of(counter, bounds, position, normal, owner, centre, acceleration, twist, body_force, density, weights, lift):
    """lift (b, m) = rho (g - a_b) . sum r_j W x_bj, g = body_force (DIM,), for each column m of accelerations (m, owners, 6)
    of the owners, whose twist (owners, 6) is about `centre` (owners, 3): a_b = a + alpha x r + omega x (omega x r).

    Where there is a `normal` (b, DIM), that of a body, a_b counts along it alone, as dp/dn = rho (g - a_b) . n says: a side
    that slides along itself moves no fluid. All of a_b would drive the water line along the side of a heaving spar, because
    there is fluid only below it and the sum points down: the spar had twice its resistance and 1.3 times its added mass."""
    dim = position.shape[1]
    r, s, lever = np.zeros(3), np.zeros(3), np.zeros(dim)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for b in range(bounds[c], bounds[c + 1]):
            o = owner[b]
            w = twist[o, 3:]
            for d in range(dim):
                axis = 2 if d == dim - 1 else d
                r[axis] = position[b, d] - centre[o, axis]
            for d in range(3):
                s[d] = w[(d + 1) % 3] * r[(d + 2) % 3] - w[(d + 2) % 3] * r[(d + 1) % 3]
            level = 0.0
            for d in range(dim):
                lever[d] = weights[b, 1 + d]
                level += body_force[d] * lever[d]
            if normal.shape[0] > 0:
                _project(lever, normal[b])
            for m in range(acceleration.shape[0]):
                a = acceleration[m, o]
                total = level
                for d in range(dim):
                    x = 2 if d == dim - 1 else d
                    y, z = (x + 1) % 3, (x + 2) % 3
                    part = a[x] + a[3 + y] * r[z] - a[3 + z] * r[y] + w[y] * s[z] - w[z] * s[y]
                    total -= part * lever[d]
                lift[b, m] = density * total


@cache
def make_force(lanes: int, dim: int, column: int, columns: int):
    """Pressure force of the fluid on each boundary particle of an owner from `least` on, into `force` (m, b, DIM), for the
    pressures in so many columns of `values` from `column` on: the exact opposite of its forces on the fluid."""
    L, DIM, M = lanes, dim, columns
    P, Z = column, dim - 1

    @compiled(lanes, dim, column, columns)
    def press(counter, bounds, groups, first, rows, values, owner, least, force, k):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty(DIM * M * L, rows.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                if owner[s - first : e - first].max() < least:
                    continue
                x_i, p_i = own_vector(rows, s, 0, L, DIM), own_vector(values, s, P, L, M)
                total_x, total_y, total_z = zero_vector(rows, L, M), zero_vector(rows, L, M), zero_vector(rows, L, M)
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(rows, j, 0, L, DIM)
                    f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    p_j = other_vector(values, j, P, L, M)
                    total_x = total_x + pressure_gradient(f, p_i, p_j, component(x_ij, 0))
                    total_z = total_z + pressure_gradient(f, p_i, p_j, component(x_ij, Z))
                    if DIM == 3:
                        total_y = total_y + pressure_gradient(f, p_i, p_j, component(x_ij, 1))
                store(t_, 0, total_x)
                if DIM == 3:
                    store(t_, M * L, total_y)
                store(t_, Z * M * L, total_z)
                for i in range(s, e):
                    for m in range(M):
                        for d in range(DIM):
                            force[m, i - first, d] = k.mass * k.gradient_factor * t_[(d * M + m) * L + i - s]

    return press


@njit(nogil=True, cache=True)
def wrenches(position, force, owner, centre, least, wrench):
    """Add the forces (b, DIM) on boundary particles of the owners from `least` on to the wrench (owners, 6) of their
    owners about `centre` (owners, DIM): force (x, y, z), then torque."""
    dim = position.shape[1]
    arm, load = np.zeros(3), np.zeros(3)
    for b in range(position.shape[0]):
        o = owner[b]
        if o < least:
            continue
        for d in range(dim):
            axis = 2 if d == dim - 1 else d
            arm[axis] = position[b, d] - centre[o, d]
            load[axis] = force[b, d]
        for d in range(3):
            wrench[o, d] += load[d]
            wrench[o, 3 + d] += arm[(d + 1) % 3] * load[(d + 2) % 3] - arm[(d + 2) % 3] * load[(d + 1) % 3]
