"""Groups of regular waves in sequence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from fsi.parts import NonNegative, Part, Positive
from fsi.waves.kind import Surface, Train, Water, WaveKind, train_warnings
from fsi.waves.linear import piston_transfer, wavenumber


class WaveGroup(Part):
    """Some equal waves within a packet."""

    wave_height: Positive  # crest to trough [m]
    period: Positive  # [s]
    waves: Annotated[float, Field(gt=0, multiple_of=0.5)]  # how many, in halves


class Waves(WaveKind):
    """Groups of regular waves of linear theory, one after the other, the first crest ahead. The piston starts and ends
    at rest, in each group with the full amplitude from the first wave on."""

    kind: Literal["packet"]
    groups: tuple[WaveGroup, ...]
    start: NonNegative = 0.0  # when the piston begins to move [s]

    @model_validator(mode="after")
    def _some_group(self):
        if not self.groups:
            raise ValueError("a packet without groups; add [[waves.groups]] with wave_height, period and waves")
        return self

    def piston(self, depth: float, g: float) -> PacketPiston:
        return PacketPiston([(w.wave_height, w.period, w.waves) for w in self.groups], depth, g, self.start)

    def trains(self, water: Water) -> list[Train]:
        return [Train(f"{group.waves:g} waves", group.wave_height, group.period) for group in self.groups]

    def warnings(self, water: Water) -> Iterator[str]:
        for n, group in enumerate(self.groups):
            yield from train_warnings(water, f"waves.groups[{n}].wave_height", group.wave_height, group.period)

    def surface(self, motion, depth: float, g: float) -> Surface:
        pieces = [
            (start, end, omega, phase, 0.5 * group.wave_height, wavenumber(omega, depth, g))
            for (start, end, omega, _, phase, _), group in zip(motion.pieces, self.groups, strict=True)
        ]

        def elevation(t: float, x: float) -> float:
            for start, end, omega, phase, a, k in pieces:
                since = t - start - k / omega * x
                if 0 <= since < end - start:
                    return a * math.sin(phase + omega * since)
            return 0.0

        return elevation


class PacketPiston:
    """In each group of (wave height [m], period [s], number of waves) the piston's velocity is S/2 omega sin(phase), and
    the phase runs on from group to group. As each group ends after a whole number of half waves, velocity and
    displacement are continuous, each half wave has its full height, and the piston ends at rest, one stroke further
    for an odd half wave. `start` [s] is when it begins to move."""

    def __init__(self, groups: Sequence[tuple[float, float, float]], depth: float, g: float, start: float = 0.0):
        self.pieces = []  # (start, end, omega, half stroke, phase at the start, displacement at the start)
        x, phase = 0.0, 0.0
        turns = [0.0]
        for height, period, waves in groups:
            omega = 2 * math.pi / period
            half = 0.5 * height / piston_transfer(wavenumber(omega, depth, g) * depth)
            self.pieces.append((start, start + waves * period, omega, half, phase, x))
            halves = round(2 * waves)
            sign = math.cos(phase)  # 1 or -1
            turns += [x + 2 * half * sign, x]  # where the piston turns round within the group
            x += half * sign * (1 - (-1) ** halves)
            phase += math.pi * halves
            start += waves * period
        self.end, self.rest = start, x
        self.excursion = min(turns), max(turns)

    def __call__(self, t: float) -> tuple[float, float, float]:
        for start, end, omega, half, phase, x in self.pieces:
            if start <= t < end:
                angle = phase + omega * (t - start)
                s, c, c0 = math.sin(angle), math.cos(angle), math.cos(phase)
                return x + half * (c0 - c), half * omega * s, half * omega**2 * c
        return (self.rest if t >= self.end else 0.0), 0.0, 0.0
