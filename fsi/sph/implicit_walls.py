"""The sums over pairs of the boundary particles of `fsi.sph.implicit`, whose symbols these are: what the fluid does to them,
and the part of a support that a layer fills.
"""

from __future__ import annotations

from functools import cache

from fsi.compute.lane_sums import plus
from fsi.compute.lanes import dot, maximum, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import FLUID, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.implicit import make_pressing
from fsi.sph.shapes import functions
from fsi.sph.terms import artificial_viscosity, closeness
from fsi.sph.walls import belongs


@cache
def make_force(lanes: int, dim: int, kernel: str, column: int, linear: bool):
    """Pressure force of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM), for the
    pressure in a column of `values`, or the change by that; psi (b,). The exact opposite of its forces on the fluid."""
    L, DIM, P = lanes, dim, column
    pressing = make_pressing(dim, linear)
    (X,) = columns.field(dim).of("x")
    _, slope = functions(kernel)

    def hold(s, rows):
        return own_vector(rows, s, X, L, DIM)

    def empty(rows):
        return (zero_vector(rows, L, DIM),)

    def pair(sums, x_i, j, rows, values, k):
        x_ij = x_i - other_vector(rows, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return (plus(sums[0], x_ij * (f * pressing(other(values, j, P, L), x_ij * -1.0, k))),)

    def finish(i, sums, first, psi, force, k):
        factor = k.mass * k.gradient_factor * psi[i - first]
        for d in range(DIM):
            force[i - first, d] = factor * sums[0][d]

    return over_pairs(
        "implicit_press", (lanes, dim, kernel, column, linear), takes="first rows values owner least psi force k",
        sum=Sum(hold, empty, ((FLUID, pair),), finish), where=belongs,
    )  # fmt: skip


@cache
def make_friction(lanes: int, dim: int, kernel: str):
    """Friction of the fluid on each boundary particle of an owner from `least` on, into `force` (b, DIM)."""
    L, DIM = lanes, dim
    X, U = columns.flow(dim).of("x u")
    _, slope = functions(kernel)

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        return (zero_vector(flow, L, DIM),)

    def pair(sums, mine, j, flow, k):
        x_i, u_i = mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        f = slope(closeness(r2, k.inverse_support))
        approach = dot(u_i - other_vector(flow, j, U, L, DIM), x_ij)
        return (plus(sums[0], artificial_viscosity(f, r2, k.eta2, approach, x_ij)),)

    def finish(i, sums, first, psi, force, k):
        for d in range(DIM):
            force[i - first, d] = -k.mass * k.friction_factor * psi[i - first] * sums[0][d]

    return over_pairs(
        "implicit_friction", (lanes, dim, kernel), takes="first flow owner least psi force k",
        sum=Sum(hold, empty, ((FLUID, pair),), finish), where=belongs,
    )  # fmt: skip


@cache
def make_layer_sum(lanes: int, dim: int, kernel: str):
    """sum W / alpha over the boundary particles of the same owner around each, itself included, into `total` (b,); `rows` of x
    and the number of the owner."""
    L, DIM = lanes, dim
    X, OWNER = columns.field(dim).of("x p")
    value, _ = functions(kernel)

    def hold(s, rows):
        return own_vector(rows, s, X, L, DIM), own(rows, s, OWNER, L)

    def empty(rows):
        return (zero(rows, L),)

    def pair(sums, mine, j, rows, k):
        x_i, o_i = mine
        x_ij = x_i - other_vector(rows, j, X, L, DIM)
        apart = o_i - other(rows, j, OWNER, L)
        return (
            plus(sums[0], value(closeness(dot(x_ij, x_ij), k.inverse_support)) * maximum(0.0, 1.0 - apart * apart)),
        )

    def finish(i, sums, total):
        total[i] = sums[0]

    return over_pairs(
        "layer_sum", (lanes, dim, kernel), takes="rows total k", sum=Sum(hold, empty, ((FLUID, pair),), finish)
    )
