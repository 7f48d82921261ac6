"""Water that stands inside a body at the start, cut off from the rest: in an open barge, between plates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bodies.shapes.primitives import Box, Capsule, Cylinder, Disc, Placed
from fsi.scene.model import Scene
from fsi.scene.region import contains

MOST = 2_000_000  # cells that are looked at
CONVEX = (Box, Capsule, Cylinder, Disc)


class Held:
    """Cells of the fluid's lattice that stay without fluid, as a `fsi.protocols.Solid` without boundary particles."""

    def __init__(self, inside: np.ndarray, first: np.ndarray, spacing: float):
        self._inside, self._first, self._spacing = inside, first, spacing

    def boundary(self, spacing: float, layers: int) -> np.ndarray:
        return np.empty((0, self._inside.ndim))

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Half a spacing (n,), negative for points (n, dim) in the cells."""
        cell = np.round((points - self._first) / self._spacing).astype(int)
        there = np.all((cell >= 0) & (cell < self._inside.shape), axis=1)
        held = np.zeros(len(points), bool)
        held[there] = self._inside[tuple(cell[there].T)]
        return np.where(held, -0.5, 0.5) * self._spacing

    @property
    def volume(self) -> float:
        """Of the cells [m3; m2 in two dimensions]."""
        return float(self._inside.sum() * self._spacing**self._inside.ndim)


def held(solids: Sequence[Placed], scene: Scene) -> Held | None:
    """The fluid at the start that the solids of one body keep from the rest, where a particle could not pass; None where
    there is none, and where the body takes more than `MOST` cells."""
    if not solids or (len(solids) == 1 and isinstance(solids[0].shape, CONVEX)):
        return None
    spacing, origin = scene.spacing, np.array(scene.tank.min)
    bounds = [solid.bounds() for solid in solids]
    low = np.min([b[0] for b in bounds], axis=0)
    high = np.max([b[1] for b in bounds], axis=0)
    start = np.floor((low - origin) / spacing).astype(int) - 2
    count = np.ceil((high - origin) / spacing).astype(int) + 2 - start
    if count.prod() > MOST:
        return None
    first = origin + (start + 0.5) * spacing
    points = first + np.indices(count).reshape(len(count), -1).T * spacing
    wet = _wet(points, scene)
    clearance = np.full(len(points), np.inf)
    for solid in solids:
        clearance[wet] = np.minimum(clearance[wet], solid.clearance(points[wet]))
    free = (wet & (clearance > 0.0)).reshape(count)
    way = (wet & (clearance > 0.5 * spacing)).reshape(count)
    edge = np.zeros(count, bool)
    for axis in range(len(count)):
        edge[tuple(slice(None) if k != axis else [0, -1] for k in range(len(count)))] = True
    if not (edge & way).any():
        return None
    reached = _spread(edge & way, way)
    core = way & ~reached
    if not core.any():
        return None
    inside, beside = core, free & ~_grown(reached)
    for _ in range(len(count)):  # up to the body's faces, and into its corners
        inside = inside | (_grown(inside) & beside)
    return Held(inside, first, spacing)


def _wet(points: np.ndarray, scene: Scene) -> np.ndarray:
    """Which of the points (n, dim) are in fluid at the start, the solids apart."""
    blocks = [block for liquid in scene.all_liquids for block in liquid.blocks]
    wet = [contains(block, points, scene.spacing) for block in blocks]
    if not scene.fluid.blocks:
        top = (*scene.tank.max[:-1], scene.fluid.still_water_level)
        wet.append(np.all((points > scene.tank.min) & (points < top), axis=1))
    return np.any(wet, axis=0)


def _spread(seeds: np.ndarray, way: np.ndarray) -> np.ndarray:
    """The cells of `way` that are joined to the seeds by their sides."""
    reached, size = seeds.copy(), 0
    while (now := int(reached.sum())) != size:
        size = now
        for _ in range(4):
            reached = _grown(reached) & way
    return reached


def _grown(cells: np.ndarray) -> np.ndarray:
    """The cells and those beside them."""
    grown = cells.copy()
    for axis in range(cells.ndim):
        before, after = (
            tuple(slice(*s) if k == axis else slice(None) for k in range(cells.ndim)) for s in ((None, -1), (1, None))
        )
        grown[after] |= cells[before]
        grown[before] |= cells[after]
    return grown
