"""Added mass by potential flow on a grid: what still water adds to the inertia of bodies at infinite frequency.

Walls, bed and fixed solids are closed, and the still water level is under no pressure. A unit speed of a degree of freedom
pushes water out of the cells that its bodies cut; the potential of that flow, laplace(phi) = 0, gives the added mass
A_kl = -rho sum(phi_k n_l area) (Newman 1977, sec. 4.13). Cells are cut by the share of each face that is fluid (Batty,
Bertails & Bridson 2007): a body's velocity has no divergence, so that its flux through the surface of the body in a cell is
that through what is left of the faces.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsi.owners import FIRST_BODY
from fsi.protocols import BodyMotion, Solid
from fsi.scene.model import Scene

CELLS = {2: 40_000, 3: 250_000}  # of the box around the bodies
THIN, FINEST = 3.0, 8.0  # cells through the thinnest body, for up to so many times the cells
FAR = 2.0  # depths of water beside the bodies: what they push has fallen to exp(-pi) there
ENOUGH, MOST = 1e-4, 3000  # residual over the source; iterations


def added_mass(
    scene: Scene, solids: Sequence[tuple[int, Solid]], ground: Solid | None, motion: BodyMotion
) -> np.ndarray:
    """Added inertia (nv, nv) of bodies where they stand, in one liquid at rest. `solids` as from `BodySet.solids`, in the
    pose of `motion`; `ground` is the bathymetry."""
    moving = [(owner - FIRST_BODY, solid) for owner, solid in solids if owner >= FIRST_BODY]
    fixed = [solid for owner, solid in solids if owner < FIRST_BODY] + ([] if ground is None else [ground])
    axes, step = _axes(scene, [solid for _, solid in moving])
    dim, shape = len(axes), tuple(len(axis) for axis in axes)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dim)
    clear = np.array([solid.clearance(points).reshape(shape) for _, solid in moving])
    around = np.min([*(solid.clearance(points).reshape(shape) for solid in fixed), np.full(shape, np.inf)], axis=0)
    pushed = _pushed(axes, clear, np.array([b for b, _ in moving]), motion)
    share = [_wet(np.minimum(clear.min(axis=0), around), axis) for axis in range(dim)]
    surface = share[-1][..., -1] * (0.0 if scene.closed else 2.0)
    inner = [np.take(part, range(1, part.shape[axis] - 1), axis) for axis, part in enumerate(share)]
    potential = np.array([_solve(inner, surface, step * source) if source.any() else source for source in pushed])
    area = step ** (dim - 1) * (scene.tank.width if dim == 2 else 1.0)
    found = -scene.fluid.density * area * potential.reshape(len(pushed), -1) @ pushed.reshape(len(pushed), -1).T
    return 0.5 * (found + found.T)


def _axes(scene: Scene, solids: Sequence[Solid]) -> tuple[list[np.ndarray], float]:
    """Corners of the cells along each axis [m], the last at the still water level, and the size of the cells [m]."""
    low, high = np.array(scene.tank.min), np.array(scene.tank.max)
    high[-1] = min(scene.fluid.still_water_level, high[-1])
    far, dim = FAR * (high[-1] - low[-1]), len(low)
    low[:-1] = np.maximum(low, np.min([solid.bounds()[0] for solid in solids], axis=0) - far)[:-1]
    high[:-1] = np.minimum(high, np.max([solid.bounds()[1] for solid in solids], axis=0) + far)[:-1]
    thinnest = min(float(np.ptp(solid.bounds(), axis=0).min()) for solid in solids)
    coarse = (np.prod(high - low) / CELLS[dim]) ** (1 / dim)
    step = min(coarse, max(thinnest / THIN, coarse / FINEST ** (1 / dim)))
    step = float((high[-1] - low[-1]) / np.ceil((high[-1] - low[-1]) / step))
    counts = np.maximum(np.round((high - low) / step), 1).astype(int)
    middle = (low + high) / 2
    return [m + step * (np.arange(n + 1) - 0.5 * n) for m, n in zip(middle, counts, strict=True)], step


def _wet(clear: np.ndarray, axis: int) -> np.ndarray:
    """Share of the faces across an axis that is fluid, by the clearance at the corners of the cells."""
    along, shares = [k for k in range(clear.ndim) if k != axis], []
    for k in along:
        first, last = _ends(clear, k)
        both = np.maximum(np.abs(first) + np.abs(last), 1e-30)
        edge = np.nan_to_num((np.maximum(first, 0.0) + np.maximum(last, 0.0)) / both, nan=1.0)
        shares.append(_middle(edge, [j for j in along if j != k]))
    return np.mean(shares, axis=0)


def _ends(values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    count = values.shape[axis]
    return np.take(values, range(count - 1), axis), np.take(values, range(1, count), axis)


def _middle(values: np.ndarray, axes: Sequence[int]) -> np.ndarray:
    for axis in axes:
        first, last = _ends(values, axis)
        values = 0.5 * (first + last)
    return values


def _pushed(axes, clear: np.ndarray, body: np.ndarray, motion: BodyMotion) -> np.ndarray:
    """Flux (nv, cells) out of each cell through what its body leaves of its faces, over the area of a face, at unit speeds.
    `clear` (solids, corners); `body` (solids,) is whose each solid is."""
    dim = len(axes)
    across = [0, 2] if dim == 2 else [0, 1, 2]
    narrowing = [np.diff(_wet(clear.min(axis=0), axis), axis=axis) for axis in range(dim)]
    whose = body[np.argmin([_middle(one, range(dim)) for one in clear], axis=0)]
    cut = np.nonzero(np.any(narrowing, axis=0))
    arm = np.zeros((len(cut[0]), 3))
    for k, axis in enumerate(axes):
        arm[:, across[k]] = _middle(axis, [0])[cut[k]] - motion.position[whose[cut], across[k]]
    jacobian = motion.jacobian[whose[cut]]
    speed = jacobian[:, :3] + np.cross(jacobian[:, 3:], arm[:, :, None], axis=1)
    found = np.zeros((motion.jacobian.shape[2], *whose.shape))
    found[:, *cut] = sum(speed[:, across[k]] * narrowing[k][cut][:, None] for k in range(dim)).T
    return found


def _solve(inner: list[np.ndarray], surface: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Potential whose differences over the open faces `inner` across each axis sum to `source` in every cell, and which
    is 0 at the `surface`: conjugate gradients, scaled by the diagonal."""
    dim = source.ndim
    low = [(slice(None),) * k + (slice(None, -1),) for k in range(dim)]
    high = [(slice(None),) * k + (slice(1, None),) for k in range(dim)]
    weight = np.zeros(source.shape)
    weight[..., -1] += surface
    for k, share in enumerate(inner):
        weight[low[k]] += share
        weight[high[k]] += share
    inverse = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 1e-9)

    def spread(p):
        out = weight * p
        for k, share in enumerate(inner):
            out[low[k]] -= share * p[high[k]]
            out[high[k]] -= share * p[low[k]]
        return out

    found, rest = np.zeros(source.shape), np.where(inverse > 0, -source, 0.0)
    way = inverse * rest
    size = float((rest * way).sum())
    least = ENOUGH**2 * size
    for _ in range(MOST):
        if size <= least:
            break
        image = spread(way)
        part = size / float((way * image).sum())
        found, rest = found + part * way, rest - part * image
        scaled = inverse * rest
        last, size = size, float((rest * scaled).sum())
        way = scaled + size / last * way
    return found
