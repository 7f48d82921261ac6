"""The predictor: viscosity and body forces, and the coefficients of the pressure equation.

Rows are those of `fsi.sph.columns`; how a sweep is made of its functions is told in `fsi.compute.pairs`.
"""

from __future__ import annotations

from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lane_sums import plus
from fsi.compute.lanes import component, dot, other, other_vector, own, own_vector, sqrt, zero, zero_vector
from fsi.compute.pairs import ALL, FLUID, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.columns import COUNTS, DEFICIT, DIAGONAL, INNER, SUPPORT
from fsi.sph.kernel import FADE
from fsi.sph.terms import (
    artificial_viscosity,
    closeness,
    kernel,
    laplacian_weight,
    lightness,
    partner,
    slope,
    unresolved,
    viscous,
)

SPRAY = 0.45  # filled part of the support up to which a particle belongs to no surface
FLAT = 0.3  # of the way from row to row over which the excess stays, so that small motions of a row do not change it


@helper()
def surface_excess(filled, p, k):
    """By how much more than once a particle's pressure counts in the gradient (`fsi.sph.kernel.surface_rows`), from the filled
    part of its support: `excess1` to `excess3` in the top rows under a free surface, 0 inside and in spray. It fades where
    the last pressure p is that of more than a few rows of water: in jets and drops that hit something it would do work."""
    if filled >= 1.0 or filled <= SPRAY:
        return 0.0
    share = min(1.0, max(0.0, 2.0 - abs(p) / k.shallow))
    near1, near2, near3 = FLAT * (k.filled2 - k.filled1), FLAT * (k.filled3 - k.filled2), FLAT * (k.filled4 - k.filled3)
    if filled < k.filled1 - near1:
        return share * k.excess1 * (filled - SPRAY) / (k.filled1 - near1 - SPRAY)
    if filled < k.filled1 + near1:
        return share * k.excess1
    if filled < k.filled2 - near1:
        between = (filled - k.filled1 - near1) / (k.filled2 - k.filled1 - 2.0 * near1)
        return share * (k.excess1 + (k.excess2 - k.excess1) * between)
    if filled < k.filled2 + near2:
        return share * k.excess2
    if filled < k.filled3 - near2:
        between = (filled - k.filled2 - near2) / (k.filled3 - k.filled2 - 2.0 * near2)
        return share * (k.excess2 + (k.excess3 - k.excess2) * between)
    if filled < k.filled3 + near3:
        return share * k.excess3
    return share * k.excess3 * max(0.0, (k.filled4 - near3 - filled) / max(1e-6, k.filled4 - k.filled3 - 2.0 * near3))


@helper()
def surface_gate(filled, inside):
    """1 at the free surface, 0 from `inside` on (`fsi.sph.kernel.innermost`), by the filled part of the support div r / dim."""
    return min(1.0, max(0.0, (inside - filled) / FADE))


