"""Velocities, thickness of the layer, run-up, flooded area and discharge, out of the particles."""

from __future__ import annotations

import numpy as np

from fsi.compute.jit import exact
from fsi.scene.instruments import Area, FluxPlane, RunUp
from fsi.scene.model import Scene
from fsi.sph.kernel import value
from fsi.state import Remembers

DRY = 0.1  # share of the kernel's support, below which there is no fluid to have a velocity
FINE = 10  # samples over the reach of a column, along each axis of the ground, for the room that the tank leaves it


def velocity_at(position: np.ndarray, velocity: np.ndarray, point, spacing: float, h: float) -> np.ndarray:
    """Velocity (dim,) [m/s] of the fluid at a point, the mean weighted by the kernel (Shepard 1968), exact for a uniform flow
    up to walls and surface; nan where there is none."""
    point, dim = np.asarray(point, float), position.shape[1]
    near = np.flatnonzero(np.abs(position[:, 0] - point[0]) < 2 * h)
    r = np.linalg.norm(position[near] - point, axis=1)
    weight = value(r, h, dim) * spacing**dim
    total = weight.sum()
    return weight @ velocity[near] / total if total > DRY else np.full(dim, np.nan)


@exact
def _piled(position, places, first, reach):
    """Sums of the weights of `Columns` (m, 2), alone and times the height, over the particles near each place;
    `position` (n, dim) ascends along x, and `first` (m,) are the first that may be near."""
    sums, axes = np.zeros((len(places), 2)), position.shape[1] - 1
    for n in range(len(places)):
        for i in range(first[n], len(position)):
            if position[i, 0] > places[n, 0] + reach:
                break
            r2 = 0.0
            for d in range(axes):
                r2 += (position[i, d] - places[n, d]) ** 2
            weight = max(1 - r2 / reach**2, 0.0) ** 2
            sums[n, 0] += weight
            sums[n, 1] += weight * position[i, axes]
    return sums


class Columns:
    """Columns of fluid over places on the ground: how thick the layer is. A column is weighted (1 - r^2 / R^2)^2 with R = 2 h
    about its vertical, over the room that the tank leaves it there."""

    def __init__(self, scene: Scene, places: np.ndarray):
        self._places, self._scene = places, scene
        self._reach, axes = 2 * scene.smoothing_length, scene.dimension - 1
        step = np.linspace(-1, 1, 2 * FINE + 1)[:-1] + 0.5 / FINE
        offsets = np.stack(np.meshgrid(*[step * self._reach] * axes, indexing="ij"), -1).reshape(-1, axes)
        cell = (self._reach / FINE) ** axes
        low, high = np.array(scene.tank.min)[:axes], np.array(scene.tank.max)[:axes]
        there, half = places[:, None] + offsets, 0.5 * self._reach / FINE
        inside = np.clip((np.minimum(there + half, high) - np.maximum(there - half, low)) / (2 * half), 0.0, 1.0).prod(
            2
        )
        self._room = cell * (inside * self._weight((offsets**2).sum(1))).sum(1)

    def _weight(self, r2: np.ndarray) -> np.ndarray:
        return np.maximum(1 - r2 / self._reach**2, 0.0) ** 2

    def __call__(self, position: np.ndarray, reductions) -> tuple[np.ndarray, np.ndarray]:
        """Thickness (m,) [m] and mean height (m,) [m] of the fluid over each place; the height is nan where there is none."""
        volume = self._scene.spacing**self._scene.dimension
        first, last = self._places[:, 0].min() - self._reach, self._places[:, 0].max() + self._reach
        which = np.flatnonzero((position[:, 0] > first) & (position[:, 0] < last))
        (position,) = reductions.gathered(which, position[which])
        position = position[np.argsort(position[:, 0], kind="stable")]
        first = np.searchsorted(position[:, 0], self._places[:, 0] - self._reach)
        sums = volume * _piled(position, self._places, first, self._reach)
        with np.errstate(invalid="ignore", divide="ignore"):
            return sums[:, 0] / self._room, np.where(sums[:, 0] > 0, sums[:, 1] / sums[:, 0], np.nan)


