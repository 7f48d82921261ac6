"""The walls of the tank as layers of boundary particles on the fluid's lattice, and as a solid with a distance."""

from __future__ import annotations

import math

import numpy as np

from fsi.owners import PISTON, WALL
from fsi.particles.ghosts import Periodic
from fsi.scene.geometry import WHOLE, cell, moving_sides, retreats
from fsi.scene.model import Scene


def axis(low: float, high: float, origin: float, spacing: float) -> np.ndarray:
    """Lattice points origin + (k + 1/2) spacing between low and high; a point on the edge, to rounding, is outside."""
    first = math.ceil((low - origin) / spacing - 0.5 - 1e-6)
    last = math.floor((high - origin) / spacing - 0.5 + 1e-6)
    return origin + (np.arange(first, last + 1) + 0.5) * spacing


def lattice(axes: list[np.ndarray]) -> np.ndarray:
    """All points (n, dim) with these coordinates."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


def wall_particles(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Layers of particles (n, dim) outside the walled sides of the tank, with their owners (n,).

    The last axis takes the corners, and under a piston the other walls reach as far back as it does, so that they stay
    closed while it moves, as under the moving walls of a sea; along a periodic axis they reach as far as its ghosts."""
    tank, spacings, dim = scene.tank, cell(scene), scene.dimension
    names = tank.axes
    back, forth = ([math.ceil(x / dr) * dr for x, dr in zip(way, spacings, strict=True)] for way in retreats(scene))
    width = Periodic(scene).width
    points, owners = [], []
    for d in range(dim):
        for side in (-1, 1):
            if f"{names[d]}{'-' if side < 0 else '+'}" not in tank.walls or names[d] in tank.periodic:
                continue
            axes = []
            for e, spacing in enumerate(spacings):
                low, high, thick = tank.min[e], tank.max[e], scene.layers * spacing
                if e == d:
                    own = (low - thick, low, low) if side < 0 else (high, high + thick, high)
                    axes.append(axis(*own, spacing))
                    continue
                if names[e] in tank.periodic:
                    around = math.ceil(width / spacing) * spacing
                    low, high = low - around, high + around
                elif e < d:
                    low -= (thick + back[e]) * (f"{names[e]}-" in tank.walls)
                    high += (thick + forth[e]) * (f"{names[e]}+" in tank.walls)
                axes.append(_fitted(low, high, tank.min[e], tank.max[e], spacing))
            slab = lattice(axes)
            moving = f"{names[d]}{'-' if side < 0 else '+'}" in moving_sides(scene)
            points.append(slab)
            owners.append(np.full(len(slab), PISTON if moving else WALL))
    if not points:
        return np.empty((0, dim)), np.empty(0, int)
    return np.concatenate(points), np.concatenate(owners)


def _fitted(low: float, high: float, inner: float, outer: float, spacing: float) -> np.ndarray:
    """Lattice points between low and high that begin anew at `inner` and `outer`, the sides of the tank, and are stretched
    between them to fit: walls that meet in an edge then share one lattice, and crowd no fluid particle there."""
    count = round((outer - inner) / spacing)
    if abs(count * spacing - (outer - inner)) < WHOLE * spacing:
        return axis(low, high, inner, spacing)
    between = inner + (np.arange(count) + 0.5) * (outer - inner) / count
    return np.concatenate([axis(low, inner, inner, spacing), between, axis(outer, high, outer, spacing)])


class Sides:
    """What the walled sides of the tank that `owner` holds take up: the piston's, or all others. A wall ends with the tank
    where the next side is open."""

    def __init__(self, scene: Scene, owner: int):
        tank, piston = scene.tank, moving_sides(scene)
        walled = {w for w in tank.walls if w[0] in tank.axes and w[0] not in tank.periodic}
        walls = walled & piston if owner == PISTON else walled - piston
        ends = {f"{n}{side}" for n in tank.axes if n not in tank.periodic for side in "-+"} - walled
        self._low, self._high = _ends(tank, walls)
        self._first, self._last = _ends(tank, ends)

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Distance (n,) of points (n, dim) to the nearest of the sides, negative beyond it."""
        beyond = np.minimum(points - self._low, self._high - points).min(1)
        past = np.maximum(self._first - points, points - self._last).max(1)  # the end of the walls
        return np.maximum(beyond, past)


def _ends(tank, sides: set[str]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (dim,) of the tank, infinite but at these sides."""
    low = [x if f"{n}-" in sides else -math.inf for n, x in zip(tank.axes, tank.min, strict=True)]
    high = [x if f"{n}+" in sides else math.inf for n, x in zip(tank.axes, tank.max, strict=True)]
    return np.array(low), np.array(high)
