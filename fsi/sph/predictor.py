"""The predictor: viscosity and body forces, and the coefficients of the pressure equation.

Rows are those of `fsi.sph.columns`. Sums over a group's list run in vector lanes; what follows for each particle is plain
scalar code. A factory returns the sweep for its arguments; a term that is switched off there is not compiled.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import at, claim, dot, other, other_vector, own, own_vector, store, zero, zero_vector
from fsi.sph import columns
from fsi.sph.columns import DEFICIT, DIAGONAL, INNER, SUPPORT
from fsi.sph.terms import (
    artificial_viscosity,
    closeness,
    kernel,
    laplacian_weight,
    lightness,
    partner,
    slope,
    viscous,
)


@helper()
def surface_gate(position_divergence):
    """1 at the free surface, 0 inside, from div r / dim: below 0.78 and above 0.88."""
    return min(1.0, max(0.0, (0.88 - position_divergence) / 0.1))


@cache
def make_predictor(lanes: int, dim: int, viscosity: str, artificial: bool, shifted: bool, dense: bool, surface: bool):
    """Viscosity and gravity (`body_force`) turn `velocity` into the trial velocity u*; the same pass collects the coefficients
    of the pressure equation: the diagonal, with the missing support of the free surface as particles at p = 0, and the
    deficit of the density against the lattice's. `viscosity`: "none", "no_slip" where walls drag, "free_slip". Without a
    `surface` a gap between particles is no free surface, and the shift closes it.

    The loop is written out: made by `over_pairs`, the products of artificial viscosity round otherwise in the last bit,
    and existing results would change."""
    L, DIM = lanes, dim
    X, U, R = columns.flow(dim).of("x u r")
    U_NEW, FILLED = columns.trial(dim).of("u filled")
    no_slip, free_slip = viscosity == "no_slip", viscosity == "free_slip"

    @compiled(lanes, dim, viscosity, artificial, shifted, dense, surface)
    def predict(counter, bounds, groups, flow, trial, velocity, coefficients, body_force, k, dt):
        offset, count, group, span, list_offset, lst = groups
        t_ = np.empty((4 + DIM) * L, flow.dtype)
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i = own_vector(flow, s, X, L, DIM)
                if no_slip or free_slip or artificial:
                    u_i = own_vector(flow, s, U, L, DIM)
                laplacian, density, spread = zero(flow, L), zero(flow, L), zero(flow, L)
                force = zero_vector(flow, L, DIM)
                if dense:
                    r_i, linked = own(flow, s, R, L), zero(flow, L)
                for n in range(base + span[g, 0], base + span[g, 2]):
                    j = at(lst, n)
                    x_ij = x_i - other_vector(flow, j, X, L, DIM)
                    r2 = dot(x_ij, x_ij)
                    t = closeness(r2, k.inverse_support)
                    f = slope(t)
                    a = laplacian_weight(f, r2, k.eta2)
                    laplacian = laplacian + a
                    if dense:
                        linked = linked + a * lightness(r_i, partner(r_i, other(flow, j, R, L)))
                    density = density + kernel(t)
                    spread = spread + f * r2
                    if no_slip:
                        force = force + viscous(a, u_i - other_vector(flow, j, U, L, DIM)) * k.viscous_factor
                if artificial or free_slip:
                    for n in range(base + span[g, 0], base + span[g, 1]):
                        j = at(lst, n)
                        x_ij = x_i - other_vector(flow, j, X, L, DIM)
                        u_ij = u_i - other_vector(flow, j, U, L, DIM)
                        r2 = dot(x_ij, x_ij)
                        f = slope(closeness(r2, k.inverse_support))
                        if artificial:
                            damping = artificial_viscosity(f, r2, k.eta2, u_ij, x_ij) * k.artificial_factor
                            if dense:
                                r_j = other(flow, j, R, L)
                                damping = damping * (r_j * lightness(r_i, r_j))
                            force = force + damping
                        if free_slip:
                            force = force + viscous(laplacian_weight(f, r2, k.eta2), u_ij) * k.viscous_factor
                store(t_, 0, laplacian)
                store(t_, L, density)
                store(t_, 2 * L, spread)
                store(t_, 3 * L, force)
                if dense:
                    store(t_, (3 + DIM) * L, linked)
                for i in range(s, e):
                    m = i - s
                    a_ii = k.laplacian_factor * t_[m]
                    filled = k.divergence_factor * t_[2 * L + m] / DIM
                    gate = surface_gate(filled) if surface else 0.0
                    missing = max(0.0, k.lattice_laplacian - a_ii)
                    deficit = 1.0 - k.density_factor * t_[L + m]
                    if dense:
                        a_ii, missing = k.laplacian_factor * t_[(3 + DIM) * L + m], missing / flow[i, R]
                    coefficients[i, DIAGONAL] = a_ii + k.surface_factor * gate * missing
                    coefficients[i, INNER] = 1.0 - gate
                    coefficients[i, DEFICIT] = min(deficit, 0.0) + k.suction * (1.0 - gate) * max(deficit, 0.0)
                    if shifted:
                        inside = min(1.0, max(0.0, (filled - 0.93) / 0.04)) if surface else 1.0
                        coefficients[i, SUPPORT] = inside
                        if surface:
                            trial[i, FILLED] = filled
                    for d in range(DIM):
                        velocity[i, d] += dt * (body_force[d] - t_[(3 + d) * L + m])
                        trial[i, U_NEW + d] = velocity[i, d]

    return predict
