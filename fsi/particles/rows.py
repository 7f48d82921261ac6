"""Filling the packed rows that the sweeps read, from particles in cell order."""

from __future__ import annotations

from fsi.compute.jit import exact
from fsi.compute.lanes import claim


@exact
def gather(counter, bounds, order, source, target):
    """target[i] = source[order[i]], for arrays (n, columns)."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            for d in range(source.shape[1]):
                target[i, d] = source[order[i], d]


@exact
def largest_change(rows, before, count, column):
    """Largest magnitude in a column of the first `count` rows, and of its change from the same column `before`."""
    largest = change = 0.0
    for i in range(count):
        largest = max(largest, abs(rows[i, column]))
        change = max(change, abs(rows[i, column] - before[i, column]))
    return largest, change


@exact
def pack_fluid(counter, bounds, lower, position, velocity, pressure, place, xs, flow, trial, field, twin):
    """Fill the rows of particles that are in cell order; `place` says which columns (`fsi.sph.columns.packed`)."""
    dim = position.shape[1]
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            for d in range(dim):
                x = position[i, d] - lower[d]
                xs[d, i] = x
                flow[i, d] = x
                trial[i, d] = x
                field[i, d] = x
                twin[i, d] = x
                flow[i, place.u + d] = velocity[i, d]
            trial[i, place.p] = pressure[i]


@exact
def pack_boundary(counter, bounds, order, first, lower, position, velocity, skin, owner, position2, velocity2, skin2, owner2,
                  dt, body_force, place, xs, flow, trial, field, twin):  # fmt: skip
    """The same for the boundary, whose trial velocity is u + dt g, so that the pressure that holds a wall's
    acceleration makes its final velocity. Viscosity feels the velocities `skin`."""
    dim = position.shape[1]
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for b in range(bounds[c], bounds[c + 1]):
            j, i = order[b], first + b
            owner2[b] = owner[j]
            for d in range(dim):
                skin2[b, d] = skin[j, d]
                flow[i, place.u + d] = skin[j, d]  # before `trial`, which is the same array where nothing is viscous
            for d in range(dim):
                position2[b, d] = position[j, d]
                velocity2[b, d] = velocity[j, d]
                x = position[j, d] - lower[d]
                xs[d, i] = x
                flow[i, d] = x
                trial[i, d] = x
                field[i, d] = x
                twin[i, d] = x
                trial[i, place.trial_u + d] = velocity[j, d] + dt * body_force[d]
