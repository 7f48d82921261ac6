"""Fluid that has slipped between boundary particles and is inside a solid, or behind a wall, where no one sees it."""

from __future__ import annotations

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.owners import FIRST_BODY, WALL
from fsi.particles.tank import Sides
from fsi.protocols import BodySet, Solid
from fsi.scene.model import Scene

DEEP = 1.5  # spacings behind a surface; whoever stands on it, between two boundary particles, is less


class Slipped:
    """Finds such fluid. A solid that is no thicker than 2 DEEP spacings hides none.

    limit: depth [m] from which on a particle has slipped through."""

    def __init__(self, scene: Scene, bodies: BodySet | None, ground: Solid | None):
        self._bodies, self._start = bodies, bodies.motion() if bodies else None
        self._axes = [0, 2] if scene.dimension == 2 else [0, 1, 2]
        held = [id(solid) for inside in bodies.insides.values() for solid in inside] if bodies else []
        solids = [(owner, s) for owner, s in bodies.solids() if id(s) not in held] if bodies else []
        self._moving = [(owner - FIRST_BODY, solid) for owner, solid in solids if owner >= FIRST_BODY]
        self._still = [Sides(scene, WALL), *([ground] if ground else []), *(s for o, s in solids if o < FIRST_BODY)]
        self.limit = DEEP * scene.spacing

    def depth(self, fluid: Fluid) -> np.ndarray:
        """How far (n,) each particle is behind the surface of a solid or of a wall that does not move [m], negative where it is
        before all of them."""
        clear = [solid.clearance(fluid.position) for solid in self._still]
        clear += [solid.clearance(self._at_start(b, fluid.position)) for b, solid in self._moving]
        return -np.min(clear, axis=0)

    def _at_start(self, b: int, points: np.ndarray) -> np.ndarray:
        """Where points (n, dim) that moved with body b would have been at the start."""
        start, now, axes = self._start, self._bodies.motion(), self._axes
        turn = (start.rotation[b] @ now.rotation[b].T)[np.ix_(axes, axes)]
        return (points - now.position[b][axes]) @ turn.T + start.position[b][axes]
