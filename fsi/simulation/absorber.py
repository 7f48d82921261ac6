"""Active absorption: the piston gives way to the waves that come back to it."""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.gauges import elevation
from fsi.state import Remembers
from fsi.waves import Motion, piston_transfer, wavenumber
from fsi.waves.surface import surface

LAG = 0.1  # time constant of the correction [sqrt(depth / g)], against the roughness of the measured surface
RECALL = 50.0  # time constant with which the piston returns to its path [sqrt(depth / g)]


class Absorber(Remembers):
    """What the piston of a scene moves besides its own path.

    A wave of elevation e that comes in and is not reflected lifts the surface at the piston by e and asks the piston to
    move at -e omega S/H, which is -e sqrt(g / depth) for long waves (Schaffer & Klopman 2000, J. Waterway Port Coastal
    Ocean Eng. 126, 88-97). e is what the surface, 2 h before the piston, stands above the waves that are made. `shift`
    [m] and `rate` [m/s] are all its state.
    """

    remembered = ("shift", "rate")

    def __init__(self, scene, motion: Motion, depth: float):
        g, waves = scene.gravity, scene.waves
        self.shift = self.rate = 0.0
        self.furthest = room(motion)
        self._surface = surface(waves, motion, depth, g)
        self._gain = gain(waves, depth, g)
        self._lag, self._recall = LAG * math.sqrt(depth / g), RECALL * math.sqrt(depth / g)
        self._spacing, self._h, self._level = scene.spacing, scene.smoothing_length, scene.fluid.still_water_level
        self._wall = scene.tank.min[0]
        low, high = scene.tank.min, scene.tank.max
        self._across = [()] if scene.dimension == 2 else [(low[1] + f * (high[1] - low[1]),) for f in (0.2, 0.5, 0.8)]

    def step(self, time: float, dt: float, position: np.ndarray, x: float) -> tuple[float, float, float]:
        """The shift [m] and the rate [m/s] at `time`, and the rate after the step of dt [s], for fluid at `position`
        (n, dim) and a piston that its own path has at x [m]."""
        face = x + self.shift
        at = face + 2 * self._h
        found = [elevation(position, np.array([self._wall + at, *y]), self._spacing, self._h) for y in self._across]
        excess = float(np.mean(found)) - self._level - self._surface(time, at)
        wanted = -self._gain * (excess if math.isfinite(excess) else 0.0) - self.shift / self._recall
        shift, rate = self.shift, self.rate
        self.rate += (wanted - rate) * dt / (self._lag + dt)
        self.rate = min(max(self.rate, (-self.furthest - shift) / dt), (self.furthest - shift) / dt)
        self.shift = shift + dt * self.rate
        return shift, rate, self.rate


def room(motion: Motion) -> float:
    """How far the piston may leave its path [m]."""
    return max(-motion.reach[0], motion.reach[1])


def gain(waves, depth: float, g: float) -> float:
    """Velocity of the piston over the elevation that it takes up [1/s]: omega S/H at the waves' period, the longest of a
    packet; of long waves where there is none."""
    periods = {"regular": "period", "irregular": "peak_period"}
    if waves.kind in periods:
        omega = 2 * math.pi / getattr(waves, periods[waves.kind])
    elif waves.kind == "packet":
        omega = 2 * math.pi / max(group.period for group in waves.groups)
    else:
        return math.sqrt(g / depth)
    return omega / piston_transfer(wavenumber(omega, depth, g) * depth)
