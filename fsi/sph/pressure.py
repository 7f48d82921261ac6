"""The pressure equation: its source, and the sweeps that update the pressure and its linear responses.

Rows are those of `fsi.sph.columns`; how a sweep is made of its functions is told in `fsi.compute.pairs`.
"""

from __future__ import annotations

from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lane_sums import plus
from fsi.compute.lanes import dot, fence, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import ALL, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.columns import DEFICIT, DIAGONAL, INNER, SOURCE
from fsi.sph.terms import closeness, divergence, laplacian_weight, lightness, partner, slope


@cache
def make_source(lanes: int, dim: int, dense: bool):
    """The source of the pressure equation, div u*/dt + gamma (1 - rho/rho_lattice)/dt^2, and its first sweep, from the
    pressures of `trial` into `field`: p + alpha (J(p) - p), J(p) = (sum a_ij p_j - s_i) / a_ii (`fsi.fluid.chebyshev`).
    `before`, which may be `field`, keeps p for the next sweep."""
    L, DIM = lanes, dim
    X, P, U, R = columns.trial(dim).of("x p u r")

    def hold(s, trial):
        r_i = own(trial, s, R, L) if dense else zero(trial, L)
        return own_vector(trial, s, X, L, DIM), own_vector(trial, s, U, L, DIM), r_i

    def empty(trial):
        return zero(trial, L), zero(trial, L)

    def pair(sums, mine, j, trial, k):
        (outflow, pull), (x_i, u_i, r_i) = sums, mine
        x_ij = x_i - other_vector(trial, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        f = slope(closeness(r2, k.inverse_support))
        a = laplacian_weight(f, r2, k.eta2)
        out = divergence(f, u_i - other_vector(trial, j, U, L, DIM), x_ij)
        if dense:
            r_j = partner(r_i, other(trial, j, R, L))
            a, out = a * lightness(r_i, r_j), out * (r_j * lightness(r_i, r_j))
        return outflow + out, pull + a * other(trial, j, P, L)

    def finish(i, sums, trial, field, before, coefficients, k, dt, alpha):
        outflow, pull = sums
        deficit = coefficients[i, DEFICIT] + k.draw * coefficients[i, INNER]
        s_i = k.divergence_factor * outflow / dt + k.relaxation * deficit / (dt * dt)
        coefficients[i, SOURCE] = s_i
        p, jacobi = trial[i, P], (k.laplacian_factor * pull - s_i) / coefficients[i, DIAGONAL]
        inner = coefficients[i, INNER]
        before[i, P] = p
        field[i, P] = p + (1.0 + inner * (alpha - 1.0)) * (jacobi - p)

    return over_pairs(
        "source", (lanes, dim, dense), takes="trial field before coefficients k dt alpha",
        sum=Sum(hold, empty, ((ALL, pair),), finish),
    )  # fmt: skip


@cache
def make_weight(lanes: int, dim: int, dense: bool):
    """The weight of a neighbour's pressure, a_ij over `laplacian_factor`, for rows of `field`."""
    L, DIM = lanes, dim
    X, R = columns.field(dim).of("x r")

    @helper(lanes, dim, dense)
    def weight(field, x_i, r_i, j, k):
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        if dense:
            a = a * lightness(r_i, partner(r_i, other(field, j, R, L)))
        return a

    return weight


@cache
def make_sweep(lanes: int, dim: int, dense: bool, responses: int = 0):
    """One more sweep, from the pressures of `field` into `new`, which holds those before: p + alpha (J(p) - p) +
    beta (p - p_before) inside, plain J(p) at the free surface and in spray. So many linear responses in `response` (n, m)
    are taken along into `new_response`, in the groups that touch the box `low` to `high` (`fsi.fluid.response`); they
    have no source, and the pressure has the same bits with and without them."""
    L, DIM, M = lanes, dim, responses
    X, P, R = columns.field(dim).of("x p r")
    weight = make_weight(lanes, dim, dense)

    def hold(s, field):
        return own_vector(field, s, X, L, DIM), own(field, s, R, L) if dense else zero(field, L)

    def empty(field):
        return (zero(field, L),)

    def pair(sums, mine, j, field, k):
        (pull,), (x_i, r_i) = sums, mine
        return (plus(pull, fence(weight(field, x_i, r_i, j, k)) * other(field, j, P, L)),)

    @helper(lanes, dim, dense, responses)
    def relax(i, pull, field, new, coefficients, k, alpha, beta):
        jacobi = (k.laplacian_factor * pull - coefficients[i, SOURCE]) / coefficients[i, DIAGONAL]
        p = field[i, P]
        inner = coefficients[i, INNER]
        step, back = fence(1.0 + inner * (alpha - 1.0)), fence(inner * beta)
        new[i, P] = p + step * (jacobi - p) + back * (p - new[i, P])
        return step, back

    def finish(i, sums, field, new, coefficients, k, alpha, beta):
        relax(i, sums[0], field, new, coefficients, k, alpha, beta)

    def empty_too(field):
        return zero(field, L), zero_vector(field, L, M)

    def pair_too(sums, mine, j, field, k, response):
        (pull, pulls), (x_i, r_i) = sums, mine
        a = fence(weight(field, x_i, r_i, j, k))
        return plus(pull, a * other(field, j, P, L)), pulls + a * other_vector(response, j, 0, L, M)

    def finish_too(i, sums, field, new, coefficients, k, alpha, beta, response, new_response):
        pull, pulls = sums
        step, back = relax(i, pull, field, new, coefficients, k, alpha, beta)
        for m in range(M):
            q, jacobi = response[i, m], k.laplacian_factor * pulls[m] / coefficients[i, DIAGONAL]
            new_response[i, m] = q + step * (jacobi - q) + back * (q - new_response[i, m])

    def where(s, e, field, low, high, k):
        return touches(field, s, e, low, high, 1.0 / k.inverse_support)

    plain = Sum(hold, empty, ((ALL, pair),), finish)
    both = {"sum": Sum(hold, empty_too, ((ALL, pair_too),), finish_too), "where": where, "otherwise": plain}
    return over_pairs(
        "sweep", (lanes, dim, dense, responses), **(both if responses else {"sum": plain}),
        takes="field new coefficients k alpha beta response new_response low high",
    )  # fmt: skip


@cache
def make_onset(lanes: int, dim: int, dense: bool, responses: int):
    """The first sweep of the responses, in which only the boundary acts, into the fluid's rows of `response` (n, m)."""
    L, DIM, M = lanes, dim, responses
    X, R = columns.field(dim).of("x r")
    weight = make_weight(lanes, dim, dense)

    def where(s, e, walls_from, walls_to, field, low, high, k):
        return walls_from < walls_to and touches(field, s, e, low, high, 1.0 / k.inverse_support)

    def hold(s, field):
        return own_vector(field, s, X, L, DIM), own(field, s, R, L) if dense else zero(field, L)

    def empty(field):
        return (zero_vector(field, L, M),)

    def pair(sums, mine, j, field, response, k):
        (pulls,), (x_i, r_i) = sums, mine
        return (pulls + weight(field, x_i, r_i, j, k) * other_vector(response, j, 0, L, M),)

    def finish(i, sums, coefficients, k, alpha, response):
        (pulls,) = sums
        step = 1.0 + coefficients[i, INNER] * (alpha - 1.0)
        for m in range(M):
            response[i, m] = step * k.laplacian_factor * pulls[m] / coefficients[i, DIAGONAL]

    return over_pairs(
        "onset", (lanes, dim, dense, responses), takes="field coefficients k alpha response low high",
        sum=Sum(hold, empty, ((WALLS, pair),), finish), where=where,
    )  # fmt: skip


@helper()
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
