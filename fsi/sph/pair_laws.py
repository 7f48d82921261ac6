"""The viscosity of a pair: the law of its liquid at the shear rate of the pair itself.

A mean of two viscosities, each at the shear rate of its particle, misplaces the surface where a plastic yields by a spacing or
two. As in finite volumes, a pair of one liquid takes the mean G of both velocity gradients, scaled and then corrected along
x_ij so that it gives the difference of the two velocities,

    G' = l G + c x_ij^T,  l = (u_ij . G x_ij + e) / (|G x_ij|^2 + e),  c = (u_ij - l G x_ij) / r^2,  e = r^2 G : G / 20,

l from 0 to 2, and the shear rate s of G', s^2 = 2 S' : S'. A rotating solid has none and a linear flow its own: l = 1, c = 0.
Beside a yield surface, where s vanishes, G is a mean over the support and far above the rate between the two; l takes that
back for pairs aslant the shear too, which c does along x_ij alone. Where two liquids meet, the harmonic mean stays. The
viscosity of a particle at a wall is the law at the mean of s over its pairs with the wall, weighed by their shares a r^2 of
the Laplacian's second moment.

Weights are taken over the mean of the parts of the support that the two have filled, at least LEAST_FILLED: particles out of
order fill 5 % less than a lattice and would resist as much less, and a top row meets half of the pairs across a plane below
it, whose stress would have to be twice as large: more than mu(I) can give. All is symmetric in i and j: the forces of a pair
cancel.
"""

from __future__ import annotations

from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lanes import (
    component,
    dot,
    load,
    maximum,
    minimum,
    other,
    other_vector,
    own,
    own_vector,
    sqrt,
    store,
    zero,
)
from fsi.compute.pairs import FLUID, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.terms import closeness, laplacian_weight, mean_viscosity, slope
from fsi.sph.viscosity import TINY, apparent_viscosity

SOME = 1e-20  # [m2], far below r^2 of any two particles
EVEN = 0.05  # share of r^2 G : G in e: G x_ij below that part of it says nothing of l
NONE = 1e-30  # [m2/s2]
FAR = 1e30  # weight a of a pair in reach times this exceeds any shear rate [1/s]


