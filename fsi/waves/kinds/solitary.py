"""A solitary wave from a piston that moves with the water under it (Goring 1978)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from fsi.parts import NonNegative, Positive
from fsi.waves.kind import BREAKING_DEPTH_RATIO, LEAST_HEIGHT, Fault, Surface, Water, WaveKind, resolved

TAIL = 5.0  # theta at which the wave's endless ends are cut: eta is 2e-4 H there


class Waves(WaveKind):
    """One solitary wave, by the piston's path of Goring (1978): the piston moves forward once and stays there."""

    kind: Literal["solitary"]
    wave_height: Positive  # crest above still water [m]
    theory: Literal["boussinesq", "rayleigh"] = "rayleigh"  # of the wave's shape; rayleigh suits higher waves better
    start: NonNegative = 0.0  # when the piston begins to move [s]

    def piston(self, depth: float, g: float) -> SolitaryPiston:
        return SolitaryPiston(self.wave_height, depth, g, self.theory, self.start)

    def faults(self, water: Water) -> Iterator[Fault]:
        if self.wave_height > BREAKING_DEPTH_RATIO * water.depth:
            fault = f"{self.wave_height:g} m is more than {BREAKING_DEPTH_RATIO} of the depth {water.depth:g} m"
            yield "waves.wave_height", f"{fault}, where a solitary wave breaks", "use a lower wave or deeper water"

    def warnings(self, water: Water) -> Iterator[str]:
        return resolved(water, "the wave height", self.wave_height, LEAST_HEIGHT)

    def figures(self, water: Water) -> Iterator[str]:
        height, depth = self.wave_height, water.depth
        speed = math.sqrt(water.g * (depth + height))
        over = height / water.spacing
        yield f"height {height:g} m, H/d {height / depth:.2f}, speed {speed:.3g} m/s, {over:.1f} spacings high"

    def surface(self, motion, depth: float, g: float) -> Surface:
        crest = motion.start + 0.5 * motion.time  # when it passes the middle of the stroke

        def elevation(t: float, x: float) -> float:
            theta = motion.k * (motion.speed * (t - crest) - (x - 0.5 * motion.stroke))
            return self.wave_height / math.cosh(min(abs(theta), 50.0)) ** 2

        return elevation


class SolitaryPiston:
    """The piston's velocity is the mean one of the water at its face, u = c eta / (d + eta), under the wave
    eta = H sech^2(theta), theta = k (c t - x): its path is x = H / (k d) tanh(theta).

    c = sqrt(g (d + H)), and k = sqrt(3 H / (4 d^3)) for Boussinesq's wave or sqrt(3 H / (4 d^2 (d + H))) for
    Rayleigh's. The piston waits until `start` [s], moves forward by the stroke 2 H / (k d) in `time` seconds, and stays.
    """

    def __init__(self, wave_height: float, depth: float, g: float, theory: str = "rayleigh", start: float = 0.0):
        self.wave_height, self.depth, self.start = wave_height, depth, start
        self.speed = math.sqrt(g * (depth + wave_height))
        self.k = math.sqrt(0.75 * wave_height / (depth**2 * (depth + (wave_height if theory == "rayleigh" else 0.0))))
        self.half = wave_height / (self.k * depth)  # half of the endless path
        self.time = 2 * (TAIL / self.k + self.half * math.tanh(TAIL)) / self.speed
        self.end = start + self.time
        self.stroke = 2 * self.half * math.tanh(TAIL)

    @property
    def excursion(self) -> tuple[float, float]:
        return 0.0, self.stroke

    def __call__(self, t: float) -> tuple[float, float, float]:
        t -= self.start
        if t <= 0:
            return 0.0, 0.0, 0.0
        if t >= self.time:
            return self.stroke, 0.0, 0.0
        theta = self._theta(t - 0.5 * self.time)
        c, d, tanh = self.speed, self.depth, math.tanh(theta)
        eta = self.wave_height * (1 - tanh * tanh)
        rate = self.k * c * d / (d + eta)  # d theta / dt
        acceleration = c * d / (d + eta) ** 2 * (-2 * eta * tanh) * rate
        return self.half * tanh + 0.5 * self.stroke, c * eta / (d + eta), acceleration

    def _theta(self, t: float) -> float:
        """The root of theta / k + H / (k d) tanh(theta) = c t, by Newton's method; the left side rises steadily."""
        target, theta = self.speed * t, 0.0
        for _ in range(50):
            tanh = math.tanh(theta)
            change = (theta / self.k + self.half * tanh - target) / (1 / self.k + self.half * (1 - tanh * tanh))
            theta -= change
            if abs(change) < 1e-14:
                break
        return theta
