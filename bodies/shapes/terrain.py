"""Ground under heights on a lattice, as a closed surface."""

from __future__ import annotations

import numpy as np

from bodies.shapes.meshes import Crop, Surface, mesh, polygon
from bodies.shapes.primitives import Placed


def terrain(x: np.ndarray, y: np.ndarray, heights: np.ndarray, bottom: float, crop: Crop) -> Placed:
    """Ground from z = `bottom` up to `heights` (n, m) at the nodes x (n,), y (m,) [m]; particles are laid within `crop`."""
    n, m = heights.shape
    top = np.stack([*np.meshgrid(x, y, indexing="ij"), heights], axis=-1).reshape(-1, 3)
    under = np.column_stack([top[:, :2], np.full(len(top), bottom)])
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    roof = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    rim = np.concatenate([number[:, 0], number[-1, 1:], number[-2::-1, -1], number[0, -2:0:-1]])
    after, low = np.roll(rim, -1), n * m
    sides = np.concatenate([np.column_stack([rim, rim + low, after]), np.column_stack([after, rim + low, after + low])])
    surface = mesh(np.concatenate([top, under]), np.concatenate([roof, roof[:, ::-1] + low, sides]))
    surface.crop = crop
    return Placed(surface, np.zeros(3), np.eye(3))


def profile(x: np.ndarray, heights: np.ndarray, bottom: float, crop: Crop) -> Placed:
    """Ground in two dimensions from z = `bottom` up to `heights` (n,) at x (n,) [m], as `terrain`."""
    corners = np.column_stack([x, heights])
    outline = np.concatenate([[[x[0], bottom], [x[-1], bottom]], corners[::-1]])
    surface = polygon(outline, np.roll(outline, -1, axis=0))
    surface.crop = crop
    return Placed(surface, np.zeros(2), np.eye(2))
