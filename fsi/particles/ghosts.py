"""Periodic axes: ghosts of the particles near one end of the tank stand beyond the other end.

Ghosts are appended to the fluid before it is sorted and dropped after the corrector. In between their numbers are copied
from their sources after every sweep, the same way in which a rank would fill its halo from its neighbours.
"""

from __future__ import annotations

import numpy as np

from fsi.scene.model import Scene


class Periodic:
    """The periodic axes of a scene's tank; `width`: how far ghosts reach beyond its ends, so that also wall particles
    there see as much fluid as those inside."""

    def __init__(self, scene: Scene):
        self.axes = [scene.tank.axes.index(name) for name in scene.tank.periodic]
        self.low, self.high = np.array(scene.tank.min), np.array(scene.tank.max)
        self.width = 4.05 * scene.smoothing_length if self.axes else 0.0
        self.ghosts = self.sources = np.empty(0, np.int64)  # rows, valid for one step

    def wrap(self, position: np.ndarray) -> None:
        """Bring positions (n, dim) back into the tank."""
        for d in self.axes:
            length = self.high[d] - self.low[d]
            position[:, d] -= length * np.floor((position[:, d] - self.low[d]) / length)

    def images(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sources (g,) and positions (g, dim) of the ghosts of these particles (n, dim), corners included."""
        everything, source = position, np.arange(len(position))
        for d in self.axes:
            length = self.high[d] - self.low[d]
            for face, shift in ((self.low[d] + self.width, length), (self.high[d] - self.width, -length)):
                near = everything[: len(source), d]
                chosen = np.flatnonzero(near < face if shift > 0 else near > face)
                chosen = chosen[(near[chosen] >= self.low[d]) & (near[chosen] <= self.high[d])]
                moved = everything[chosen].copy()
                moved[:, d] += shift
                everything = np.concatenate([everything, moved])
                source = np.concatenate([source, source[chosen]])
        n = len(position)
        return source[n:], everything[n:]

    def link(self, order: np.ndarray, sources: np.ndarray, real: int, inside: int) -> int:
        """Note the rows of the ghosts and of their sources: row r holds particle order[r], ghosts are those from `real`
        on, and only rows below `inside` are in the domain. Returns the number of ghosts there."""
        if len(sources):
            row = np.empty(len(order), np.int64)
            row[order] = np.arange(len(order))
            kept = row[real:] < inside
            self.ghosts, self.sources = row[real:][kept], row[sources][kept]
        return len(self.ghosts)

    def mirror(self, rows: np.ndarray, columns: slice) -> None:
        """Give the ghosts what their sources have."""
        if len(self.ghosts):
            rows[self.ghosts, columns] = rows[self.sources, columns]
