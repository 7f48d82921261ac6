"""The coefficient of Smagorinsky's eddies out of the flow itself (Germano et al. 1991; Lilly 1992, eq. 11), on particles.

Particles carry velocities of their own, down to the spacing, that the strain rate S of the kernel does not see; in a decaying
Taylor-Green vortex they come to half of the energy, and C_s to three times its value. So both filters are the kernel's mean <.>
over the fluid around a particle, once for the scales that are resolved and once more for the test. With u~ = <u>, S~ = <S>,
s = sqrt(2 S~ : S~) and the width D of the particles,

    L = <u~ u~> - <u~><u~>,   M = 2 (D'^2 <s S~> - D''^2 |<S~>| <S~>),   C_s^2 = <L : M> / <M : M>,
    D'^2 = D^2 + 12 var,   D''^2 = D^2 + 24 var,

var the variance of the kernel along an axis, which a box of the width sqrt(12 var) has too. Strain is filtered in place of
velocity: where the velocity is linear in space S~ is exact on any particles, and u~ away from edges. L is taken of u~_j - u~_i,
from which it is the same, so that a fast stream costs no digits.
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
    """The rows of the strain rate tensor of a fluid particle, s, and, of means, the velocity."""
    return Columns(first=dim, second=dim * (dim == 3), last=dim, rate=1, u=dim)


PRODUCTS = Columns(stress=1, model=1)  # L : M and M : M of a fluid particle


@cache
def make_means(lanes: int, dim: int):
    """Strain rate, its s, and velocity of the fluid, averaged by the kernel, into `means` (rows, .); `strains` (rows, .): the
    strain rates of the particles."""
    L, DIM = lanes, dim
    X, U = columns.flow(dim).of("x u")
    FIRST, SECOND, LAST, RATE, MEAN = strain(dim).of("first second last rate u")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        none = zero_vector(flow, L, DIM)
        return zero(flow, L), none, none, none, none

    def pair(sums, mine, j, flow, strains, k):
        (total, mean, x, y, z), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        w = kernel(closeness(dot(x_ij, x_ij), k.inverse_support))
        if DIM == 3:
            y = y + other_vector(strains, j, SECOND, L, DIM) * w
        x, z = x + other_vector(strains, j, FIRST, L, DIM) * w, z + other_vector(strains, j, LAST, L, DIM) * w
        return total + w, mean + (other_vector(flow, j, U, L, DIM) - u_i) * w, x, y, z

    def finish(i, sums, flow, means):
        total, mean, x, y, z = sums
        size = 0.0
        for b in range(DIM):
            means[i, MEAN + b] = flow[i, U + b] + mean[b] / total
            means[i, FIRST + b], means[i, LAST + b] = x[b] / total, z[b] / total
            size += means[i, FIRST + b] ** 2 + means[i, LAST + b] ** 2
            if DIM == 3:
                means[i, SECOND + b] = y[b] / total
                size += means[i, SECOND + b] ** 2
        means[i, RATE] = math.sqrt(2.0 * size)

    return over_pairs(
        "means", (lanes, dim), takes="flow strains means k", sum=Sum(hold, empty, ((FLUID, pair),), finish)
    )


@cache
def make_leonard(lanes: int, dim: int):
    """L : M and M : M of the fluid particles into `products` (rows, 2), from the `means` (rows, .) of velocity and strain rate;
    `width2`: D^2 [m2]."""
    L, DIM, Z = lanes, dim, dim - 1
    (X,) = columns.flow(dim).of("x")
    FIRST, SECOND, LAST, RATE, U = strain(dim).of("first second last rate u")
    STRESS, MODEL = PRODUCTS.of("stress model")

    def hold(s, flow, means):
        return own_vector(flow, s, X, L, DIM), own_vector(means, s, U, L, DIM)

    def empty(flow):
        none, no = zero(flow, L), zero_vector(flow, L, DIM)
        return none, none, no, no, no, no, no, no, no, no, no, no

    def pair(sums, mine, j, flow, means, k):
        (total, spread, mean, ux, uy, uz, ax, ay, az, bx, by, bz), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        w = kernel(closeness(r2, k.inverse_support))
        u = other_vector(means, j, U, L, DIM) - u_i
        wu, ws = u * w, w * other(means, j, RATE, L)
        first, last = other_vector(means, j, FIRST, L, DIM), other_vector(means, j, LAST, L, DIM)
        if DIM == 3:
            second = other_vector(means, j, SECOND, L, DIM)
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
        rate, wider = math.sqrt(2.0 * size), BOX * spread / (DIM * total)
        once2, twice2 = width2 + wider, width2 + 2.0 * wider
        for a in range(DIM):
            trace += 2.0 * (once2 * sS[a, a] - twice2 * rate * S[a, a]) / DIM
        stress = model = 0.0
        for a in range(DIM):
            for b in range(DIM):
                m = 2.0 * (once2 * sS[a, b] - twice2 * rate * S[a, b]) - (trace if a == b else 0.0)
                stress += m * (uu[a, b] - mean[a] * mean[b] / total**2)
                model += m * m
        products[i, STRESS], products[i, MODEL] = stress, model

    return over_pairs(
        "leonard", (lanes, dim), takes="flow means products width2 k", sum=Sum(hold, empty, ((FLUID, pair),), finish)
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
