"""What the kernels of the fluid share: the columns of the packed rows, and the scalars of the scheme.

Packed rows, fluid first and boundary after (DIM components a vector): `flow` [x, u], `trial` [x, p, u*], `field` [x, p].
Between liquids of unequal density (`dense`) they also hold r, the density over the first liquid's and 0 for walls, in the
column 2 DIM + 1 of `flow` and `trial` and after the pressures of `field`. Where particles are shifted along a surface,
column 2 DIM + 2 of `trial` holds how full their support is.
"""

from __future__ import annotations

from typing import NamedTuple


class Constants(NamedTuple):
    """Scalars of the scheme, in the precision of the sweeps; the symbols are those of `fsi.sph.terms`."""

    inverse_support: float  # 1 / (2 h)
    eta2: float  # (0.1 h)^2
    density_factor: float  # alpha / (sum W on the lattice): sums of `kernel` to rho / rho_lattice
    divergence_factor: float  # C V
    laplacian_factor: float  # 2 C m / rho^2
    gradient_factor: float  # C m / rho^2
    viscous_factor: float  # 2 nu C V over the lattice's second moment
    stress_factor: float  # 2 C V / rho over the lattice's second moment
    artificial_factor: float  # alpha c h C V
    lattice_laplacian: float  # sum a_ij on the lattice
    surface_factor: float  # weight of the missing part of the support at the free surface
    relaxation: float  # gamma
    suction: float  # share of gamma where the density is too small, see `Fluid.begin`
    density: float
    mass: float
    shifting: float  # beta h^2 C V of the shift
    guard_level: float  # crowding by wall particles that the guard allows
    guard_reach2: float  # 1 / R^2 of that crowding
    guard_piece: float  # length of way that it follows at a time
    guard2: float  # squared distance within which it looks


# Columns of the coefficients of the pressure equation, one row a fluid particle.
DIAGONAL, DEFICIT, SOURCE, INNER, SUPPORT = 0, 1, 2, 3, 4
