"""Groups of regular waves in sequence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fsi.waves.linear import piston_transfer, wavenumber


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
        self.reach = min(turns), max(turns)

    def __call__(self, t: float) -> tuple[float, float, float]:
        for start, end, omega, half, phase, x in self.pieces:
            if start <= t < end:
                angle = phase + omega * (t - start)
                s, c, c0 = math.sin(angle), math.cos(angle), math.cos(phase)
                return x + half * (c0 - c), half * omega * s, half * omega**2 * c
        return (self.rest if t >= self.end else 0.0), 0.0, 0.0
