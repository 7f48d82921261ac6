"""How much of a wave a damping zone in front of a wall sends back."""

from __future__ import annotations

import math


def reflection(length: float, rate: float, steps: int = 400) -> float:
    """Reflected over incident height of a long wave that meets a zone of this length [wavelengths] in which velocities
    decay at `rate` [omega] times the square of the distance into it, and a wall behind.

    Linear long waves, eta_t + d u_x = 0 and u_t + g eta_x + r u = 0: the reflection R at x, towards -x over towards +x,
    obeys R' = -2 i R - (1 - R)^2 r / (2 omega) in units of 1/k, and is 1 at the wall."""
    end = 2 * math.pi * length
    h = -end / steps

    def slope(x: float, r: complex) -> complex:
        return -2j * r - 0.5 * rate * (x / end) ** 2 * (1 - r) ** 2

    x, r = end, 1 + 0j
    for _ in range(steps):  # Runge & Kutta, from the wall to the start
        a = slope(x, r)
        b = slope(x + 0.5 * h, r + 0.5 * h * a)
        c = slope(x + 0.5 * h, r + 0.5 * h * b)
        r += h / 6 * (a + 2 * b + 2 * c + slope(x + h, r + h * c))
        x += h
    return abs(r)