@cache
def make_predictor(
    lanes: int, dim: int, viscosity: str, artificial: str, shifted: bool, dense: bool, surface: bool
):  # fmt: skip
    """Viscosity and gravity (`body_force`) turn `velocity` into the trial velocity u*; the same pass collects the coefficients
    of the pressure equation: the diagonal, with the missing support of the free surface as particles at p = 0, and the
    deficit of the density against the lattice's, and how often its pressure counts. For that, walls beside and above a
    particle are no room for rows, but a bed below is as good as water: they count by (1 + cosine of the way up)^2, which
    is 1 + 1 / dim on average; up is against the body forces. `viscosity`: "none", "no_slip" where walls drag, "free_slip";
    `artificial` viscosity: "none", "linear" of what a velocity that is linear in space leaves, by the `strains` (rows, .) of
    `columns.strain`, "whole" of all. No sum depends on neighbours out of reach, not in its last bit either.
    Without a `surface` a gap between particles is no free surface, and the shift closes it."""
    L, DIM, Z = lanes, dim, dim - 1
    X, U, R = columns.flow(dim).of("x u r")
    U_NEW, FILLED, P = columns.trial(dim).of("u filled p")
    TENSOR = columns.strain(dim).width("tensor")
    no_slip, free_slip, reconstructed = viscosity == "no_slip", viscosity == "free_slip", artificial == "linear"

    def hold(s, flow, strains):
        moves = no_slip or free_slip or artificial != "none"
        u_i = own_vector(flow, s, U, L, DIM) if moves else zero_vector(flow, L, DIM)
        s_i = own_vector(strains, s, 0, L, TENSOR) if reconstructed else zero_vector(flow, L, TENSOR)
        return own_vector(flow, s, X, L, DIM), u_i, own(flow, s, R, L) if dense else zero(flow, L), s_i

    def empty(flow):
        return zero(flow, L), zero(flow, L), zero(flow, L), zero_vector(flow, L, DIM), zero(flow, L), zero(flow, L)

    @helper()
    def stretching(strain, x_ij):
        """x_ij . S x_ij, S being half of this sum of two strain rates."""
        x, z = component(x_ij, 0), component(x_ij, Z)
        along = component(strain, 0) * x * x + component(strain, Z) * z * z
        if DIM == 2:
            return along * 0.5 + component(strain, 2) * x * z
        y = component(x_ij, 1)
        beside = component(strain, 3) * x * y + component(strain, 4) * x * z + component(strain, 5) * y * z
        return (along + component(strain, 1) * y * y) * 0.5 + beside

    def pair(sums, mine, j, flow, k):
        (laplacian, density, spread, force, linked, solid), (x_i, u_i, r_i, _) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        t = closeness(r2, k.inverse_support)
        f = slope(t)
        a = laplacian_weight(f, r2, k.eta2)
        if dense:
            linked = plus(linked, a * lightness(r_i, partner(r_i, other(flow, j, R, L))))
        if no_slip:
            force = plus(force, viscous(a, u_i - other_vector(flow, j, U, L, DIM)) * k.viscous_factor)
        return plus(laplacian, a), plus(density, kernel(t)), plus(spread, f * r2), force, linked, solid

    def wall_pair(sums, mine, j, flow, k):
        (laplacian, density, spread, force, linked, solid), x_i = sums, mine[0]
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        r2 = dot(x_ij, x_ij)
        rise = sqrt(r2) - component(x_ij, 0) * k.up_x - component(x_ij, Z) * k.up_z  # r (1 + cosine)
        if DIM == 3:
            rise = rise - component(x_ij, 1) * k.up_y
        taken = slope(closeness(r2, k.inverse_support)) * rise * rise
        return laplacian, density, spread, force, linked, plus(solid, taken)

    def fluid_pair(sums, mine, j, flow, strains, k):
        (laplacian, density, spread, force, linked, solid), (x_i, u_i, r_i, s_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        u_ij = u_i - other_vector(flow, j, U, L, DIM)
        r2 = dot(x_ij, x_ij)
        f = slope(closeness(r2, k.inverse_support))
        if artificial != "none":
            approach = dot(u_ij, x_ij)
            if reconstructed:
                approach = unresolved(approach, stretching(s_i + other_vector(strains, j, 0, L, TENSOR), x_ij))
            damping = artificial_viscosity(f, r2, k.eta2, approach, x_ij) * k.artificial_factor
            if dense:
                r_j = other(flow, j, R, L)
                damping = damping * (r_j * lightness(r_i, r_j))
            force = plus(force, damping)
        if free_slip:
            force = plus(force, viscous(laplacian_weight(f, r2, k.eta2), u_ij) * k.viscous_factor)
        return laplacian, density, spread, force, linked, solid

    def finish(i, sums, flow, trial, velocity, coefficients, body_force, k, dt):
        laplacian, density, spread, force, linked, solid = sums
        a_ii = k.laplacian_factor * laplacian
        filled = k.divergence_factor * spread / DIM
        gate = surface_gate(filled, k.inside) if surface else 0.0
        missing = max(0.0, k.lattice_laplacian - a_ii)
        deficit = 1.0 - k.density_factor * density
        if dense:
            a_ii, missing = k.laplacian_factor * linked, missing / flow[i, R]
        coefficients[i, DIAGONAL] = a_ii + k.surface_factor * gate * missing
        coefficients[i, INNER] = 1.0 - gate
        coefficients[i, DEFICIT] = min(deficit, 0.0) + k.suction * (1.0 - gate) * max(deficit, 0.0)
        if surface:
            walled = k.divergence_factor * solid / (DIM + 1)  # part of the support that walls take
            free = (filled - walled) / max(0.1, 1.0 - walled)
            coefficients[i, COUNTS] = 1.0 + surface_excess(free, trial[i, P], k)
        if shifted:
            coefficients[i, SUPPORT] = min(1.0, max(0.0, (filled - 0.93) / 0.04)) if surface else 1.0
            if surface:
                trial[i, FILLED] = filled
        for d in range(DIM):
            velocity[i, d] += dt * (body_force[d] - force[d])
            trial[i, U_NEW + d] = velocity[i, d]

    by_fluid, by_walls = (fluid_pair,) * (artificial != "none" or free_slip), (wall_pair,) * surface
    passes = ((FLUID, pair, *by_fluid), (WALLS, pair, *by_walls)) if by_fluid or by_walls else ((ALL, pair),)
    return over_pairs(
        "predict", (lanes, dim, viscosity, artificial, shifted, dense, surface),
        takes="flow strains trial velocity coefficients body_force k dt", sum=Sum(hold, empty, passes, finish),
    )  # fmt: skip
