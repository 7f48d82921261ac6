"""Wave gauges and pressure probes: what an instrument at a fixed place would read."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fsi.kernel import value

FILLED = 0.5  # share of the kernel's support that is fluid at the free surface


@njit(nogil=True, cache=True)
def _near(position, point, reach, axes):
    """Numbers of the particles within reach of the point, measured on its first `axes` axes only."""
    found = []
    for i in range(position.shape[0]):
        r2 = 0.0
        for d in range(axes):
            r2 += (position[i, d] - point[d]) ** 2
        if r2 < reach * reach:
            found.append(i)
    return np.array(found, dtype=np.int64)


@njit(nogil=True, cache=True)
def _filled(across2, heights, z, h, cell_over_h):
    """Share of the kernel's support around height z that is fluid: sum W V of particles at horizontal distance^2 and
    height; cell_over_h is V alpha."""
    total = 0.0
    for i in range(heights.size):
        t = 1 - 0.5 * math.sqrt(across2[i] + (heights[i] - z) ** 2) / h
        if t > 0:
            total += t**4 * (5 - 4 * t)
    return total * cell_over_h


def elevation(position, point, spacing: float, h: float) -> float:
    """Height z [m] of the free surface on the vertical through `point` (dim - 1,): the highest place where fluid fills
    half of the kernel's support; the lowest particle's height where there is none, nan without fluid."""
    dim = position.shape[1]
    near = position[_near(position, point, 2 * h, dim - 1)]
    if len(near) == 0:
        return math.nan
    across2, heights = ((near[:, :-1] - point) ** 2).sum(1), np.ascontiguousarray(near[:, -1])
    scale = spacing**dim * float(value(0.0, h, dim))
    step, bottom = 0.5 * spacing, heights.min()
    low, above = heights.max() + 2 * h, 0.0
    while low > bottom:
        low -= step
        here = _filled(across2, heights, low, h, scale)
        if here >= FILLED:
            return low + step * (here - FILLED) / (here - above)
        above = here
    return bottom


def pressure_at(position, pressure, point, h: float, rho_g: float) -> float:
    """Pressure [Pa] at a point from the fluid within the kernel's support, its hydrostatic gradient included
    (Adami et al. 2012, eq. 27, for a wall at rest); 0 where there is no fluid."""
    dim = position.shape[1]
    near = _near(position, point, 2 * h, dim)
    weight = value(np.sqrt(((position[near] - point) ** 2).sum(1)), h, dim)
    total = weight.sum()
    if total == 0:
        return 0.0
    return float((weight * (pressure[near] + rho_g * (position[near, -1] - point[-1]))).sum() / total)
