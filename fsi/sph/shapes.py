"""The kernels that implicit ISPH can be run with, by name, as functions of t = 1 - r/H on their support H = 2 h.

W = alpha w(t) and grad W = -C f(t) x_ij. `wendland` is that of `fsi.sph.kernel`; `cubic_spline` (Monaghan & Lattanzio 1985)
has w = 2 t^3 - 8 s^3 with s = max(0, t - 1/2), C = alpha / H^2, alpha = 8 / (pi H^3) in three dimensions and 40 / (7 pi H^2)
in two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fsi.compute.jit import helper
from fsi.compute.lanes import maximum
from fsi.sph import terms


@helper()
def spline(t):
    """W / alpha of the cubic spline."""
    s = maximum(0.0, t - 0.5)
    return 2.0 * t * t * t - 8.0 * s * s * s


@helper()
def spline_slope(t):
    """|grad W| / (C r) of the cubic spline, whose limit at the particle itself does not count: x_ij is 0 there."""
    s = maximum(0.0, t - 0.5)
    return (6.0 * t * t - 24.0 * s * s) / maximum(1e-6, 1.0 - t)


class Shape(NamedTuple):
    """value(t) and slope(t), on lanes or numbers; alpha [1/m^dim] and C [1/m^(dim + 2)] for the support H = 2 h."""

    value: Callable
    slope: Callable
    alpha: float
    factor: float


def shape(name: str, h: float, dim: int) -> Shape:
    """The kernel of this name with smoothing length h."""
    if name == "wendland":
        alpha = 7 / (4 * math.pi * h**2) if dim == 2 else 21 / (16 * math.pi * h**3)
        return Shape(terms.kernel, terms.slope, alpha, 5 * alpha / h**2)
    support = 2 * h
    alpha = 40 / (7 * math.pi * support**2) if dim == 2 else 8 / (math.pi * support**3)
    return Shape(spline, spline_slope, alpha, alpha / support**2)


def functions(name: str) -> tuple[Callable, Callable]:
    """value(t) and slope(t) of the kernel of this name."""
    return (terms.kernel, terms.slope) if name == "wendland" else (spline, spline_slope)


class Filling(NamedTuple):
    """A perfect lattice of spacing dr: density = sum W, the particle itself included [1/m^dim]; layer: sum W over the particles
    of one plane of it around one of them; wall: how many times a particle of a single layer must count for it to stand for all
    that is missing below a flat wall, at a particle of the first row of fluid, one spacing away."""

    density: float
    layer: float
    wall: float


def filling(name: str, spacing: float, h: float, dim: int) -> Filling:
    """What the kernel of this name makes of a lattice."""
    reach = math.ceil(2 * h / spacing)
    axis = np.arange(-reach, reach + 1) * spacing
    grid = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    t = np.maximum(0.0, 1 - 0.5 * np.sqrt((grid**2).sum(1)) / h)
    value, z = shape(name, h, dim).alpha * plain(name, t)[0], grid[:, -1] / spacing
    plane = [float(value[np.abs(z + depth) < 0.5].sum()) for depth in range(reach + 1)]
    return Filling(float(value.sum()), plane[0], sum(plane[1:]) / plane[1])


def roughest(name: str, ratio: float, dim: int) -> float:
    """Largest eigenvalue of a Jacobi sweep of implicit ISPH on a lattice with h / dr = ratio: of the wave k of a pressure for
    which |sum V grad W sin(k . x)|^2 is the most times sum V^2 |grad W|^2. Sweeps need a relaxation below twice its inverse."""
    reach = math.ceil(2 * ratio)
    axis = np.arange(-reach, reach + 1.0)
    grid = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    t = 1 - 0.5 * np.sqrt((grid**2).sum(1)) / ratio
    grid, t = grid[t > 0], t[t > 0]
    waves = np.stack(np.meshgrid(*[np.linspace(0, 0.6 * math.pi, 19)] * dim, indexing="ij"), -1).reshape(-1, dim)
    push = plain(name, t)[1][:, None] * grid
    return float(((np.sin(waves @ grid.T) @ push) ** 2).sum(1).max() / (push**2).sum())


def plain(name: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """value(t) and slope(t) of arrays."""
    if name == "wendland":
        return t**4 * (5 - 4 * t), t**3
    s = np.maximum(0.0, t - 0.5)
    return 2 * t**3 - 8 * s**3, (6 * t**2 - 24 * s**2) / np.maximum(1e-6, 1 - t)
