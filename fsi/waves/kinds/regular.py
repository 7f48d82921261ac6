"""Regular waves: a sinusoidal piston, with the second harmonic that second-order waves need."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fsi.parts import NonNegative, Positive
from fsi.waves.incident import IncidentWaves, linear_waves, stokes_wave
from fsi.waves.kind import Fault, Surface, Train, Water, WaveKind, train_warnings
from fsi.waves.linear import cosine_ramp, evanescent, piston_transfer, wavenumber

SECOND_ORDER_URSELL = 8 * math.pi**2 / 3  # from here on the trough of a second-order wave has a crest of its own


def second_order_stroke(wave_height: float, k: float, depth: float) -> float:
    """Amplitude [m] of the piston's second harmonic, H^2 / (32 d) (3 cosh kd / sinh^3 kd - 2 S/H) (Madsen 1971):
    it moves with the waves' bound second harmonic and makes up for the first harmonic being met off x = 0."""
    kd = k * depth
    e = math.exp(-2 * kd)
    bound = 3 * 4 * e * (1 + e) / (1 - e) ** 3  # 3 cosh kd / sinh^3 kd
    return wave_height**2 / (32 * depth) * (bound - 2 / piston_transfer(kd))


def ursell(wave_height: float, k: float, depth: float) -> float:
    """Ursell's number H L^2 / d^3."""
    return wave_height * (2 * math.pi / k) ** 2 / depth**3


class Waves(WaveKind):
    """Sinusoidal waves by linear theory (Dean & Dalrymple 1991, eq. 6.25). The second order adds the motion that keeps
    the crests sharp without setting free off waves of twice the frequency (Madsen 1971)."""

    kind: Literal["regular"] = "regular"
    wave_height: Positive  # crest to trough [m]
    period: Positive  # [s]
    order: Literal[1, 2] | None = None  # 2 within its range, H L^2 / d^3 < 8 pi^2 / 3, and 1 beyond if not given
    ramp: NonNegative | None = None  # cosine ramp of the stroke [s]; two periods if not given

    def order_in(self, k: float, depth: float) -> int:
        """The order for waves of wavenumber k [1/m]: 2 if not given, but 1 where `ursell` is too large for it."""
        return self.order or (2 if ursell(self.wave_height, k, depth) < SECOND_ORDER_URSELL else 1)

    def piston(self, depth: float, g: float) -> RegularPiston:
        omega = 2 * math.pi / self.period
        k = wavenumber(omega, depth, g)
        stroke = self.wave_height / piston_transfer(k * depth)
        second = second_order_stroke(self.wave_height, k, depth) if self.order_in(k, depth) == 2 else 0.0
        return RegularPiston(stroke, omega, 2 * self.period if self.ramp is None else self.ramp, second)

    def incident(self, depth: float, g: float) -> IncidentWaves:
        omega = 2 * math.pi / self.period
        if self.order_in(wavenumber(omega, depth, g), depth) == 2:
            return stokes_wave(self.wave_height, self.period, depth, g)
        return linear_waves(np.array([0.5 * self.wave_height]), np.array([omega]), np.zeros(1), depth, g)

    def trains(self, water: Water) -> list[Train]:
        order = self.order_in(2 * math.pi / water.length(self.period), water.depth)
        return [Train(f"order {order}", self.wave_height, self.period)]

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        return [(self.wave_height, self.period)]

    def faults(self, water: Water) -> Iterator[Fault]:
        if self.order == 2:
            number = ursell(self.wave_height, 2 * math.pi / water.length(self.period), water.depth)
            if number >= SECOND_ORDER_URSELL:
                fault = f"H L^2 / d^3 is {number:.0f}, and the second order ends at {SECOND_ORDER_URSELL:.0f}"
                yield "waves.order", fault, "set order = 1, or use lower or shorter waves, or deeper water"

    def warnings(self, water: Water) -> Iterator[str]:
        return train_warnings(water, "waves.wave_height", self.wave_height, self.period)

    def surface(self, motion, depth: float, g: float) -> Surface:
        k, a = wavenumber(motion.omega, depth, g), 0.5 * self.wave_height
        decay, share = evanescent(motion.omega, depth, g)
        second = bound_harmonic(a, k, depth) if motion.second else 0.0

        def elevation(t: float, x: float) -> float:
            phase, near = motion.omega * t, 0.5 * motion.stroke * float(share @ np.exp(-decay * x))
            eta = a * math.cos(phase - k * x) + second * math.cos(2 * (phase - k * x)) + near * math.sin(phase)
            return motion.envelope(t) * eta

        return elevation


def bound_harmonic(a: float, k: float, depth: float) -> float:
    """Amplitude [m] of the second harmonic that travels with a wave of amplitude a [m] (Stokes' second order; Dean &
    Dalrymple 1991, ch. 11): a^2 k / 4 cosh kd (2 + cosh 2kd) / sinh^3 kd."""
    kd = k * depth
    return 0.25 * a * a * k * math.cosh(kd) * (2 + math.cosh(2 * kd)) / math.sinh(kd) ** 3


@dataclass(frozen=True)
class RegularPiston:
    """x = r(t) (stroke/2 sin(omega t) + second sin(2 omega t)) under the cosine ramp r of `ramp` seconds."""

    stroke: float
    omega: float
    ramp: float
    second: float = 0.0

    @property
    def excursion(self) -> tuple[float, float]:
        most = 0.5 * abs(self.stroke) + abs(self.second)
        return -most, most

    def envelope(self, t: float) -> float:
        """The factor of the ramp."""
        return cosine_ramp(t, self.ramp)[0]

    def __call__(self, t: float) -> tuple[float, float, float]:
        w, x, u, a = self.omega, 0.0, 0.0, 0.0
        for amplitude, n in ((0.5 * self.stroke, 1), (self.second, 2)):
            s, c = amplitude * math.sin(n * w * t), amplitude * math.cos(n * w * t)
            x, u, a = x + s, u + n * w * c, a - (n * w) ** 2 * s
        r, dr, ddr = cosine_ramp(t, self.ramp)
        return r * x, dr * x + r * u, ddr * x + 2 * dr * u + r * a
