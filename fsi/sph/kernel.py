"""The Wendland C2 kernel (Wendland 1995) with support 2 h, and what a perfect lattice makes of it.

W(r) = alpha (1 - q/2)^4 (1 + 2 q), q = r/h, alpha = 7 / (4 pi h^2) in two dimensions and 21 / (16 pi h^3) in three.
Its gradient is grad W = -F r_ij with F = (5 alpha / h^2) (1 - q/2)^3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FADE = 0.1  # filled part of the support over which a particle comes to be inside, see `innermost`
DISORDER = 0.02  # by which that part is smaller than a lattice's where particles have moved


def _normalisation(h: float, dim: int) -> float:
    return 7 / (4 * math.pi * h**2) if dim == 2 else 21 / (16 * math.pi * h**3)


def value(r, h: float, dim: int):
    """W(r) [1/m^dim]."""
    t = np.maximum(0.0, 1 - 0.5 * np.asarray(r) / h)
    return _normalisation(h, dim) * t**4 * (5 - 4 * t)


def gradient_factor(r, h: float, dim: int):
    """F(r) >= 0 with grad W = -F r_ij [1/m^(dim + 2)]."""
    t = np.maximum(0.0, 1 - 0.5 * np.asarray(r) / h)
    return 5 * _normalisation(h, dim) / h**2 * t**3


@dataclass(frozen=True)
class Lattice:
    """Sums over the neighbours on a perfect lattice of this spacing.

    density: sum W (self included) [1/m^dim]; laplacian: sum a with a = F r^2 / (r^2 + eta^2) [1/m^(dim + 2)];
    second_moment: V sum a x^2, which a Laplacian without error on a quadratic field would have at 1;
    surface_factor: weight of the missing part of the support at a flat free surface (see `surface_weight`);
    rows: what the rows of particles at a flat free surface are; inside: filled part of the support from which on a particle is
    no part of the surface (see `innermost`).
    """

    density: float
    laplacian: float
    second_moment: float
    surface_factor: float
    rows: SurfaceRows
    inside: float


@dataclass(frozen=True)
class SurfaceRows:
    """The top rows of a lattice under a flat free surface.

    filled (4,): part of their support that is filled, V sum F r^2 / dim, from the top row down; excess (3,): by how much more
    than once the pressure of the first three counts in the symmetric gradient, which then is rho g on every row under
    hydrostatic pressure (see `surface_rows`).
    """

    filled: tuple[float, float, float, float]
    excess: tuple[float, float, float]


def surface_rows(smoothing_ratio: float, dim: int) -> SurfaceRows:
    """The rows for h / dr = smoothing_ratio.

    With the support cut off, sum (p_i + p_j) grad W of hydrostatic pressure is 0.85 rho g on the top row and 1.12 rho g on
    the next at h = 2 dr: the two would meet. With the pressures of these rows times 1 + excess it is rho g within 1 % on
    every row (least squares over all rows). The defects of the rows sum to zero, so this can be had, and the forces of a
    pair still cancel."""
    reach, depth = math.ceil(2 * smoothing_ratio), 12
    across = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1.0)] * (dim - 1), indexing="ij"), -1).reshape(
        -1, dim - 1
    )
    fall = np.arange(-reach, reach + 1.0)  # how many rows deeper a neighbour is
    r = np.sqrt((across**2).sum(1)[None, :] + (fall**2)[:, None])
    slope = gradient_factor(r, smoothing_ratio, dim)
    pull, filled = (slope * fall[:, None]).sum(1), (slope * r**2).sum(1) / dim
    force = np.zeros((depth, depth + reach))  # on a row by the pressure of another
    for row in range(depth):
        for n, deeper in enumerate(fall.astype(int)):
            if row + deeper >= 0:
                force[row, row + deeper] += pull[n]
                force[row, row] += pull[n]
    head = np.arange(depth + reach) + 0.5
    rest = 1.0 - force @ head
    excess = np.linalg.lstsq(force[:, :3] * head[:3], rest, rcond=None)[0]
    full = [float(filled[fall >= -row].sum()) for row in range(4)]
    return SurfaceRows(tuple(full), tuple(excess.tolist()))


def lattice(spacing: float, h: float, dim: int) -> Lattice:
    reach = math.ceil(2 * h / spacing)
    axis = np.arange(-reach, reach + 1) * spacing
    grid = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    r = np.sqrt((grid**2).sum(1))
    weight = gradient_factor(r, h, dim) * r**2 / (r**2 + (0.1 * h) ** 2)
    second = spacing**dim * (weight * grid[:, 0] ** 2).sum()
    surface = surface_weight(grid[:, -1], weight, spacing)
    rows = surface_rows(h / spacing, dim)
    inside = innermost(rows.filled, grid[:, -1] / spacing, weight, surface)
    return Lattice(value(r, h, dim).sum(), weight.sum(), second, surface, rows, inside)


def surface_weight(z: np.ndarray, weight: np.ndarray, spacing: float) -> float:
    """Weight c that makes the discrete Poisson equation hold for hydrostatic pressure under a flat free surface half a
    spacing above the top layer, where the missing part of the support counts as particles at p = 0:
    sum a (p_i - p_j) + c p_i sum_missing a = 0, for the layer that feels the surface most."""
    missing = z > 0.5 * spacing
    lift = -(weight * z)[~missing].sum()  # sum a (z_i - z_j) over the neighbours that exist
    return lift / (weight[missing].sum() * 0.5 * spacing)


def innermost(filled: tuple[float, ...], rise: np.ndarray, weight: np.ndarray, surface: float) -> float:
    """Filled part of the support from which on a particle is inside, to two digits: 0.88 in two dimensions and 0.92 in three
    at h = 2 dr.

    The top row feels the surface whole, as particles at p = 0 with the weight `surface`; the second in the share g at which
    the solved pressure of still water is that of its depth further down:
    sum a (p_i - p_j) + surface g_i p_i sum_missing a = 0, with p given from the eighth row on and the product g p_i of the
    second unknown in its place. Without it (g = 0) the pressure at h = 1.5 dr is that of 0.25 spacings more depth, at
    2 dr of 0.75. The third row stays inside: where it is near the second (h below 1.5 dr), g is what fits."""
    given, reach = 7, int(rise.max())
    by_row = np.array([weight[np.isclose(rise, row)].sum() for row in range(-reach, reach + 1)])
    link = np.zeros((given + 1, given + 1 + reach))  # of a row by the pressure of another
    missing = np.zeros(given + 1)
    for row in range(given + 1):
        for other, a in enumerate(by_row, start=row - reach):
            if other < 0:
                missing[row] += a
            else:
                link[row, row] += a
                link[row, other] -= a
    link[0, 0] += surface * missing[0]
    unknown = np.column_stack([link[:, :given], np.where(np.arange(given + 1) == 1, surface * missing, 0.0)])
    head = np.arange(given, link.shape[1]) + 0.5
    *pressure, product = np.linalg.lstsq(unknown, -link[:, given:] @ head, rcond=None)[0]
    share = min(1.0, max(0.0, product / pressure[1]))
    return round(min(filled[1] + FADE * share, filled[2] - DISORDER), 2)
