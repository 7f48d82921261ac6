"""The coefficient of Smagorinsky's eddies out of the flow itself (Germano et al. 1991; Lilly 1992, eq. 11), on particles.

The test filter <.> is the kernel's mean over the fluid around a particle. With the strain rate S, s = sqrt(2 S : S) and the
widths D of the particles and D' of the test filter,

    L = <u u> - <u><u>,   M = 2 (D^2 <s S> - D'^2 |<S>| <S>),   C_s^2 = <L : M> / <M : M>,   D'^2 = D^2 + 12 var,

var the variance of the kernel along an axis, which a box of the width sqrt(12 var) has too. Strain is filtered in place of
velocity: where the velocity is linear in space all of this is exact on any particles. L is taken of u_j - u_i, from which it
is the same, so that a fast stream costs no digits.
"""

from __future__ import annotations

import math
from functools import cache

from fsi.compute.lane_sums import small_matrix
from fsi.compute.lanes import component, dot, other, other_vector, own_vector, zero, zero_vector
from fsi.compute.pairs import FLUID, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.columns import Columns
from fsi.sph.terms import closeness, kernel

MOST = 0.25  # C_s^2 at most, that of the largest C_s that a scene may give
BOX = 12.0  # width^2 over variance of a box


TINY = 1e-30  # M : M below which there is no shear


@cache
def strain(dim: int) -> Columns:
    """The rows of the strain rate tensor of a fluid particle, and s."""
    return Columns(first=dim, second=dim * (dim == 3), last=dim, rate=1)


PRODUCTS = Columns(stress=1, model=1)  # L : M and M : M of a fluid particle


@cache
def make_leonard(lanes: int, dim: int):
    """L : M and M : M of the fluid particles into `products` (rows, 2), from the velocities in `flow` and the strain rates in
    `strains` (rows, .); `width2`: D^2 [m2]."""
    L, DIM, Z = lanes, dim, dim - 1
    X, U = columns.flow(dim).of("x u")
    FIRST, SECOND, LAST, RATE = strain(dim).of("first second last rate")
    STRESS, MODEL = PRODUCTS.of("stress model")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        none, no = zero(flow, L), zero_vector(flow, L, DIM)
        return none, none, no, no, no, no, no, no, no, no, no, no

    def pair(sums, mine, j, flow, strains, k):
        (total, spread, mean, ux, uy, uz, ax, ay, az, bx, by, bz), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        w = kernel(closeness(r2, k.inverse_support))
        u = other_vector(flow, j, U, L, DIM) - u_i
        wu, ws = u * w, w * other(strains, j, RATE, L)
        first, last = other_vector(strains, j, FIRST, L, DIM), other_vector(strains, j, LAST, L, DIM)
        if DIM == 3:
            second = other_vector(strains, j, SECOND, L, DIM)
            uy, ay, by = uy + wu * component(u, 1), ay + second * w, by + second * ws
        ux, ax, bx = ux + wu * component(u, 0), ax + first * w, bx + first * ws
        uz, az, bz = uz + wu * component(u, Z), az + last * w, bz + last * ws
        return total + w, spread + w * r2, mean + wu, ux, uy, uz, ax, ay, az, bx, by, bz

    def finish(i, sums, products, width2):
        total, spread, mean, ux, uy, uz, ax, ay, az, bx, by, bz = sums
        uu, S, sS = small_matrix(DIM, DIM), small_matrix(DIM, DIM), small_matrix(DIM, DIM)
        for b in range(DIM):
            uu[0, b], uu[Z, b] = ux[b] / total, uz[b] / total
            S[0, b], S[Z, b] = ax[b] / total, az[b] / total
            sS[0, b], sS[Z, b] = bx[b] / total, bz[b] / total
            if DIM == 3:
                uu[1, b], S[1, b], sS[1, b] = uy[b] / total, ay[b] / total, by[b] / total
        size = trace = 0.0
        for a in range(DIM):
            for b in range(DIM):
                size += S[a, b] * S[a, b]
        rate, test2 = math.sqrt(2.0 * size), width2 + BOX * spread / (DIM * total)
        for a in range(DIM):
            trace += 2.0 * (width2 * sS[a, a] - test2 * rate * S[a, a]) / DIM
        stress = model = 0.0
        for a in range(DIM):
            for b in range(DIM):
                m = 2.0 * (width2 * sS[a, b] - test2 * rate * S[a, b]) - (trace if a == b else 0.0)
                stress += m * (uu[a, b] - mean[a] * mean[b] / total**2)
                model += m * m
        products[i, STRESS], products[i, MODEL] = stress, model

    return over_pairs(
        "leonard", (lanes, dim), takes="flow strains products width2 k", sum=Sum(hold, empty, ((FLUID, pair),), finish)
    )


@cache
def make_coefficient(lanes: int, dim: int):
    """C_s^2 (n,) of the fluid particles into `coefficient`, both products averaged over the fluid around each, 0 to `MOST`;
    the eddies' viscosity rho C_s^2 D^2 s is added to that in `flow`. `density` (m,) of the liquids, `kind` (n,): the liquid
    of each."""
    L, DIM = lanes, dim
    X, MU = columns.flow(dim).of("x mu")
    STRESS, MODEL = PRODUCTS.of("stress model")
    (RATE,) = strain(dim).of("rate")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM)

    def empty(flow):
        return zero(flow, L), zero(flow, L)

    def pair(sums, x_i, j, flow, products, k):
        stress, model = sums
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
        return stress + w * other(products, j, STRESS, L), model + w * other(products, j, MODEL, L)

    def finish(i, sums, flow, strains, coefficient, kind, density, width2):
        stress, model = sums
        coefficient[i] = min(max(stress / model, 0.0), MOST) if model > TINY else 0.0
        flow[i, MU] += density[kind[i]] * coefficient[i] * width2 * strains[i, RATE]

    return over_pairs(
        "coefficient", (lanes, dim), takes="flow strains products coefficient kind density width2 k",
        sum=Sum(hold, empty, ((FLUID, pair),), finish),
    )  # fmt: skip