@cache
def make_pair_laws(lanes: int, dim: int, no_slip: bool):
    """a mu of the fluid's pairs into `weights`, L numbers for each entry of the lists, and the viscosity that particles show
    to walls into `flow`; `known` (rows, .): `columns.pair_law` of the fluid, `laws` as in `fsi.sph.viscosity.make_shear`."""
    L, DIM, Z = lanes, dim, dim - 1
    X, U, MU = columns.flow(dim).of("x u mu")
    FIRST, SECOND, LAST, FILLED, OWN, CONFINED, KIND = columns.pair_law(dim).of(
        "first second last filled mu confined kind"
    )

    @helper(lanes, dim)
    def rate_of(x_ij, r2, u_ij, g_x, g_y, g_z):
        """s of a pair, for the rows of its G."""
        x, z = component(x_ij, 0), component(x_ij, Z)
        over = 1.0 / (r2 + SOME)
        d_x, d_z = dot(g_x, x_ij), dot(g_z, x_ij)
        along, size = component(u_ij, 0) * d_x + component(u_ij, Z) * d_z, d_x * d_x + d_z * d_z
        even = dot(g_x, g_x) + dot(g_z, g_z)
        if DIM == 3:
            d_y = dot(g_y, x_ij)
            along, size, even = along + component(u_ij, 1) * d_y, size + d_y * d_y, even + dot(g_y, g_y)
        even = EVEN * r2 * even + NONE
        scale = minimum(2.0, maximum(0.0, (along + even) / (size + even)))
        c_x, c_z = (component(u_ij, 0) - scale * d_x) * over, (component(u_ij, Z) - scale * d_z) * over
        xx, zz = scale * component(g_x, 0) + c_x * x, scale * component(g_z, Z) + c_z * z
        xz = scale * (component(g_x, Z) + component(g_z, 0)) + c_x * z + c_z * x
        total = 2.0 * (xx * xx + zz * zz) + xz * xz
        if DIM == 3:
            y = component(x_ij, 1)
            c_y = (component(u_ij, 1) - scale * d_y) * over
            yy = scale * component(g_y, 1) + c_y * y
            xy = scale * (component(g_x, 1) + component(g_y, 0)) + c_x * y + c_y * x
            yz = scale * (component(g_y, Z) + component(g_z, 1)) + c_y * z + c_z * y
            total = total + (2.0 * (yy * yy) + xy * xy + yz * yz)
        return sqrt(total)

    @helper()
    def viscosity_of(rate, i, j, known, laws):
        q = int(known[i, KIND])
        if q != int(known[j, KIND]):
            return mean_viscosity(known[i, OWN], known[j, OWN])
        return apparent_viscosity(rate, 0.5 * (known[i, CONFINED] + known[j, CONFINED]), laws[q]) + laws[q, 0] * rate

    def hold(s, flow, known):
        g_x, g_z = own_vector(known, s, FIRST, L, DIM), own_vector(known, s, LAST, L, DIM)
        g_y = own_vector(known, s, SECOND, L, DIM) if DIM == 3 else g_x
        x_i, u_i, m_i = own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM), own(known, s, FILLED, L)
        return s, x_i, u_i, g_x, g_y, g_z, m_i

    def empty(flow):
        return zero(flow, L), zero(flow, L)

    def fluid_pair(sums, mine, j, n, flow, known, laws, weights, k):
        s, x_i, u_i, g_x, g_y, g_z, m_i = mine
        x_ij, u_ij = x_i - other_vector(flow, j, X, L, DIM), u_i - other_vector(flow, j, U, L, DIM)
        r2 = dot(x_ij, x_ij)
        a = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2)
        h_x, h_z = other_vector(known, j, FIRST, L, DIM), other_vector(known, j, LAST, L, DIM)
        h_y = other_vector(known, j, SECOND, L, DIM) if DIM == 3 else h_x
        rate = rate_of(x_ij, r2, u_ij, (g_x + h_x) * 0.5, (g_y + h_y) * 0.5, (g_z + h_z) * 0.5)
        store(weights, n * L, minimum(maximum(rate, TINY), a * FAR))  # 0 out of reach
        for lane in range(L):
            if weights[n * L + lane] > 0.0:
                weights[n * L + lane] = viscosity_of(weights[n * L + lane], s + lane, j, known, laws)
        store(weights, n * L, load(weights, n * L, L) * (2.0 * a / (m_i + other(known, j, FILLED, L))))
        return sums

    def wall_pair(sums, mine, j, flow, k):
        (total, weight), (_, x_i, u_i, g_x, g_y, g_z, _) = sums, mine
        x_ij, u_ij = x_i - other_vector(flow, j, X, L, DIM), u_i - other_vector(flow, j, U, L, DIM)
        r2 = dot(x_ij, x_ij)
        w = laplacian_weight(slope(closeness(r2, k.inverse_support)), r2, k.eta2) * r2
        return total + w * rate_of(x_ij, r2, u_ij, g_x, g_y, g_z), weight + w

    def finish(i, sums, flow, known, laws):
        total, weight = sums
        if weight > 0.0:
            rate, q = total / weight, int(known[i, KIND])
            mu = apparent_viscosity(rate, known[i, CONFINED], laws[q]) + laws[q, 0] * rate
            flow[i, MU] = mu / known[i, FILLED]

    passes = ((FLUID, fluid_pair), (WALLS, wall_pair)) if no_slip else ((FLUID, fluid_pair),)
    return over_pairs(
        "pair_laws", (lanes, dim, no_slip), takes="flow known laws weights k", sum=Sum(hold, empty, passes, finish)
    )
