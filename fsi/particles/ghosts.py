"""Halos (`fsi.protocols.Halo`): none, and that of periodic axes.

On a periodic axis ghosts of the particles near one end of the tank stand beyond the other end.
"""

from __future__ import annotations

import numpy as np

from fsi.particles.cells import CellSort
from fsi.particles.neighbours import NOBODY
from fsi.protocols import Halo, Particles
from fsi.scene.model import Scene


def make_halo(scene: Scene) -> Halo:
    """The halo that a scene needs in one process."""
    return Periodic(scene) if scene.tank.periodic else NoHalo()


class NoHalo:
    """No ghosts."""

    room = 1.0

    def expected(self, count: int) -> int:
        return count

    def exchange(self, particles: Particles) -> int:
        return particles.count

    def locate(self, order: np.ndarray, sort: CellSort) -> int:
        return 0

    def idle(self) -> np.ndarray:
        return NOBODY

    def refresh(self, rows: np.ndarray, columns: slice) -> None:
        pass

    def sweep(self, run, near, rows: np.ndarray, columns: slice) -> None:
        run(near.bounds, near.groups)

    def holds(self, position: np.ndarray) -> None:
        return None

    def nearby(self, placed) -> None:
        return None

    def drop(self, particles: Particles) -> slice:
        return slice(None)


class Periodic:
    """The periodic axes of a scene's tank. Owns the rows of the ghosts and those of their sources in a step; `width`: how far
    ghosts reach beyond its ends, so that also wall particles there see as much fluid as those inside."""

    room = 1.2

    def __init__(self, scene: Scene):
        self.axes = [scene.tank.axes.index(name) for name in scene.tank.periodic]
        self.low, self.high = np.array(scene.tank.min), np.array(scene.tank.max)
        self.width = 4.05 * scene.smoothing_length if self.axes else 0.0
        self._number = self._ghosts = self._sources = np.empty(0, np.int64)

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

    def expected(self, count: int) -> int:
        """See `Halo`."""
        return count

    def exchange(self, particles: Particles) -> int:
        """See `Halo`."""
        self.drop(particles)
        self.wrap(particles.position)
        own = particles.count
        self._number, images = self.images(particles.position)
        particles.append_ghosts(images, particles.velocity[self._number], particles.pressure[self._number])
        return own

    def locate(self, order: np.ndarray, sort: CellSort) -> int:
        """See `Halo`."""
        inside, row, own = sort.inside, np.empty(len(order), np.int64), len(order) - len(self._number)
        row[order] = np.arange(len(order))
        kept = row[own:] < inside
        self._ghosts, self._sources = row[own:][kept], row[self._number][kept]
        return len(self._ghosts)

    def idle(self) -> np.ndarray:
        """See `Halo`."""
        return NOBODY

    def refresh(self, rows: np.ndarray, columns: slice) -> None:
        """Give the ghosts what their sources have."""
        if len(self._ghosts):
            rows[self._ghosts, columns] = rows[self._sources, columns]

    def sweep(self, run, near, rows: np.ndarray, columns: slice) -> None:
        """See `Halo`."""
        run(near.bounds, near.groups)
        self.refresh(rows, columns)

    def holds(self, position: np.ndarray) -> None:
        """See `Halo`."""
        return None

    def nearby(self, placed) -> None:
        """See `Halo`."""
        return None

    def drop(self, particles: Particles) -> np.ndarray:
        """See `Halo`."""
        own = particles.own
        particles.keep(own)
        return own
