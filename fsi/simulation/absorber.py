"""Active absorption: the piston gives way to the waves that come back to it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fsi.state import Remembers
from fsi.waves.kind import Motion, room

LAG = 0.1  # time constant of the correction [sqrt(depth / g)], against the roughness of the measured surface
ROUGH = 0.2  # elevation [spacings] below which what is read is the particles' disorder, not a wave
RECALL = 50.0  # time constant with which the piston returns to its path [sqrt(depth / g)]


class Absorber(Remembers):
    """What the piston of a scene moves besides its own path.

    A wave of elevation e that comes in and is not reflected lifts the surface at the piston by e and asks the piston to
    move at -e omega S/H, which is -e sqrt(g / depth) for long waves (Schaffer & Klopman 2000, J. Waterway Port Coastal
    Ocean Eng. 126, 88-97). e is what the surface, 2 h before the piston, stands above the waves that are made; below
    ROUGH spacings it fades to nothing, or the piston would creep after the settling of still water, 50 times as far.
    `shift` [m] and `rate` [m/s] are all its state.
    """

    remembered = ("shift", "rate")

    def __init__(self, scene, motion: Motion, depth: float):
        g, waves = scene.gravity, scene.waves
        self.shift = self.rate = 0.0
        self.furthest = room(motion)
        self._surface = waves.surface(motion, depth, g)
        self._gain = waves.gain(depth, g)
        self._lag, self._recall = LAG * math.sqrt(depth / g), RECALL * math.sqrt(depth / g)
        self._h, self._level = scene.reading_length, scene.fluid.still_water_level
        self._rough = ROUGH * scene.spacing
        self._wall = scene.tank.min[0]
        low, high = scene.tank.min, scene.tank.max
        self._across = [()] if scene.dimension == 2 else [(low[1] + f * (high[1] - low[1]),) for f in (0.2, 0.5, 0.8)]

    def step(
        self, time: float, dt: float, height: Callable[[np.ndarray], float], x: float
    ) -> tuple[float, float, float]:
        """The shift [m] and the rate [m/s] at `time`, and the rate after the step of dt [s], for a free surface at
        `height` [m] over points (dim - 1,), nan where there is none, and a piston that its own path has at x [m]."""
        face = x + self.shift
        at = face + 2 * self._h
        found = [height(np.array([self._wall + at, *y])) for y in self._across]
        wet = [z for z in found if math.isfinite(z)]
        excess = sum(wet) / len(wet) - self._level - self._surface(time, at) if wet else 0.0
        excess *= excess**4 / (excess**4 + self._rough**4)
        wanted = -self._gain * excess - self.shift / self._recall
        shift, rate = self.shift, self.rate
        self.rate += (wanted - rate) * dt / (self._lag + dt)
        self.rate = min(max(self.rate, (-self.furthest - shift) / dt), (self.furthest - shift) / dt)
        self.shift = shift + dt * self.rate
        return shift, rate, self.rate
