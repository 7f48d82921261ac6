"""Ground under heights on a lattice, as a closed surface."""

from __future__ import annotations

import numpy as np

from bodies.shapes import layers as layering
from bodies.shapes.meshes import Crop, Surface, mesh, polygon
from bodies.shapes.primitives import Placed

EVEN = 0.15  # of a spacing that neighbours on a lattice laid over gentle ground may be nearer or farther


class Terrain(Surface):
    """The surface of ground under heights (n, m) at the nodes x (n,), y (m,) [m]. Where it is gentle, its particles are a
    square lattice laid over it from above, its pitch such that their number fits the area; else they are laid as under any
    surface."""

    def __init__(self, surface: Surface, x: np.ndarray, y: np.ndarray, heights: np.ndarray):
        self.__dict__.update(surface.__dict__)
        self._x, self._y, self._heights = x, y, heights

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        laid = self._laid(spacing, layers)
        return super().sample(spacing, layers) if laid is None else laid

    def _laid(self, spacing: float, layers: int) -> np.ndarray | None:
        """Layers (n, 3) of a lattice, None where it would not be even."""
        low, high = self.crop
        slope = np.gradient(self._heights, self._x, self._y)
        area = np.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
        pitch = spacing / np.sqrt(area.mean())
        around = layers * spacing  # the normals lead points out of the box, and into it
        axes = [np.arange(a - around + 0.5 * pitch, b + around, pitch) for a, b in zip(low[:2], high[:2], strict=True)]
        place = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        z, *slope = (self._at(values, place) for values in (self._heights, *slope))
        normal = np.stack([-slope[0], -slope[1], np.ones_like(z)], axis=-1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        found = []
        for layer in range(layers):
            target = (layer + 0.5) * spacing
            points = np.concatenate([place, z[..., None]], axis=-1) - target * normal
            moved, there = layering.onto(self._nearest, points.reshape(-1, 3), target)
            moved = moved.reshape(points.shape)
            steps = [np.linalg.norm(np.diff(moved, axis=axis), axis=-1) for axis in (0, 1)]
            if not there.all() or any(np.abs(step / spacing - 1.0).max(initial=0.0) > EVEN for step in steps):
                return None
            found.append(moved.reshape(-1, 3))
        points = np.concatenate(found)
        return points[np.all((points >= low) & (points <= high), axis=1)]

    def _at(self, values: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Bilinear values (a, b) of those at the nodes (n, m) at places (a, b, 2), a rectangular lattice."""
        along = np.stack([np.interp(place[:, 0, 0], self._x, column) for column in values.T], axis=1)
        return np.stack([np.interp(place[0, :, 1], self._y, row) for row in along])


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
    surface = Terrain(surface, x, y, heights)
    surface.crop = crop
    return Placed(surface, np.zeros(3), np.eye(3))


def profile(x: np.ndarray, heights: np.ndarray, bottom: float, crop: Crop) -> Placed:
    """Ground in two dimensions from z = `bottom` up to `heights` (n,) at x (n,) [m], as `terrain`."""
    corners = np.column_stack([x, heights])
    outline = np.concatenate([[[x[0], bottom], [x[-1], bottom]], corners[::-1]])
    surface = polygon(outline, np.roll(outline, -1, axis=0))
    surface.crop = crop
    return Placed(surface, np.zeros(2), np.eye(2))
