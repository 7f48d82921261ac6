"""Energy of fluid and bodies together, and fluid that ends up inside a body: what no coupling may make."""

from __future__ import annotations

import numpy as np

from fsi.owners import FIRST_BODY

MEMORY = 0.1  # s


class Total:
    """Kinetic and potential energy of the fluid and of everything that MuJoCo moves, its springs included [J]. Nothing in
    a closed tank may raise it: `rise` is the largest increase over an earlier value. What soft contacts and compressed
    fluid take up and give back within `MEMORY` does not count, so the values are the highest over that time."""

    def __init__(self, sim):
        self.start = self.now = self._of(sim)
        self.rise, self._least = 0.0, np.inf
        self._recent = [(sim.time, self.start)]

    def __call__(self, sim) -> None:
        self.now = self._of(sim)
        self._recent = [(t, e) for t, e in self._recent if t > sim.time - MEMORY] + [(sim.time, self.now)]
        highest = max(e for _, e in self._recent)
        self._least = min(self._least, highest)
        self.rise = max(self.rise, highest - self._least)

    @staticmethod
    def _of(sim) -> float:
        return float(sim.balance.kinetic + sim.balance.potential + sim.bodies.energy())


class Inside:
    """Fluid particles that stand in a body, by more than half a spacing."""

    def __init__(self, sim):
        self._axes = [0, 2] if sim.fluid.dim == 2 else [0, 1, 2]
        self._start = sim.bodies.motion()
        self._solids = [(owner - FIRST_BODY, solid) for owner, solid in sim.bodies.solids() if owner >= FIRST_BODY]

    def count(self, sim) -> int:
        """How many there are."""
        now, found = sim.bodies.motion(), np.zeros(sim.fluid.count, bool)
        points = np.zeros((sim.fluid.count, 3))
        points[:, self._axes] = sim.fluid.position
        for b, solid in self._solids:
            home = (points - now.position[b]) @ now.rotation[b] @ self._start.rotation[b].T + self._start.position[b]
            found |= solid.clearance(home[:, self._axes]) < -0.5 * sim.scene.spacing
        return int(found.sum())
