"""Wave gauges and pressure probes: what an instrument at a fixed place would read."""

from __future__ import annotations

import numpy as np
from numba import njit

from fsi.kernel import value


@njit(cache=True)
def _close(position, point, reach, axes, out):
    """Numbers of the particles within reach of the point on each of the first `axes` axes."""
    n = 0
    for i in range(position.shape[0]):
        inside = True
        for d in range(axes):
            inside &= abs(position[i, d] - point[d]) < reach
        if inside:
            out[n] = i
            n += 1
    return n


def elevation(position, point, spacing: float, h: float) -> float:
    """Height z [m] of the free surface on the vertical through `point` (dim - 1,): the highest place where the fluid
    fills half of the kernel's support; the lowest particle's height where there is none, nan without fluid."""
    dim = position.shape[1]
    found = np.empty(len(position), np.int64)
    near = position[found[: _close(position, point, 2 * h, dim - 1, found)]]
    if len(near) == 0:
        return np.nan
    z = np.arange(near[:, -1].max() + 2 * h, near[:, -1].min(), -0.25 * spacing)
    across2 = ((near[:, :-1] - point) ** 2).sum(1)
    filled = np.array([value(np.sqrt(across2 + (near[:, -1] - level) ** 2), h, dim).sum() for level in z])
    filled *= spacing**dim
    above = np.flatnonzero(filled >= 0.5)
    if len(above) == 0 or above[0] == 0:
        return near[:, -1].min()
    k = above[0]
    return z[k] + (z[k - 1] - z[k]) * (filled[k] - 0.5) / (filled[k] - filled[k - 1])


def pressure_at(position, pressure, point, h: float, rho_g: float) -> float:
    """Pressure [Pa] at a point from the fluid within the kernel's support, its hydrostatic gradient included
    (Adami et al. 2012, eq. 27, for a wall at rest); 0 where there is no fluid."""
    dim = position.shape[1]
    found = np.empty(len(position), np.int64)
    near = found[: _close(position, point, 2 * h, dim, found)]
    weight = value(np.sqrt(((position[near] - point) ** 2).sum(1)), h, dim)
    total = weight.sum()
    if total == 0:
        return 0.0
    return float((weight * (pressure[near] + rho_g * (position[near, -1] - point[-1]))).sum() / total)
