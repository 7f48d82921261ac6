"""Sweeps over the fluid neighbours of boundary particles: pressure extrapolated from the fluid, forces on the owners.

Rows are those of `fsi.sph.columns`; boundary particle b of the sorted order has row first + b. An owner is a solid: 0 the
fixed walls, 1 the wavemaker, 2 + b the bodies. How a sweep is made of its functions is told in `fsi.compute.pairs`.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fsi.compute.jit import exact, helper
from fsi.compute.lane_sums import plus
from fsi.compute.lanes import claim, dot, fence, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import FLUID, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.pressure import touches
from fsi.sph.terms import closeness, kernel, laplacian_weight, pressure_gradient, slope, viscous

STEEP = 0.1  # sine of the slope from which on a way up along a surface may lead out of the water


def belongs(s, e, first, owner, least):
    """Whether one of the rows s to e, boundary particles from `first` on, has an owner from `least` on."""
    found = False
    for b in range(s - first, e - first):
        found |= owner[b] >= least
    return found


def lined(s, e, first, line):
    """Whether one of the rows s to e, boundary particles from `first` on, has a way along its surface in `line`."""
    for b in range(s - first, e - first):
        for d in range(line.shape[1]):
            if line[b, d] != 0.0:
                return True
    return False


@cache
def make_shepard(lanes: int, dim: int, no_slip: bool, dense: bool):
    """Once a step: the sums over the fluid around each boundary particle that interpolation divides by (Shepard 1968), sum W
    and sum r_j W x_bj, into `shepard` (b, 1 + DIM). With `no_slip` the velocity of its row in `flow` becomes
    2 u_b - sum W u_j / sum W, so that the fluid's velocity between the two is the wall's (Adami et al. 2012, eq. 22-23)."""
    L, DIM = lanes, dim
    X, U, R = columns.flow(dim).of("x u r")
    TOTAL, LEVER = columns.shepard(dim).of("total lever")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM)

    def empty(flow):
        return zero(flow, L), zero_vector(flow, L, DIM), zero_vector(flow, L, DIM)

    def pair(sums, x_i, j, flow, k):
        total, lever, carried = sums
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
        if no_slip:
            carried = carried + other_vector(flow, j, U, L, DIM) * w
        return total + w, lever + x_ij * (w * other(flow, j, R, L) if dense else w), carried

    def finish(i, sums, first, flow, shepard):
        (total, lever, carried), b = sums, i - first
        shepard[b, TOTAL] = total
        for d in range(DIM):
            shepard[b, LEVER + d] = lever[d]
            if no_slip and shepard[b, TOTAL] > 0.0:
                flow[i, U + d] = 2.0 * flow[i, U + d] - carried[d] / shepard[b, TOTAL]

    return over_pairs(
        "collect", (lanes, dim, no_slip, dense), takes="first flow shepard k",
        sum=Sum(hold, empty, ((FLUID, pair),), finish),
    )  # fmt: skip


@cache
def make_drag(lanes: int, dim: int, varies: bool = False):
    """Viscous force of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM): the exact
    opposite of its forces on the fluid at a no-slip wall; `varies`: where the viscosity differs from particle to particle."""
    L, DIM = lanes, dim
    X, U, MU = columns.flow(dim).of("x u mu")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        return (zero_vector(flow, L, DIM),)

    def pair(sums, mine, j, flow, k):
        (total,), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        if varies:
            a = a * other(flow, j, MU, L)
        return (total + viscous(a, u_i - other_vector(flow, j, U, L, DIM)),)

    def finish(i, sums, first, force, k):
        (total,) = sums
        factor = k.stress_factor if varies else k.viscous_factor
        for d in range(DIM):
            force[i - first, d] = -k.mass * factor * total[d]

    return over_pairs(
        "drag", (lanes, dim, varies), takes="first flow owner least force k", sum=Sum(hold, empty, ((FLUID, pair),), finish),
        where=belongs,
    )  # fmt: skip


@cache
def make_extrapolation(lanes: int, dim: int, responses: int = 0):
    """Pressure of the boundary particles from the fluid's (Adami et al. 2012, eq. 27):
    p_b = (sum W p_j + lift_b) / sum W, with lift_b = rho (g - a_b) . sum r_j W x_bj (`lift_of`), in `rows` of `trial` or
    `field`. So many linear responses in `response` (n, m) are taken along with their lift, in the groups that touch the
    box `low` to `high` (`fsi.fluid.response`)."""
    L, DIM, M = lanes, dim, responses
    X, P = columns.field(dim).of("x p")
    (TOTAL,) = columns.shepard(dim).of("total")

    def hold(s, rows):
        return own_vector(rows, s, X, L, DIM)

    @helper(lanes, dim)
    def weight(rows, x_i, j, k):
        x_ij = x_i - other_vector(rows, j, X, L, DIM)
        return kernel(closeness(dot(x_ij, x_ij), k.inverse_support))

    def empty(rows):
        return (zero(rows, L),)

    def pair(sums, x_i, j, rows, k):
        return (plus(sums[0], fence(weight(rows, x_i, j, k)) * other(rows, j, P, L)),)

    def finish(i, sums, first, rows, shepard, lift):
        b, full = i - first, shepard[i - first, TOTAL]
        rows[i, P] = (sums[0] + lift[b, 0]) / full if full > 0.0 else 0.0

    def empty_too(rows):
        return zero(rows, L), zero_vector(rows, L, M)

    def pair_too(sums, x_i, j, rows, response, k):
        total, totals = sums
        w = fence(weight(rows, x_i, j, k))
        return plus(total, w * other(rows, j, P, L)), totals + w * other_vector(response, j, 0, L, M)

    def finish_too(i, sums, first, rows, shepard, lift, response, response_lift):
        total, totals = sums
        b, full = i - first, shepard[i - first, TOTAL]
        rows[i, P] = (total + lift[b, 0]) / full if full > 0.0 else 0.0
        for m in range(M):
            response[i, m] = (totals[m] + response_lift[b, m]) / full if full > 0.0 else 0.0

    def where(s, e, rows, low, high, k):
        return touches(rows, s, e, low, high, 1.0 / k.inverse_support)

    plain = Sum(hold, empty, ((FLUID, pair),), finish)
    both = {"sum": Sum(hold, empty_too, ((FLUID, pair_too),), finish_too), "where": where, "otherwise": plain}
    return over_pairs(
        "extrapolate", (lanes, dim, responses), **(both if responses else {"sum": plain}),
        takes="first rows shepard lift k response response_lift low high",
    )  # fmt: skip


@helper()
def _project(vector, normal):
    """Take what is at right angles to the normal out of a vector, unless the normal is 0."""
    length2, along = 0.0, 0.0
    for d in range(vector.size):
        length2 += normal[d] * normal[d]
        along += normal[d] * vector[d]
    if length2 > 0.0:
        for d in range(vector.size):
            vector[d] = along * normal[d]


@exact
def water_lines(counter, bounds, order, facing, shepard, up, least, line):
    """Unit vectors `line` (b, DIM) along the surface of each boundary particle from the fluid around it to it, where that is
    more than `least` [m] away and leads `up` (DIM,) by more than STEEP: past the water line. 0 elsewhere, without a normal
    `facing` (f, DIM), and on bodies, which come after the first f. In corners under water a pressure that goes on as it
    does in the fluid would confirm itself."""
    dim = line.shape[1]
    way, n = np.zeros(dim), np.zeros(dim)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for b in range(bounds[c], bounds[c + 1]):
            o, total, length2, across, apart2, over = order[b], shepard[b, 0], 0.0, 0.0, 0.0, 0.0
            for d in range(dim):
                n[d] = facing[o, d] if o < facing.shape[0] else 0.0
                way[d] = shepard[b, 1 + d] / total if total > 0.0 else 0.0
                length2 += n[d] * n[d]
                across += n[d] * way[d]
            for d in range(dim):
                way[d] -= across / max(length2, 1e-30) * n[d]
                apart2 += way[d] * way[d]
                over += way[d] * up[d]
            past = length2 > 0.0 and apart2 > least * least and over > STEEP * apart2**0.5
            for d in range(dim):
                line[b, d] = way[d] / apart2**0.5 if past else 0.0


@cache
def make_steepening(lanes: int, dim: int):
    """Once a step: the lift (`lift_of`) of boundary particles past the water line besides that of the body force, into
    `steeper` (b,). Along a wall the fluid moves as it will, so that the pressure goes on as it does in the fluid, by the
    slope of its last pressures along `line` (b, DIM) (least squares): rho (g - a), a the fluid's acceleration, in place of
    rho g, from which it may differ by as much. Where the fluid is no more than a row, with a spread below `least` / 3, it has
    no slope."""
    L, DIM = lanes, dim
    X, P = columns.trial(dim).of("x p")
    (TOTAL,) = columns.shepard(dim).of("total")

    def hold(s, first, trial, line):
        return own_vector(trial, s, X, L, DIM), own_vector(line, s - first, 0, L, DIM)

    def empty(trial):
        return zero(trial, L), zero(trial, L), zero(trial, L), zero(trial, L)

    def pair(sums, mine, j, trial, k):
        (way, way2, load, moment), (x_i, line_i) = sums, mine
        x_ij = x_i - other_vector(trial, j, X, L, DIM)
        w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
        s, p = dot(x_ij, line_i), w * other(trial, j, P, L)
        return way + w * s, way2 + w * (s * s), load + p, moment + p * s

    def finish(i, sums, first, shepard, line, steeper, body_force, density, least):
        (way, way2, load, moment), b = sums, i - first
        total, still, weight2 = shepard[b, TOTAL], 0.0, 0.0
        for d in range(DIM):
            still += density * body_force[d] * line[b, d]
            weight2 += (density * body_force[d]) ** 2
        mean = way / max(total, 1e-30)
        spread = way2 - mean * way  # squared, of the fluid along the surface, times sum W; 0 where there is no line
        if spread > least * least / 9 * total:
            more = -(moment - mean * load) / spread - still
            steeper[b] = way * min(max(more, -(weight2**0.5)), weight2**0.5)

    return over_pairs(
        "steepen", (lanes, dim), takes="first trial shepard line steeper body_force density least k",
        sum=Sum(hold, empty, ((FLUID, pair),), finish), where=lined,
    )  # fmt: skip


@exact
def lift_of(
    counter, bounds, order, position, normal, fixed, owner, centre, still, acceleration, twist, body_force, density, shepard,
    first, lift,
):  # fmt: skip
    """lift (b, m) = rho (g - a_b) . sum r_j W x_bj, g = body_force (DIM,), for each column m of accelerations (m, owners, 6)
    of the owners, whose twist (owners, 6) is about `centre` (owners, 3): a_b = a + alpha x r + omega x (omega x r), 0 of those
    that are `still` (owners,). The sum is in the columns of `shepard` from `first` on.

    Where there is a normal[order[b] - fixed] (DIM,), that of a body, a_b counts along it alone, as dp/dn = rho (g - a_b) . n
    says: a side that slides along itself moves no fluid. All of a_b would drive the water line along the side of a heaving
    spar, because there is fluid only below it and the sum points down: the spar had twice its resistance and 1.3 times its
    added mass."""
    dim = position.shape[1]
    r, s, lever = np.zeros(3), np.zeros(3), np.zeros(dim)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for b in range(bounds[c], bounds[c + 1]):
            o = owner[b]
            level = 0.0
            for d in range(dim):
                lever[d] = shepard[b, first + d]
                level += body_force[d] * lever[d]
            if still[o]:
                lift[b] = density * level
                continue
            w = twist[o, 3:]
            for d in range(dim):
                axis = 2 if d == dim - 1 else d
                r[axis] = position[b, d] - centre[o, axis]
            for d in range(3):
                s[d] = w[(d + 1) % 3] * r[(d + 2) % 3] - w[(d + 2) % 3] * r[(d + 1) % 3]
            if order[b] >= fixed:
                _project(lever, normal[order[b] - fixed])
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
def make_force(lanes: int, dim: int):
    """Force of the pressures (rows, 1) of the fluid on each boundary particle of an owner from `least` on, into `force`
    (b, DIM): the exact opposite of its forces on the fluid."""
    L, DIM = lanes, dim
    (X,) = columns.field(dim).of("x")

    def hold(s, rows, pressures):
        return own_vector(rows, s, X, L, DIM), own(pressures, s, 0, L)

    def empty(rows):
        return (zero_vector(rows, L, DIM),)

    def pair(sums, mine, j, rows, pressures, k):
        (total,), (x_i, p_i) = sums, mine
        x_ij = x_i - other_vector(rows, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(total, pressure_gradient(f, p_i, other(pressures, j, 0, L), x_ij)),)

    def finish(i, sums, first, force, k):
        (total,) = sums
        for d in range(DIM):
            force[i - first, d] = k.mass * k.gradient_factor * total[d]

    return over_pairs(
        "press", (lanes, dim), takes="first rows pressures owner least force k", sum=Sum(hold, empty, ((FLUID, pair),), finish),
        where=belongs,
    )  # fmt: skip


@exact
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
