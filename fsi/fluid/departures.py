"""The particles that have left the domain: how many, where, and what they took along."""

from __future__ import annotations

import numpy as np

from fsi.particles.cells import Grid
from fsi.scene.model import Tank


class Departures:
    """Counts of the particles of all processes that are in the run no more.

    lost: those that the domain did not hold; last_seen (dim,): where one of the last ones was [m], None before; left
    (open sides,): those that went by an open side of the tank, which are not lost; gone (dim + 2,): sums over all of them of
    r u, r u^2 / 2 and r z, r the density over the first liquid's.
    """

    def __init__(self, tank: Tank, grid: Grid):
        self._tank, self._grid = tank, grid
        self.lost, self.last_seen = 0, None
        self.left, self.gone = np.zeros(len(tank.open), int), np.zeros(len(grid.domain_min) + 2)

    def note(self, relative: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> None:
        """More particles have gone, in the same order in all processes: r (m,), position and velocity (m, dim)."""
        lost = np.ones(len(position), bool)
        for n, side in enumerate(self._tank.open):
            axis = self._tank.axes.index(side[0])
            x, low, high = position[:, axis], self._grid.domain_min[axis], self._grid.domain_max[axis]
            by = lost & (x < low if side[1] == "-" else x > high)
            self.left[n] += int(by.sum())
            lost &= ~by
        self.lost += int(lost.sum())
        if lost.any():
            self.last_seen = position[lost.argmax()].copy()
        energy, height = 0.5 * float(relative @ (velocity**2).sum(1)), float(relative @ position[:, -1])
        self.gone += np.array([*(relative @ velocity), energy, height])

    def state(self) -> dict:
        """All of it, copies."""
        seen = None if self.last_seen is None else self.last_seen.copy()
        return {"lost": int(self.lost), "left": self.left.copy(), "last_seen": seen, "gone": self.gone.copy()}

    def restore(self, state: dict) -> None:
        """Go on from `state`, which may hold more."""
        seen = state["last_seen"]
        self.lost, self.last_seen = int(state["lost"]), None if seen is None else np.array(seen)
        self.left, self.gone = np.array(state["left"]), np.array(state["gone"])
