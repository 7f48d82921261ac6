"""What the sweeps share: the columns of the packed arrays, declared here and nowhere else, and the scalars of the scheme.

Rows are particles, the fluid first and the boundary after. `x` is the place relative to the grid, `u` the velocity, `p` the
pressure; `mu` the viscosity where it differs from particle to particle; `r`, between liquids of unequal density, the density
over that of the first liquid, 0 for walls; `filled` how full the support is where particles are shifted along a surface.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple


class Columns:
    """First column of each of these names, in their order, as an attribute; `sizes`: how many each takes."""

    def __init__(self, aligned: tuple[int, ...] = (), **sizes: int):
        self._aligned, self._end, last = aligned, {}, 0
        for name, size in sizes.items():
            setattr(self, name, last)
            last += size
            self._end[name] = last

    def of(self, names: str) -> tuple[int, ...]:
        """First columns of these names."""
        return tuple(getattr(self, name) for name in names.split())

    def all_of(self, name: str) -> slice:
        """All columns of this name."""
        return slice(getattr(self, name), self._end[name])

    def width(self, last: str) -> int:
        """Columns of an array that ends with this name. One or two more are left free where rows then lie better in memory."""
        end = self._end[last]
        return next((width for width in self._aligned if 0 <= width - end <= 2), end)


def _rows(dim: int, **sizes: int) -> Columns:
    return Columns(aligned=(4, 8) if dim == 3 else (4, 6), **sizes)


@cache
def flow(dim: int) -> Columns:
    """At the start of the step; read by the predictor and all viscous sweeps."""
    return _rows(dim, x=dim, u=dim, mu=1, r=1)


@cache
def strain(dim: int) -> Columns:
    """Of a fluid particle, the strain rate tensor: its diagonal, then xz, in three dimensions xy, xz and yz."""
    return Columns(tensor=dim * (dim + 1) // 2)


@cache
def trial(dim: int) -> Columns:
    """With the last step's pressure and the trial velocity u*; the same places of `x` and `p` as in `field`."""
    return _rows(dim, x=dim, p=1, u=dim, r=1, filled=1)


@cache
def field(dim: int) -> Columns:
    """What a pressure sweep reads and writes."""
    return _rows(dim, x=dim, p=1, r=1)


class Packed(NamedTuple):
    """First columns of what the rows are filled with besides positions, which come first in all of them."""

    u: int  # of `flow`
    p: int  # of `trial`
    trial_u: int


@cache
def packed(dim: int) -> Packed:
    return Packed(flow(dim).u, trial(dim).p, trial(dim).u)


COEFFICIENTS = Columns(
    diagonal=1, deficit=1, source=1, inner=1, counts=1, support=1
)  # of the pressure equation, a row a fluid particle; `counts`: how often its pressure counts in the gradient
DIAGONAL, DEFICIT, SOURCE, INNER, COUNTS, SUPPORT = COEFFICIENTS.of("diagonal deficit source inner counts support")


@cache
def shepard(dim: int) -> Columns:
    """Of a boundary particle, over the fluid around it: `total` = sum W, `lever` = sum r_j W x_bj."""
    return Columns(total=1, lever=dim)


@cache
def pair_law(dim: int) -> Columns:
    """Of a fluid particle, for the viscosity of its pairs: the velocity gradient row by row, the filled part of its support,
    the viscosity [Pa s] at its own shear rate, the confining pressure [Pa] and the number of its liquid."""
    return Columns(first=dim, second=dim * (dim == 3), last=dim, filled=1, mu=1, confined=1, kind=1)


@cache
def corrector_sums(dim: int) -> Columns:
    """Of a step: the largest speed^2 and acceleration^2, then sums of the kinetic energy, r height, volume / dr^dim and guarded
    particles, the momentum, and the momentum and energy lost in the sponge."""
    return Columns(
        speed2=1,
        acceleration2=1,
        kinetic=1,
        height=1,
        volume=1,
        guarded=1,
        momentum=dim,
        damped=dim,
        loss=1,
    )


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
    filled1: float  # part of the support that is filled in the top row under a flat surface (`kernel.SurfaceRows`)
    filled2: float  # in the next
    filled3: float  # in the third
    filled4: float  # in the fourth
    inside: float  # that from which on a particle is no part of the surface
    excess1: float  # by how much more than once the pressure of the top row counts in the gradient
    excess2: float  # that of the next
    excess3: float  # that of the third
    shallow: float  # pressure up to which these count, see `predictor.surface_excess`
    up_x: float  # direction against the body forces
    up_y: float
    up_z: float
    relaxation: float  # gamma
    suction: float  # share of gamma where the density is too small, see `Fluid.begin`
    draw: float  # by which the density counts as too small inside the fluid, see `fsi.fluid.volume`
    density: float
    mass: float
    shifting: float  # beta h^2 C V of the shift
    guard_level: float  # crowding by wall particles that the guard allows
    guard_reach2: float  # 1 / R^2 of that crowding
    guard_piece: float  # length of way that it follows at a time
    guard2: float  # squared distance within which it looks
