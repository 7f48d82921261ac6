"""How the corrector moves a particle: velocity, wall guard, sponge, shift, position, and its part in the balance.

Rows are those of `fsi.sph.columns`.
"""

from __future__ import annotations

import math
from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lane_sums import small
from fsi.sph import columns
from fsi.sph.columns import COUNTS, DEFICIT, SUPPORT
from fsi.sph.wall_guard import make_guard

SPRAY = 0.55  # share of a full support, below which a particle near the surface is not shifted
PACE = 6.0  # shift along the surface: at most so much of the inner one for each smoothing length moved (Skillen et al. 2013)


@cache
def make_advance(dim: int, guarded: bool, sponge: bool, shifted: bool, dense: bool, surface: bool):
    """`advance(i, sums, chunk, ...)`: what `fsi.sph.corrector` does with the sums of particle i, in this order."""
    DIM, edged = dim, shifted and surface
    P, R = columns.field(dim).of("p r")
    U, FILLED = columns.trial(dim).of("u filled")
    guard_velocity, guard_shift = _make_guards(dim)
    damp, shift_inside, shift_along = _make_sponge(dim), *_make_shift(dim)
    book = _make_book(dim)

    def advance(
        i, sums, chunk, walls_from, walls_to, walls_row, steps, trial, field, coefficients, label, position, velocity, pressure,
        body_force, k, dt, zones, first, boundary, boundary_velocity, owner, centre, impulse, totals,
    ):  # fmt: skip
        if label[i] < 0:  # a ghost, dropped after this
            return
        force, sparse, outward, nearest = sums
        r = field[i, R] if dense else 1.0
        mass = k.mass * r
        u, x, shift = velocity[i], position[i], small(DIM)
        acceleration2, speed2 = 0.0, 0.0
        for d in range(DIM):
            u[d] += dt * k.gradient_factor * force[d]
            a = (u[d] - trial[i, U + d]) / dt + body_force[d]
            acceleration2 += a * a
        near_walls = guarded and nearest < k.guard2
        walls = walls_from, walls_to, steps, walls_row - first, boundary, boundary_velocity
        if near_walls:
            guard_velocity(x, u, walls, (owner, centre, mass / dt, impulse[chunk]), k, dt, totals[chunk])
        if sponge:
            damp(x, u, mass, zones, dt, totals[chunk])
        for d in range(DIM):
            speed2 += u[d] * u[d]
        if shifted:
            inside = coefficients[i, SUPPORT]
            shift_inside(shift, sparse, inside, k)
        if edged and inside < 1.0 and trial[i, FILLED] > SPRAY:
            near = (1.0 - inside) * min(1.0, PACE * 2.0 * k.inverse_support * dt * math.sqrt(speed2))
            shift_along(shift, near * k.shifting, sparse, outward)
        if shifted and near_walls:
            guard_shift(x, u, shift, walls, (owner, centre, 0.0, impulse[chunk]), k, dt)
        for d in range(DIM):
            x[d] += dt * u[d]
            if shifted:
                x[d] += shift[d]
        pressure[i] = field[i, P] / coefficients[i, COUNTS] if surface else field[i, P]
        book(x, u, r, mass, speed2, acceleration2, 1.0 / (1.0 - coefficients[i, DEFICIT]), totals[chunk])

    return advance


def _make_guards(dim: int):
    """The wall guard on the way of the velocity, with its impulse, and on that with the shift, which has none."""
    DIM = dim
    (GUARDED,) = columns.corrector_sums(dim).of("guarded")
    bend = make_guard(dim)

    @helper(dim, inline=True)
    def guard_velocity(x, u, walls, account, k, dt, totals):
        way = small(DIM)
        for d in range(DIM):
            way[d] = dt * u[d]
        if bend(x, way, walls, account, k, dt):
            totals[GUARDED] += 1.0
            for d in range(DIM):
                u[d] = way[d] / dt

    @helper(dim, inline=True)
    def guard_shift(x, u, shift, walls, account, k, dt):
        way = small(DIM)
        for d in range(DIM):
            way[d] = dt * u[d] + shift[d]
        bend(x, way, walls, account, k, dt)
        for d in range(DIM):
            shift[d] = way[d] - dt * u[d]

    return guard_velocity, guard_shift


def _make_sponge(dim: int):
    """Slow a particle in the zones of the sponge; the momentum and energy it loses there are summed up."""
    DIM = dim
    DAMPED, LOSS = columns.corrector_sums(dim).of("damped loss")

    @helper(dim, inline=True)
    def damp(x, u, mass, zones, dt, totals):
        for z in range(zones.shape[0]):
            into = (x[int(zones[z, 0])] - zones[z, 1]) / (zones[z, 2] - zones[z, 1])
            if 0.0 < into <= 1.0:
                kept = 1.0 / (1.0 + dt * zones[z, 3] * into * into)
                for d in range(DIM):
                    totals[DAMPED + d] += mass * (1.0 - kept) * u[d]
                    loss = 0.5 * mass * (1.0 - kept * kept) * u[d] * u[d]
                    totals[LOSS] += loss
                    u[d] *= kept

    return damp


def _make_shift(dim: int):
    """The shift towards where particles are sparse, inside the fluid and along its surface."""
    DIM = dim

    @helper(dim, inline=True)
    def shift_inside(shift, sparse, inside, k):
        for d in range(DIM):
            shift[d] = k.shifting * inside * sparse[d]

    @helper(dim, inline=True)
    def shift_along(shift, size, sparse, outward):
        """Add it without the part across the surface (Khayyer et al. 2017, eq. 19)."""
        across, normal2 = 0.0, 1e-30
        for d in range(DIM):
            normal2 += outward[d] ** 2
            across += outward[d] * sparse[d]
        for d in range(DIM):
            shift[d] += size * (sparse[d] - across / normal2 * outward[d])

    return shift_inside, shift_along


def _make_book(dim: int):
    """Add a particle, where it is now, to the sums of its chunk."""
    DIM = dim
    SPEED2, ACCELERATION2, KINETIC, HEIGHT = columns.corrector_sums(dim).of("speed2 acceleration2 kinetic height")
    VOLUME, MOMENTUM = columns.corrector_sums(dim).of("volume momentum")

    @helper(dim, inline=True)
    def book(x, u, r, mass, speed2, acceleration2, volume, totals):
        for d in range(DIM):
            totals[MOMENTUM + d] += mass * u[d]
        totals[SPEED2] = max(totals[SPEED2], speed2)
        totals[ACCELERATION2] = max(totals[ACCELERATION2], acceleration2)
        totals[KINETIC] += 0.5 * mass * speed2
        totals[HEIGHT] += r * x[DIM - 1]
        totals[VOLUME] += volume

    return book
