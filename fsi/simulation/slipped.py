"""Fluid that has slipped between boundary particles and is inside a solid, or behind a wall, where no one sees it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.owners import FIRST_BODY
from fsi.protocols import BodySet, Solid
from fsi.scene.geometry import moving_sides
from fsi.scene.model import Scene

DEEP = 1.5  # spacings behind a surface; whoever stands on it, between two boundary particles, is less


class Slipped:
    """Finds such fluid. A solid that is no thicker than 2 DEEP spacings hides none."""

    def __init__(self, scene: Scene, bodies: BodySet | None, ground: Solid | None):
        self._scene, self._bodies, self._ground = scene, bodies, ground
        self._start = bodies.motion() if bodies else None
        held = [solid for inside in bodies.insides.values() for solid in inside] if bodies else []
        self._solids = [] if not bodies else [(o, s) for o, s in bodies.solids() if not any(s is h for h in held)]

    def depth(self, fluid: Fluid) -> np.ndarray:
        """How far (n,) each particle is behind the surface of a solid or of a wall that does not move [m], negative where it is
        before all of them."""
        x, found = fluid.position, np.full(fluid.count, -np.inf)
        for there, clearance in self._surfaces():
            np.maximum(found, -clearance(there(x)), out=found)
        return found

    def limit(self) -> float:
        """The depth [m] from which on a particle has slipped through."""
        return DEEP * self._scene.spacing

    def _surfaces(self) -> Iterator[tuple]:
        """Of each surface, what takes points to where it is at rest, and the distance from it there."""
        tank, moved = self._scene.tank, moving_sides(self._scene)
        for d, axis in enumerate(tank.axes):
            for side, end, out in ((f"{axis}-", tank.min[d], -1.0), (f"{axis}+", tank.max[d], 1.0)):
                if side in tank.walls and side not in moved and axis not in tank.periodic:
                    yield _as_is, lambda x, d=d, end=end, out=out: out * (end - x[:, d])
        if self._ground:
            yield _as_is, self._ground.clearance
        for owner, solid in self._solids:
            yield (_as_is if owner < FIRST_BODY else self._back(owner - FIRST_BODY)), solid.clearance

    def _back(self, b: int):
        """Takes points from where body b is now to where it was at the start."""
        now, axes = self._bodies.motion(), [0, 2] if self._scene.dimension == 2 else [0, 1, 2]
        turn = self._start.rotation[b] @ now.rotation[b].T
        turn = turn[np.ix_(axes, axes)]
        return lambda x: (x - now.position[b][axes]) @ turn.T + self._start.position[b][axes]


def _as_is(x: np.ndarray) -> np.ndarray:
    return x
