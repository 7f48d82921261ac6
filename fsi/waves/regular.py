"""Regular waves: a sinusoidal piston, with the second harmonic that second-order waves need."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsi.waves.linear import piston_transfer

SECOND_ORDER_URSELL = 8 * math.pi**2 / 3  # from here on the trough of a second-order wave has a crest of its own


def second_order_stroke(wave_height: float, k: float, depth: float) -> float:
    """Amplitude [m] of the piston's second harmonic, H^2 / (32 d) (3 cosh kd / sinh^3 kd - 2 S/H) (Madsen 1971):
    it moves with the waves' bound second harmonic and makes up for the first harmonic being met off x = 0."""
    kd = k * depth
    e = math.exp(-2 * kd)
    bound = 3 * 4 * e * (1 + e) / (1 - e) ** 3  # 3 cosh kd / sinh^3 kd
    return wave_height**2 / (32 * depth) * (bound - 2 / piston_transfer(kd))


def order_of(waves, k: float, depth: float) -> int:
    """The order of `RegularWaves` of wavenumber k [1/m]: 2 if not given, but 1 where `ursell` is too large for it."""
    return waves.order or (2 if ursell(waves.wave_height, k, depth) < SECOND_ORDER_URSELL else 1)


def ursell(wave_height: float, k: float, depth: float) -> float:
    """Ursell's number H L^2 / d^3."""
    return wave_height * (2 * math.pi / k) ** 2 / depth**3


@dataclass(frozen=True)
class RegularPiston:
    """x = r(t) (stroke/2 sin(omega t) + second sin(2 omega t)) under the cosine ramp r of `ramp` seconds."""

    stroke: float
    omega: float
    ramp: float
    second: float = 0.0

    @property
    def reach(self) -> tuple[float, float]:
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


def cosine_ramp(t: float, ramp: float) -> tuple[float, float, float]:
    """A factor that rises from 0 at t = 0 to 1 at t = ramp [s], and its first two derivatives."""
    if t >= ramp:
        return 1.0, 0.0, 0.0
    n = math.pi / ramp
    return 0.5 * (1 - math.cos(n * t)), 0.5 * n * math.sin(n * t), 0.5 * n * n * math.cos(n * t)
