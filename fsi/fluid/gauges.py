"""Wave gauges and pressure probes: what an instrument at a fixed place would read."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fsi.compute.jit import exact
from fsi.sph.kernel import value
from fsi.sph.terms import kernel

FILLED = 0.5  # share of the kernel's support that is fluid at the free surface


@exact
def _column(position, point, reach):
    """Horizontal distance^2 and height (2, n) of the particles within reach of the vertical through the point."""
    axes, count = position.shape[1] - 1, 0
    found = np.empty((2, position.shape[0]))
    for i in range(position.shape[0]):
        r2 = 0.0
        for d in range(axes):
            r2 += (position[i, d] - point[d]) ** 2
        if r2 < reach * reach:
            found[0, count], found[1, count] = r2, position[i, axes]
            count += 1
    return found[:, :count]


@exact
def _filled(across2, heights, z, h, cell_over_h):
    """Share of the kernel's support around height z that is fluid: sum W V of particles at horizontal distance^2 and
    height; cell_over_h is V alpha."""
    total = 0.0
    for i in range(heights.size):
        t = 1 - 0.5 * math.sqrt(across2[i] + (heights[i] - z) ** 2) / h
        if t > 0:
            total += kernel(t)
    return total * cell_over_h


@exact
def _surface(position, point, spacing, h, cell_over_h):
    across2, heights = _column(position, point, 2 * h)
    if heights.size == 0:
        return math.nan
    step, bottom = 0.5 * spacing, heights.min()
    low, above = heights.max() + 2 * h, 0.0
    while low > bottom:
        low -= step
        here = _filled(across2, heights, low, h, cell_over_h)
        if here >= FILLED:
            return low + step * (here - FILLED) / (here - above)
        above = here
    return bottom


def elevation(position, point, spacing: float, h: float) -> float:
    """Height z [m] of the free surface on the vertical through `point` (dim - 1,): the highest place where fluid fills
    half of the kernel's support; the lowest particle's height where there is none, nan without fluid."""
    return _surface(position, point, spacing, h, _peak(spacing, h, position.shape[1]))


@cache
def _peak(spacing: float, h: float, dim: int) -> float:
    """V W(0): share of the support that a particle fills by itself."""
    return spacing**dim * float(value(0.0, h, dim))


@exact
def _mean_pressure(position, pressure, point, h, rho_g):
    last, total, sum_ = position.shape[1] - 1, 0.0, 0.0
    for i in range(position.shape[0]):
        r2 = 0.0
        for d in range(last + 1):
            r2 += (position[i, d] - point[d]) ** 2
        if r2 < 4 * h * h:
            weight = kernel(1 - 0.5 * math.sqrt(r2) / h)
            total += weight
            sum_ += weight * (pressure[i] + rho_g * (position[i, last] - point[last]))
    return sum_ / total if total > 0 else 0.0


def pressure_at(position, pressure, point, h: float, rho_g: float) -> float:
    """Pressure [Pa] at a point from the fluid within the kernel's support, its hydrostatic gradient included
    (Adami et al. 2012, eq. 27, for a wall at rest); 0 where there is no fluid."""
    return _mean_pressure(position, pressure, point, h, rho_g)
