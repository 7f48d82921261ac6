"""What a kind of waves is: the keys of a scene's `[waves]`, and all that follows from them.

A kind is one module: in `fsi/waves/kinds`, where its file is its name and `Waves` its class, or in a package of its own,
registered as an entry point of the group `spindrift.waves` (`fsi.plugins`). It is imported by the scenes that ask for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from fsi.parts import Part
from fsi.waves.incident import IncidentWaves
from fsi.waves.linear import piston_transfer, wavenumber

BREAKING_DEPTH_RATIO = 0.78  # height over depth of a solitary wave that breaks (McCowan 1894)
BREAKING_STEEPNESS = 0.142  # height over length of a breaking wave in deep water (Michell 1893)
NEARLY = 0.72  # of the height at which waves break; two alike that meet do so from 0.77 on (Penney & Price 1952)
LEAST_HEIGHT, LEAST_LENGTH = 4, 10  # spacings over the height and the length of a wave

Fault = tuple[str, str, str]  # key, fault, fix
Surface = Callable[[float, float], float]  # time [s], distance from the piston's mean position [m] -> elevation [m]


class Motion(Protocol):
    """The path of a piston: a pure function of time, t -> (displacement [m], velocity [m/s], acceleration [m/s2]), positive
    towards the water and zero at t = 0; `excursion`: the least and the largest displacement [m]. One that comes to rest
    for good has `end` [s]."""

    excursion: tuple[float, float]

    def __call__(self, t: float) -> tuple[float, float, float]: ...


class Train(NamedTuple):
    """A train of equal waves: what it is called, its height [m] and its period [s]."""

    name: str
    height: float
    period: float


@dataclass(frozen=True)
class Water:
    """Water that waves run in: depth [m], gravity [m/s2], particle spacing [m], and for how long the run lasts [s], where that
    matters."""

    depth: float
    g: float
    spacing: float
    duration: float = 0.0

    def length(self, period: float) -> float:
        """Length [m] of a wave of this period [s] by linear theory."""
        return 2 * math.pi / wavenumber(2 * math.pi / period, self.depth, self.g)


class WaveKind(Part):
    """Base of every kind. One sets `kind: Literal["NAME"]`, adds its keys, and has at least `piston`."""

    absorb: bool = False  # the piston also gives way to waves that come back to it (active absorption)

    def piston(self, depth: float, g: float) -> Motion:
        """The motion of the piston in water of this depth [m]. Raises SceneError where its file cannot be read."""
        raise NotImplementedError(f"{type(self).__name__} has no piston")

    def incident(self, depth: float, g: float) -> IncidentWaves | None:
        """The waves anywhere in water of this depth [m], for a `[sea]`; None for a kind that only a piston makes."""
        return None

    def excursion(self, motion: Motion) -> tuple[float, float]:
        """The least and the largest displacement [m] of the piston; with active absorption it may leave its path."""
        back, forth = motion.excursion
        extra = room(motion) if self.absorb else 0.0
        return back - extra, forth + extra

    def surface(self, motion: Motion, depth: float, g: float) -> Surface:
        """The elevation that the piston's motion would make near it if nothing came back. By long-wave theory here: the
        water's velocity is that of the piston as the wave left it."""
        return lambda t, x: motion(t - x / math.sqrt(g * depth))[1] * math.sqrt(depth / g)

    def trains(self, water: Water) -> list[Train]:
        """The trains of waves that it is made of; damping zones and active absorption are judged by the longest."""
        return []

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        """Height [m] and period [s] of each linear wave of waves that go on for the whole run, for figures of what they
        carry; one alone where they are regular, none where they pass."""
        return []

    def faults(self, water: Water) -> Iterator[Fault]:
        """What cannot work."""
        return iter(())

    def warnings(self, water: Water) -> Iterator[str]:
        """What is allowed but likely not meant, one line each."""
        return iter(())

    def figures(self, water: Water) -> Iterator[str]:
        """The waves in figures, one line each: length, depth, steepness and resolution of each train."""
        dr, depth = water.spacing, water.depth
        for name, height, period in self.trains(water):
            length = water.length(period)
            kd = 2 * math.pi * depth / length
            yield (
                f"{name}, height {height:g} m, period {period:g} s, length {length:.3g} m, kd {kd:.2f}, "
                f"H/L {height / length:.3f}, {height / dr:.1f} spacings high, {length / dr:.0f} long"
            )

    def gain(self, depth: float, g: float) -> float:
        """Velocity of the piston over the elevation that it takes up in active absorption [1/s]: omega S/H at the longest
        period of its trains, sqrt(g / depth) of long waves where there is none."""
        periods = [train.period for train in self.trains(Water(depth, g, math.inf))]
        if not periods:
            return math.sqrt(g / depth)
        omega = 2 * math.pi / max(periods)
        return omega / piston_transfer(wavenumber(omega, depth, g) * depth)


def room(motion: Motion) -> float:
    """How far a piston that absorbs may leave its path [m]."""
    return max(-motion.excursion[0], motion.excursion[1])


def train_warnings(water: Water, key: str, height: float, period: float) -> Iterator[str]:
    """Breaking and resolution of regular waves."""
    depth, length = water.depth, water.length(period)
    if height > BREAKING_DEPTH_RATIO * depth:
        yield (
            f"{key}: {height:g} m is {height / depth:.2f} of the depth {depth:g} m; "
            f"waves break at about {BREAKING_DEPTH_RATIO}"
        )
    if height > BREAKING_STEEPNESS * length:
        yield (
            f"{key}: {height:g} m is {height / length:.2f} of the wave length {length:.3g} m; "
            f"waves break at {BREAKING_STEEPNESS} of it at most"
        )
    highest = BREAKING_STEEPNESS * length * math.tanh(2 * math.pi * depth / length)  # Miche (1944)
    if NEARLY * highest < height <= min(highest, BREAKING_DEPTH_RATIO * depth):
        yield (
            f"{key}: {height:g} m is {height / highest:.2f} of the {highest:.3g} m at which such waves break: they do so "
            "where they meet, as before a wall that sends them back; use lower or longer waves"
        )
    yield from resolved(water, "the wave height", height, LEAST_HEIGHT)
    yield from resolved(water, "the wave length", length, LEAST_LENGTH)


def resolved(water: Water, what: str, size: float, least: int) -> Iterator[str]:
    """Too few particles over a length [m] of the waves."""
    if size < least * water.spacing * (1 - 1e-9):
        yield (
            f"spacing: {water.spacing:g} m gives {size / water.spacing:.1f} particles over {what} "
            f"{size:.3g} m; such waves decay within a few lengths"
        )