class Shore:
    """The water line along one run-up line."""

    def __init__(self, scene: Scene, line: RunUp):
        start, end = np.array(line.start), np.array(line.end)
        self.length = float(np.linalg.norm(end - start))
        self._at = np.linspace(0.0, self.length, 1 + max(1, round(2 * self.length / scene.spacing)))
        self._columns = Columns(scene, start + self._at[:, None] / self.length * (end - start))
        self._least, self._level = line.depth or scene.spacing, scene.fluid.still_water_level

    def __call__(self, position: np.ndarray, reductions) -> tuple[float, float]:
        """Distance of the water line from the start [m], and its height above still water [m]: that of the surface there. The
        line is where the layer that begins at the start first gets thinner than its least depth; 0 and nan where it is
        so at the start."""
        depth, middle = self._columns(position, reductions)
        thin = depth < self._least
        if thin[0]:
            return 0.0, np.nan
        top = middle + 0.5 * depth - self._level
        if not thin.any():
            return self.length, float(top[-1])
        n = int(thin.argmax())
        share = (depth[n - 1] - self._least) / (depth[n - 1] - depth[n])
        at = self._at[n - 1] + share * (self._at[n] - self._at[n - 1])
        height = top[n - 1] if np.isnan(top[n]) else top[n - 1] + share * (top[n] - top[n - 1])
        return float(at), float(height)


class Flood:
    """How much of an area is under water, by cells of two spacings."""

    def __init__(self, scene: Scene, area: Area):
        self._edges = []
        for a, b in zip(area.min, area.max, strict=True):
            count = max(1, round((b - a) / (2 * scene.spacing)))
            self._edges.append(np.linspace(a, b, count + 1))
        self._cell = float(np.prod([e[1] - e[0] for e in self._edges]))
        self._volume, self._least = scene.spacing**scene.dimension, area.depth or scene.spacing
        self._width = scene.tank.width if scene.dimension == 2 else 1.0

    def __call__(self, position: np.ndarray, reductions) -> tuple[float, float]:
        """Wet area [m2], and the mean depth on it [m], nan where it is dry."""
        ground = position[:, :-1]
        inside = np.ones(len(position), bool)
        for d, edges in enumerate(self._edges):
            inside &= (ground[:, d] >= edges[0]) & (ground[:, d] <= edges[-1])
        count, _ = np.histogramdd(ground[inside], bins=self._edges)
        depth = reductions.combined(count) * self._volume / self._cell
        wet = depth >= self._least
        return float(wet.sum()) * self._cell * self._width, float(depth[wet].mean()) if wet.any() else np.nan


class Discharge(Remembers):
    """Volume that has passed the flux planes of a scene: each particle counts in the step in which it crosses one, where it
    does; back and forth cancel."""

    remembered = ("passed", "_logged")

    def __init__(self, scene: Scene):
        self._planes = list(scene.fluxes.values())
        self._volume = scene.spacing**scene.dimension * (scene.tank.width if scene.dimension == 2 else 1.0)
        self.passed = np.zeros(len(self._planes))  # since the start [m3]
        self._logged = np.zeros(len(self._planes) + 1)  # the same, and the time, when they were read last

    def step(self, position: np.ndarray, velocity: np.ndarray, dt: float, reductions) -> None:
        """Count the crossings of a step of dt [s] that has taken the particles to `position` (n, dim)."""
        found = [self._crossed(plane, position, velocity, dt) for plane in self._planes]
        self.passed += self._volume * reductions.combined(np.array(found, float))

    def _crossed(self, plane: FluxPlane, position, velocity, dt: float) -> int:
        d = plane.axis
        after = position[:, d] - plane.min[d]
        before = after - dt * velocity[:, d]
        over = np.flatnonzero((after >= 0) != (before >= 0))
        if not over.size:
            return 0
        share = after[over] / (after[over] - before[over])
        where = position[over] - (share * dt)[:, None] * velocity[over]
        inside = np.ones(len(over), bool)
        for e in range(position.shape[1]):
            if e != d:
                inside &= (where[:, e] >= plane.min[e]) & (where[:, e] <= plane.max[e])
        return int(inside[after[over] >= 0].sum()) - int(inside[after[over] < 0].sum())

    def read(self, time: float) -> dict[str, np.ndarray]:
        """`passed_volume` [m3], and `discharge` [m3/s], the mean since it was read last."""
        since = time - self._logged[-1]
        rate = (self.passed - self._logged[:-1]) / since if since > 0 else np.zeros(len(self.passed))
        self._logged = np.append(self.passed, time)
        return {"discharge": rate, "passed_volume": self.passed.copy()}
