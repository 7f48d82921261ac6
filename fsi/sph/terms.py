"""The pair terms of the scheme, each written once, on lanes or on scalars alike.

i is a particle, j its neighbour, x_ij = x_i - x_j, r2 = |x_ij|^2, u_ij = u_i - u_j. The kernel enters through
t = max(0, 1 - q/2), q = r/h, so that W = alpha t^4 (5 - 4 t) and grad W = -C t^3 x_ij with C = 5 alpha / h^2
(`fsi.sph.kernel`); the constants alpha and C are applied to the sums, not to the pairs. On scalars x_ij and u_ij are
numbers too, in one dimension.
"""

from __future__ import annotations

from fsi.compute.jit import helper
from fsi.compute.lanes import dot, maximum, minimum, sqrt


@helper()
def closeness(r2, inverse_support):
    """t: 1 at the particle, 0 from the edge of the support on."""
    return maximum(0.0, 1.0 - sqrt(r2) * inverse_support)


@helper()
def kernel(t):
    """W / alpha."""
    t2 = t * t
    return t2 * t2 * (5.0 - 4.0 * t)


@helper()
def slope(t):
    """|grad W| / (C r)."""
    return t * t * t


@helper()
def laplacian_weight(f, r2, eta2):
    """a_ij / (2 C m / rho^2), the weight of p_j - p_i in the discrete Laplacian (Cummins & Rudman 1999, eq. 27);
    f is `slope`."""
    return f * r2 / (r2 + eta2)


@helper()
def divergence(f, u_ij, x_ij):
    """div u / (C V): the neighbour's share of V (u_j - u_i) . grad W."""
    return f * dot(u_ij, x_ij)


@helper()
def viscous(a, u_ij):
    """Laminar viscous acceleration / (-2 nu C V) (Morris et al. 1997, eq. 22); a is `laplacian_weight`."""
    return u_ij * a


@helper()
def mean_viscosity(mu_i, mu_j):
    """Harmonic mean, with which the shear stress is continuous across a jump (Cleary & Monaghan 1999, eq. 30)."""
    return 2.0 * mu_i * mu_j / (mu_i + mu_j)


@helper()
def partner(r_i, r_j):
    """r_j, the density of a neighbour over that of the first liquid; a wall, r_j = 0, is as dense as what it meets."""
    return maximum(r_j, minimum(r_i, 1e6 - 1e12 * r_j))


@helper()
def lightness(r_i, r_j):
    """Weight of a pair in the pressure equation of liquids of unequal density, 1 where both are 1 (Shao 2009, eq. 16)."""
    return 2.0 / (r_i + r_j)


@helper()
def artificial_viscosity(f, r2, eta2, approach, x_ij):
    """Acceleration / (-alpha c h C V) between particles whose `approach` u_ij . x_ij is < 0 (Monaghan 1992, eq. 4.2)."""
    return x_ij * (f * minimum(0.0, approach) / (r2 + eta2))


@helper()
def unresolved(approach, linear):
    """The part of an `approach` u_ij . x_ij that a velocity linear in space leaves, between 0 and the whole, so that no pair
    gains energy (slopes in the artificial viscosity: Frontiere, Raskin & Owen 2017, J. Comput. Phys. 332, 160-209; Rosswog
    2020, Mon. Not. R. Astron. Soc. 498, 4230-4255, who limit them by their ratio)."""
    return maximum(approach, approach - linear)


@helper()
def interface_gradient(f, p_i, p_j, r_i, r_j, x_ij):
    """`pressure_gradient` times r_i between unequal densities: p_i + p_j becomes twice the pressure at which both liquids
    accelerate alike in between (Hu & Adams 2007, eq. 14), and a pair's forces still cancel."""
    return x_ij * (f * lightness(r_i, r_j) * (r_j * p_i + r_i * p_j))


@helper()
def pressure_gradient(f, p_i, p_j, x_ij):
    """Acceleration / (C m / rho^2): symmetric, so that a pair's forces cancel exactly (Monaghan 1992, eq. 3.3)."""
    return x_ij * (f * (p_i + p_j))
