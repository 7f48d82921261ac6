"""The end of a step: the pressure gradient, and with it all that moves the particles (`fsi.sph.advance`).

Rows are those of `fsi.sph.columns`; how a sweep is made of its functions is told in `fsi.compute.pairs`.
"""

from __future__ import annotations

from functools import cache

from fsi.compute.lane_sums import plus
from fsi.compute.lanes import dot, minimum, other, other_vector, own, own_vector, zero, zero_vector
from fsi.compute.pairs import ALL, FLUID, WALLS, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.advance import make_advance
from fsi.sph.terms import closeness, interface_gradient, partner, pressure_gradient, slope


@cache
def make_corrector(
    lanes: int, dim: int, guarded: bool, sponge: bool, shifted: bool, dense: bool, surface: bool
):  # fmt: skip
    """The pressure gradient gives the new velocity, and that the new position, x += dt u_new.

    The wall guard bends the way of a fluid particle that would end too close to wall particles (`fsi.sph.wall_guard`); the
    impulse is handed to the owners of the wall particles in `impulse` (chunks, owners, 6), force part first, moment about
    `centre` (owners, DIM), `counted` in whole units where it is asked for (`fsi.sph.wall_guard`). The shift, which carries no
    momentum, is bent likewise.
    In the sponge u' = -rate s^2 u, with s from 0 at the start to 1 at the end of each of the zones (z, 4) [axis, start,
    end, rate]. With a `surface`, `field` holds pressures times how often they count. No sum
    depends on neighbours out of reach, not in its last bit either. `totals` (chunks, .): the columns of
    `columns.corrector_sums`."""
    L, DIM, edged = lanes, dim, shifted and surface
    X, P, R = columns.field(dim).of("x p r")
    (FILLED,) = columns.trial(dim).of("filled")

    def start(chunk, impulse, totals):
        impulse[chunk] = 0
        totals[chunk] = 0.0

    def hold(s, trial, field):
        r_i = own(field, s, R, L) if dense else zero(field, L)
        full = own(trial, s, FILLED, L) if edged else zero(field, L)
        return own_vector(field, s, X, L, DIM), own(field, s, P, L), r_i, full

    def empty(field, k):
        return (
            zero_vector(field, L, DIM),
            zero_vector(field, L, DIM),
            zero_vector(field, L, DIM),
            zero(field, L) + k.guard2,
        )

    def pair(sums, mine, j, field, k):
        (force, sparse, outward, nearest), (x_i, p_i, r_i, _) = sums, mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        if dense:
            r_j = partner(r_i, other(field, j, R, L))
            force = plus(force, interface_gradient(f, p_i, other(field, j, P, L), r_i, r_j, x_ij))
        else:
            force = plus(force, pressure_gradient(f, p_i, other(field, j, P, L), x_ij))
        if shifted:
            sparse = plus(sparse, x_ij * f)
        return force, sparse, outward, nearest

    def surface_pair(sums, mine, j, trial, field, k):
        (force, sparse, outward, nearest), (x_i, _, _, full) = sums, mine
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        f = slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        return force, sparse, plus(outward, x_ij * (f * (other(trial, j, FILLED, L) - full))), nearest

    def wall_pair(sums, mine, j, field):
        (force, sparse, outward, nearest), x_i = sums, mine[0]
        x_ij = x_i - other_vector(field, j, X, L, DIM)
        return force, sparse, outward, minimum(nearest, dot(x_ij, x_ij))

    def after(sums, mine):
        (force, sparse, outward, nearest), r_i = sums, mine[2]
        return force / r_i, sparse, outward, nearest

    by_fluid, by_walls = (surface_pair,) * edged, (wall_pair,) * guarded
    passes = ((FLUID, pair, *by_fluid), (WALLS, pair, *by_walls)) if by_fluid or by_walls else ((ALL, pair),)
    finish = make_advance(dim, guarded, sponge, shifted, dense, surface)
    return over_pairs(
        "correct", (lanes, dim, guarded, sponge, shifted, dense, surface), start=start,
        sum=Sum(hold, empty, passes, finish, after if dense else None),
        takes="trial field coefficients label position velocity pressure body_force k dt zones first boundary "
        "boundary_velocity owner centre impulse totals",
    )  # fmt: skip
