"""Which boundary particles carry the loads on the fixed structures that a scene names, and which part of their force.

Behind an edge where two walls meet stand particles that belong to both. What crosses the plane of a wall is the force of the
fluid before it on all that stands behind it: of a corner particle the component across each wall is that wall's, and the
horizontal force on the floor's particles under a box that stands on it is the box's. Without these a wall of 30
spacings is told some 3 % less than the water gives it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsi.errors import SceneError
from fsi.owners import WALL
from fsi.protocols import Solid
from fsi.scene.check_instruments import BATHYMETRY, SIDES
from fsi.scene.instruments import Load
from fsi.scene.model import Scene

OF_TANK = -1  # source of the particles of the tank's walls; others have the number of their solid


def load_weights(
    scene: Scene, points: np.ndarray, owner: np.ndarray, source: np.ndarray, solids: Sequence[tuple[int, Solid]]
) -> np.ndarray:
    """Share (loads, b, dim) of each component of the force on the boundary particles at `points` (b, dim) that counts for each
    of `scene.loads`; `source` (b,): number of their solid in `solids` (owner, solid), or OF_TANK. The first solid is the
    bathymetry where the scene has one. Raises SceneError where a load has no particle."""
    fixed = _Fixed(scene, points, owner == WALL, source, solids)
    weights = np.stack([fixed.share(name, load) for name, load in scene.loads.items()])
    for name, weight in zip(scene.loads, weights, strict=True):
        if not weight.any():
            fix = "move its box to the face of a wall, a bed or a static wet geom, or make it larger"
            raise SceneError("no boundary particle lies there", key=f"loads.{name}", fix=fix)
    return weights


class _Fixed:
    """The fixed boundary particles: what stands behind which side of the tank, and which solids cover what."""

    def __init__(self, scene: Scene, points, fixed, source, solids):
        self.scene, self.points, self.fixed, self.source, self.solids = scene, points, fixed, source, solids
        tank, dim = scene.tank, scene.dimension
        low, high = np.array(tank.min), np.array(tank.max)
        self.walls = [w for w in tank.walls if w[0] in tank.axes and w[0] not in tank.periodic]
        ours = fixed & (source == OF_TANK)
        self.behind = {}  # side -> particles (b,) of the tank that stand behind its plane
        for side in self.walls:
            d = tank.axes.index(side[0])
            self.behind[side] = ours & (points[:, d] < low[d] if side[1] == "-" else points[:, d] > high[d])
        self.count = np.maximum(sum(self.behind.values(), np.zeros(len(points), int)), 1)
        self.foot = np.clip(points, low, high)
        half = 0.5 * scene.spacing
        inner = np.clip(points, low + half, high - half)
        self.cover = np.full(len(points), OF_TANK)  # number of the solid that stands on the wall there
        for n, (own, solid) in enumerate(solids):
            if own == WALL:
                at = np.flatnonzero(ours)
                self.cover[at[solid.clearance(inner[at]) < 0]] = n
        for n, (own, solid) in enumerate(solids):
            mine = np.flatnonzero((fixed & (source == n)) | (self.cover == n))
            if own == WALL and mine.size:
                self.foot[mine] = self._face(solid, points[mine], low, high)
        self.dim = dim

    def _face(self, solid: Solid, points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Places (n, dim) on the face of a solid that the fluid pushes against: the nearest ones, but no face that lies on a
        wall of the tank, which is looked past by as much as the particles are deep."""
        lift = self.scene.layers * self.scene.spacing
        lifted = np.clip(points, low + lift, high - lift)
        deep = (solid.clearance(lifted) < 0)[:, None]
        lifted = np.where(deep, lifted, points)
        face = _feet(solid, lifted, self.scene.spacing)
        return np.where(lifted == points, face, np.clip(points, low, high))

    def share(self, name: str, load: Load) -> np.ndarray:
        """Share (b, dim) that counts for a load."""
        if load.on is None:
            share = np.tile(self.fixed[:, None].astype(float), (1, self.dim))
        elif load.on in SIDES:
            share = self._of_side(load.on)
        else:
            share = self._of_solids(self._named(name, load.on))
        if load.min is not None:
            low, high = np.array(load.min) - 1e-9, np.array(load.max) + 1e-9
            share[~((self.foot >= low) & (self.foot <= high)).all(1)] = 0.0
        return share

    def _of_side(self, side: str) -> np.ndarray:
        behind, d = self.behind[side], self.scene.tank.axes.index(side[0])
        free = behind & (self.cover == OF_TANK)
        share = np.where(free, 1.0 / self.count, 0.0)[:, None].repeat(self.dim, 1)  # along what several sides share
        for other, particles in self.behind.items():
            if other != side:  # what is across the other side is the other's
                share[particles, self.scene.tank.axes.index(other[0])] = 0.0
        share[behind, d] = 1.0
        return share

    def _of_solids(self, numbers: list[int]) -> np.ndarray:
        share = np.isin(self.source, numbers)[:, None].repeat(self.dim, 1).astype(float)
        covered = np.isin(self.cover, numbers)
        for d in range(self.dim):
            across = sum(
                (particles for side, particles in self.behind.items() if self.scene.tank.axes.index(side[0]) == d),
                np.zeros(len(self.points), bool),
            )
            share[covered & ~across, d] = 1.0
        return share

    def _named(self, name: str, on: str) -> list[int]:
        """Numbers of the solids of that name."""
        if on == BATHYMETRY:
            return [0]
        first = 1 if self.scene.tank.bathymetry else 0
        fixed = [
            (n, getattr(solid, "name", "")) for n, (own, solid) in enumerate(self.solids) if own == WALL and n >= first
        ]
        found = [n for n, label in fixed if on == label or label.endswith(f"/{on}")]
        if not found or len({label for n, label in fixed if n in found}) > 1:
            known = ", ".join([*self.walls, *([BATHYMETRY] if first else []), *sorted({x for _, x in fixed if x})])
            fault = f"{len(found)} static wet geoms are called {on!r}" if found else f"nothing fixed is called {on!r}"
            raise SceneError(fault, key=f"loads.{name}.on", fix=f"known are {known}")
        return found


def _feet(solid: Solid, points: np.ndarray, spacing: float) -> np.ndarray:
    """The nearest places (n, dim) on the surface of a solid."""
    step = 0.05 * spacing
    slope = [solid.clearance(points + step * e) - solid.clearance(points - step * e) for e in np.eye(points.shape[1])]
    return points - solid.clearance(points)[:, None] * np.stack(slope, 1) / (2 * step)
