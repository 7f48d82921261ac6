"""Particles of fluid between a body and the fixed wall that it slides along.

No free particle finds room there, and a gap without fluid has no pressure: the body would be sucked to the wall. Instead
a layer of particles is glued to the body and takes part in the pressure like any other fluid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bodies.shapes import thinning
from bodies.shapes.primitives import Placed
from fsi.errors import SceneError


class Gap:
    """`position` (n, dim): the glued particles [m]; the fluid keeps `clearance` from them."""

    def __init__(self, position: np.ndarray, spacing: float):
        self.position, self._spacing = position, spacing

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Distance (n,) of points (n, dim) to where a free particle would fit."""
        return thinning.distances(points, self.position, 2 * self._spacing) - 0.75 * self._spacing


def between(
    own: Sequence[Placed], walls: Sequence[Placed], spacing: float, layers: int, depth: int, key: str, source: object
) -> Gap:
    """`layers` layers of particles outside the solids `own` where they face the fixed `walls` no farther than that; `depth`
    is the number of boundary layers of the scene. Raises SceneError where no wall is so near."""
    parts = [_outside(solid, spacing, layers, depth) for solid in own]
    points = np.vstack(parts)
    away = np.min([solid.clearance(points) for solid in own], axis=0)
    wall = np.min([solid.clearance(points) for solid in walls], axis=0) if walls else np.full(len(points), np.inf)
    points = points[(away > 0.25 * spacing) & (wall > 0.25 * spacing) & (wall < (layers + 0.5) * spacing - away)]
    points = thinning.apart(points, 0.7 * spacing, points[:0])
    if len(points) == 0:
        fault = f"no fixed wet geom is {layers} spacings ({layers * spacing:g} m) from the body"
        fix = "place the body so, name the ramp in the tuple 'wet', or remove glued_layers"
        raise SceneError(fault, key=key, file=source, fix=fix)
    return Gap(points, spacing)


def _outside(solid: Placed, spacing: float, layers: int, depth: int) -> np.ndarray:
    """Images (n, dim) of the outermost boundary particles, outside the surface at half a spacing, one and a half, ..."""
    points = solid.boundary(spacing, depth)
    distance = solid.clearance(points)
    points, distance = points[distance > -0.75 * spacing], distance[distance > -0.75 * spacing]
    step = 1e-4 * spacing
    ahead, back = (
        np.column_stack([solid.clearance(points + side * step * axis) for axis in np.eye(points.shape[1])])
        for side in (1, -1)
    )
    normal = (ahead - back) / (2 * step)
    length = np.linalg.norm(normal, axis=1)
    points, distance, normal = (x[length > 0.9] for x in (points, distance, normal))
    return np.vstack(
        [points + (layer + 0.5) * spacing * normal - distance[:, None] * normal for layer in range(layers)]
    )
