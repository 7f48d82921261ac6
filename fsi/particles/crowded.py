"""Fluid that would start closer to boundary particles than the wall guard lets fluid come (`fsi.sph.wall_guard`).

A solid cuts the lattice anywhere, so that fluid may begin just outside it. In an edge between two solids such a particle
could slip between the particles of the two. It starts where the guard would let it be, a few tenths of a spacing away.
"""

from __future__ import annotations

import numpy as np

from fsi.particles.fixed import pairs_within
from fsi.sph import wall_guard

ROUNDS = 20
CLEAR = 1.0  # spacings from a solid, from which on its particles, half a spacing under its surface, crowd no fluid


def made_room(position: np.ndarray, boundary: np.ndarray, guard: float, spacing: float) -> np.ndarray:
    """Places (n, dim) of the particles (n, dim), moved until the boundary particles (b, dim) crowd them no more than the guard
    [spacing] allows: down the gradient of phi in steps of Newton. What walls on both sides hold stays."""
    reach, allowed = wall_guard.REACH * spacing, wall_guard.AIM * wall_guard.level(guard)
    x, held, active = position.copy(), [], np.arange(len(position))  # boundary particles stay: each finds its place alone
    for _ in range(ROUNDS):
        i, j = pairs_within(x[active], boundary, reach)
        apart = x[active[i]] - boundary[j]
        close = 1.0 - (apart**2).sum(1) / reach**2
        phi = np.bincount(i, close**2, len(active))
        pull = -4.0 / reach**2 * close[:, None] * apart
        slope = np.stack([np.bincount(i, part, len(active)) for part in pull.T], 1)
        parts = np.bincount(i, np.linalg.norm(pull, axis=1), len(active))
        steep2 = (slope**2).sum(1)
        squeezed = steep2 < (wall_guard.SQUEEZED * parts) ** 2
        held.append(active[squeezed])
        if not (move := (phi > allowed) & ~squeezed).any():
            break
        active = active[move]
        x[active] -= ((phi[move] - allowed) / np.maximum(steep2[move], 1e-30))[:, None] * slope[move]
    held = np.concatenate(held)
    x[held] = position[held]
    return x
