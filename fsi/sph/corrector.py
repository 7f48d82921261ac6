"""The end of a step: the pressure gradient, the wall guard, the sponge, the shift, and the sums for the balance.

Rows are those of `fsi.sph.columns`.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import at, claim, dot, minimum, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.sph import columns
from fsi.sph.columns import DEFICIT, SUPPORT
from fsi.sph.terms import closeness, interface_gradient, partner, pressure_gradient, slope
from fsi.sph.wall_guard import make_guard

SPRAY = 0.55  # share of a full support, below which a particle near the surface is not shifted
PACE = 6.0  # shift along the surface: at most so much of the inner one for each smoothing length moved (Skillen et al. 2013)


@cache
def make_corrector(lanes: int, dim: int, guarded: bool, sponge: bool, shifted: bool, dense: bool, edged: bool):
    """The pressure gradient gives the new velocity, and that the new position, x += dt u_new.

    The wall guard bends the way of a fluid particle that would end too close to wall particles (`fsi.sph.wall_guard`); the
    impulse is handed to the owners of the wall particles in `impulse` (chunks, owners, 6), force part first, moment about
    `centre` (owners, DIM). The shift, which carries no momentum, is bent likewise.
    In the sponge u' = -rate s^2 u, with s from 0 at the start to 1 at the end of each of the zones (z, 4) [axis, start,
    end, rate]."""
    L, DIM = lanes, dim
    X, P, R = columns.field(dim).of("x p r")
    U, FILLED = columns.trial(dim).of("u filled")
    SPEED2, ACCELERATION2, KINETIC, HEIGHT, VOLUME = columns.corrector_sums(dim).of(
        "speed2 acceleration2 kinetic height volume"
    )
    GUARDED, MOMENTUM, DAMPED, LOSS = columns.corrector_sums(dim).of("guarded momentum damped loss")
    bend = make_guard(dim)

    @helper(lanes, dim)
    def along(m, size, shift, t_):
        """Add a shift along the surface: without the part of the shift across it (Khayyer et al. 2017, eq. 19)."""
        across, normal2 = 0.0, 1e-30
        for d in range(DIM):
            normal2 += t_[(2 * DIM + 1 + d) * L + m] ** 2
            across += t_[(2 * DIM + 1 + d) * L + m] * t_[(DIM + 1 + d) * L + m]
        for d in range(DIM):
            shift[d] += size * (t_[(DIM + 1 + d) * L + m] - across / normal2 * t_[(2 * DIM + 1 + d) * L + m])

    @compiled(lanes, dim, guarded, sponge, shifted, dense, edged)
    def correct(
        counter, bounds, groups, trial, field, coefficients, label, position, velocity, pressure, body_force, k, dt, zones,
        first, boundary, boundary_velocity, owner, centre, impulse, sums,
    ):  # fmt: skip
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((3 * DIM + 1) * L, field.dtype)
        shift, way, room = np.empty(DIM), np.empty(DIM), np.empty((4, DIM))
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            impulse[c] = 0.0
            sums[c] = 0.0
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, p_i = own_vector(field, s, X, L, DIM), own(field, s, P, L)
                force, sparse = zero_vector(field, L, DIM), zero_vector(field, L, DIM)
                if dense:
                    r_i = own(field, s, R, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(field, j, X, L, DIM)
                    f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                    if dense:
                        r_j = partner(r_i, other(field, j, R, L))
                        force = force + interface_gradient(f, p_i, other(field, j, P, L), r_i, r_j, x_ij)
                    else:
                        force = force + pressure_gradient(f, p_i, other(field, j, P, L), x_ij)
                    if shifted:
                        sparse = sparse + x_ij * f
                if dense:
                    force = force / r_i
                store(t_, 0, force)
                if shifted:
                    store(t_, (DIM + 1) * L, sparse)
                if edged:
                    full, outward = own(trial, s, FILLED, L), zero_vector(field, L, DIM)
                    for n in range(base + span[g, 0], base + span[g, 1]):
                        j = at(lst, n)
                        x_ij = x_i - other_vector(field, j, X, L, DIM)
                        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
                        outward = outward + x_ij * (f * (other(trial, j, FILLED, L) - full))
                    store(t_, (2 * DIM + 1) * L, outward)
                if guarded:
                    nearest = zero(field, L) + k.guard2
                    for n in range(base + span[g, 1], base + span[g, 2]):
                        x_ij = x_i - other_vector(field, at(lst, n), X, L, DIM)
                        nearest = minimum(nearest, dot(x_ij, x_ij))
                    store(t_, DIM * L, nearest)
                for i in range(s, e):
                    if label[i] < 0:  # a ghost, dropped after this
                        continue
                    m = i - s
                    r = field[i, R] if dense else 1.0
                    mass = k.mass * r
                    acceleration2, speed2 = 0.0, 0.0
                    for d in range(DIM):
                        velocity[i, d] += dt * k.gradient_factor * t_[d * L + m]
                        a = (velocity[i, d] - trial[i, U + d]) / dt + body_force[d]
                        acceleration2 += a * a
                    if guarded and t_[DIM * L + m] < k.guard2:
                        for d in range(DIM):
                            way[d] = dt * velocity[i, d]
                        walls = base + span[g, 1], base + span[g, 2], lst, first, boundary, boundary_velocity
                        if bend(position[i], way, walls, (owner, centre, mass / dt, impulse[c]), k, dt, room):
                            sums[c, GUARDED] += 1.0
                            for d in range(DIM):
                                velocity[i, d] = way[d] / dt
                    if sponge:
                        for z in range(zones.shape[0]):
                            into = (position[i, int(zones[z, 0])] - zones[z, 1]) / (zones[z, 2] - zones[z, 1])
                            if 0.0 < into <= 1.0:
                                kept = 1.0 / (1.0 + dt * zones[z, 3] * into * into)
                                for d in range(DIM):
                                    sums[c, DAMPED + d] += mass * (1.0 - kept) * velocity[i, d]
                                    loss = 0.5 * mass * (1.0 - kept * kept) * velocity[i, d] * velocity[i, d]
                                    sums[c, LOSS] += loss
                                    velocity[i, d] *= kept
                    for d in range(DIM):
                        speed2 += velocity[i, d] * velocity[i, d]
                    if shifted:
                        inside = coefficients[i, SUPPORT]
                        for d in range(DIM):
                            shift[d] = k.shifting * inside * t_[(DIM + 1 + d) * L + m]
                    if edged and inside < 1.0 and trial[i, FILLED] > SPRAY:
                        near = (1.0 - inside) * min(1.0, PACE * 2.0 * k.inverse_support * dt * math.sqrt(speed2))
                        along(m, near * k.shifting, shift, t_)
                    if guarded and shifted and t_[DIM * L + m] < k.guard2:
                        for d in range(DIM):
                            way[d] = dt * velocity[i, d] + shift[d]
                        walls = base + span[g, 1], base + span[g, 2], lst, first, boundary, boundary_velocity
                        bend(position[i], way, walls, (owner, centre, 0.0, impulse[c]), k, dt, room)
                        for d in range(DIM):
                            shift[d] = way[d] - dt * velocity[i, d]
                    for d in range(DIM):
                        position[i, d] += dt * velocity[i, d]
                        if shifted:
                            position[i, d] += shift[d]
                    for d in range(DIM):
                        sums[c, MOMENTUM + d] += mass * velocity[i, d]
                    pressure[i] = field[i, P]
                    sums[c, SPEED2] = max(sums[c, SPEED2], speed2)
                    sums[c, ACCELERATION2] = max(sums[c, ACCELERATION2], acceleration2)
                    sums[c, KINETIC] += 0.5 * mass * speed2
                    sums[c, HEIGHT] += r * position[i, DIM - 1]
                    sums[c, VOLUME] += 1.0 / (1.0 - coefficients[i, DEFICIT])

    return correct
