"""The Wendland C2 kernel (Wendland 1995) with support 2 h, and what a perfect lattice makes of it.

W(r) = alpha (1 - q/2)^4 (1 + 2 q), q = r/h, alpha = 7 / (4 pi h^2) in two dimensions and 21 / (16 pi h^3) in three.
Its gradient is grad W = -F r_ij with F = (5 alpha / h^2) (1 - q/2)^3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


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
    surface_factor: weight of the missing part of the support at a flat free surface (see `surface_weight`).
    """

    density: float
    laplacian: float
    second_moment: float
    surface_factor: float


def lattice(spacing: float, h: float, dim: int) -> Lattice:
    reach = math.ceil(2 * h / spacing)
    axis = np.arange(-reach, reach + 1) * spacing
    grid = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    r = np.sqrt((grid**2).sum(1))
    weight = gradient_factor(r, h, dim) * r**2 / (r**2 + (0.1 * h) ** 2)
    second = spacing**dim * (weight * grid[:, 0] ** 2).sum()
    return Lattice(value(r, h, dim).sum(), weight.sum(), second, surface_weight(grid[:, -1], weight, spacing))


def surface_weight(z: np.ndarray, weight: np.ndarray, spacing: float) -> float:
    """Weight c that makes the discrete Poisson equation hold for hydrostatic pressure under a flat free surface half a
    spacing above the top layer, where the missing part of the support counts as particles at p = 0:
    sum a (p_i - p_j) + c p_i sum_missing a = 0, for the layer that feels the surface most."""
    missing = z > 0.5 * spacing
    lift = -(weight * z)[~missing].sum()  # sum a (z_i - z_j) over the neighbours that exist
    return lift / (weight[missing].sum() * 0.5 * spacing)
