"""The bed of a scene whose bathymetry is a grid of heights, for pictures."""

from __future__ import annotations

import numpy as np

from fsi.errors import SceneError
from fsi.scene.model import GRIDS, Scene

HALVINGS = 20  # of the tank's height, to where the bed is


def bed(scene: Scene) -> tuple[np.ndarray, np.ndarray] | None:
    """Points (n, 3) [m] on the bed, a spacing apart, and cells: lines (m, 2) between them in two dimensions, triangles (m, 3)
    in three. None where the bathymetry is no grid, or its file cannot be read any more."""
    file = scene.tank.bathymetry
    if file is None or file.suffix.lower() not in GRIDS:
        return None
    from fsi.scene.binding import bind

    try:
        _, _, ground = bind(scene, scene.name, bodies=False)
    except SceneError:
        return None
    low, high = np.array(scene.tank.min), np.array(scene.tank.max)
    counts = np.maximum(np.round((high - low)[:-1] / scene.spacing).astype(int) + 1, 2)
    axes = [np.linspace(*ends) for ends in zip(low[:-1], high[:-1], counts, strict=True)]
    place = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    bottom, top = (np.full(len(place), end) for end in (low[-1], high[-1]))
    for _ in range(HALVINGS):
        middle = (bottom + top) / 2
        solid = ground.clearance(np.column_stack([place, middle])) < 0.0
        bottom, top = np.where(solid, middle, bottom), np.where(solid, top, middle)
    points = np.insert(place, 1, 0.0, axis=1) if scene.dimension == 2 else place
    points = np.column_stack([points[:, :2], bottom])
    number = np.arange(len(place)).reshape(counts)
    if scene.dimension == 2:
        return points, np.column_stack([number[:-1], number[1:]])
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
