"""The velocity gradient of the fluid, exact where the velocity is linear in space, at its edges too."""

from __future__ import annotations

from functools import cache

from fsi.compute.jit import helper
from fsi.compute.lane_sums import plus, small_matrix
from fsi.compute.lanes import component, dot, other_vector, own_vector, zero, zero_vector
from fsi.compute.pairs import FLUID, Sum, over_pairs
from fsi.sph import columns
from fsi.sph.terms import closeness, slope

WELL_SPREAD = (
    0.02  # of neighbours: determinant of their moments over that of equal moments, 1 on a lattice, 0 on a line
)


@helper()
def corrected(G, M, gradient):
    """The velocity gradient G M^-1 into `gradient`, G[a, b] = sum V F u_ij,a x_ij,b, M the same of x_ij (Randles & Libersky
    1996); G itself where the neighbours are nearly in a line or plane. 2 x 2 or 3 x 3."""
    dim = G.shape[0]
    inverse = small_matrix(3, 3)
    if dim == 2:
        det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        inverse[0, 0], inverse[1, 1] = M[1, 1], M[0, 0]
        inverse[0, 1], inverse[1, 0] = -M[0, 1], -M[1, 0]
    else:
        for a in range(3):
            for b in range(3):
                p, q, r, s = (b + 1) % 3, (b + 2) % 3, (a + 1) % 3, (a + 2) % 3
                inverse[a, b] = M[p, r] * M[q, s] - M[p, s] * M[q, r]
        det = M[0, 0] * inverse[0, 0] + M[0, 1] * inverse[1, 0] + M[0, 2] * inverse[2, 0]
    even = 0.0
    for a in range(dim):
        even += M[a, a] / dim
    spread = det > WELL_SPREAD * even**dim
    for a in range(dim):
        for b in range(dim):
            gradient[a, b] = 0.0 if spread else G[a, b]
            if spread:
                for c in range(dim):
                    gradient[a, b] += G[a, c] * inverse[c, b] / det


@cache
def gradient_sums(lanes: int, dim: int):
    """What a kernel over pairs is made of that needs the velocity gradient: `hold`, `empty` and `pair`, and `solve(sums, M,
    gradient, k)`, which fills the moments of the neighbours and the gradient, see `corrected`, in its `finish`."""
    L, DIM, Z = lanes, dim, dim - 1
    X, U = columns.flow(dim).of("x u")

    def hold(s, flow):
        return own_vector(flow, s, X, L, DIM), own_vector(flow, s, U, L, DIM)

    def empty(flow):
        none, no = zero_vector(flow, L, DIM), zero(flow, L)
        return none, none, none, none, no, no, no

    def pair(sums, mine, j, flow, k):
        (gx, gy, gz, mx, yy, yz, zz), (x_i, u_i) = sums, mine
        x_ij = x_i - other_vector(flow, j, X, L, DIM)
        u_ij = u_i - other_vector(flow, j, U, L, DIM)
        fx = x_ij * slope(closeness(dot(x_ij, x_ij), k.inverse_support))
        gx, mx = plus(gx, fx * component(u_ij, 0)), plus(mx, fx * component(x_ij, 0))
        y, z = component(x_ij, 1), component(x_ij, Z)
        if DIM == 3:
            gy = plus(gy, fx * component(u_ij, 1))
            yy, yz = plus(yy, component(fx, 1) * y), plus(yz, component(fx, 1) * z)
        return gx, gy, plus(gz, fx * component(u_ij, Z)), mx, yy, yz, plus(zz, component(fx, Z) * z)

    @helper()
    def solve(sums, M, gradient, k):
        gx, gy, gz, mx, yy, yz, zz = sums
        G = small_matrix(DIM, DIM)
        for b in range(DIM):
            G[0, b], G[Z, b] = k.divergence_factor * gx[b], k.divergence_factor * gz[b]
            M[0, b] = M[b, 0] = k.divergence_factor * mx[b]
            if DIM == 3:
                G[1, b] = k.divergence_factor * gy[b]
        if DIM == 3:
            M[1, 1], M[1, 2] = k.divergence_factor * yy, k.divergence_factor * yz
            M[2, 1] = M[1, 2]
        M[Z, Z] = k.divergence_factor * zz
        corrected(G, M, gradient)

    return hold, empty, pair, solve


@cache
def make_strain(lanes: int, dim: int):
    """Strain rates [1/s] of the fluid particles, from the fluid around each, into `strains` (rows, .), with the columns of
    `columns.strain`."""
    hold, empty, pair, solve = gradient_sums(lanes, dim)
    DIM = dim

    def finish(i, sums, strains, k):
        M, gradient = small_matrix(DIM, DIM), small_matrix(DIM, DIM)
        solve(sums, M, gradient, k)
        place = DIM
        for a in range(DIM):
            strains[i, a] = gradient[a, a]
            for b in range(a):
                strains[i, place] = 0.5 * (gradient[a, b] + gradient[b, a])
                place += 1

    return over_pairs("strain", (lanes, dim), takes="flow strains k", sum=Sum(hold, empty, ((FLUID, pair),), finish))
