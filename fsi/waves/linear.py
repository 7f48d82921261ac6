"""Linear theory of waves over a flat bed, and of the piston that makes them."""

from __future__ import annotations

import math

import numpy as np


def wavenumber(omega: float, depth: float, g: float) -> float:
    """Wavenumber k [1/m] of a wave of angular frequency omega [rad/s] in water of this depth [m]: the root of
    omega^2 = g k tanh(k depth), by Newton's method from the estimate of Guo (2002, eq. 10)."""
    alpha = omega * omega * depth / g
    kd = alpha / (1 - math.exp(-(alpha**1.25))) ** 0.4
    for _ in range(20):
        tanh = math.tanh(kd)
        change = (kd * tanh - alpha) / (tanh + kd * (1 - tanh * tanh))
        kd -= change
        if abs(change) < 1e-14 * kd:
            break
    return kd / depth


def piston_transfer(kd: float) -> float:
    """Wave height over stroke of a piston wavemaker, 2 (cosh 2kd - 1) / (sinh 2kd + 2kd)
    (Dean & Dalrymple 1991, eq. 6.25); written with exp(-2kd) so that deep water does not overflow."""
    e = math.exp(-2 * kd)
    return 2 * (1 - e) ** 2 / (1 - e * e + 4 * kd * e)


def evanescent(omega: float | np.ndarray, depth: float, g: float, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Wavenumbers k_j (..., count) [1/m], for omega (...), of the first modes that die away from a piston as exp(-k_j x), the
    roots of omega^2 = -g k_j tan(k_j depth), and their elevation over the displacement of the piston, with which it is in
    phase, 4 sin^2 k_j d / (2 k_j d + sin 2 k_j d) (Dean & Dalrymple 1991, ch. 6)."""
    alpha = np.asarray(omega)[..., None] ** 2 * depth / g
    high = math.pi * np.arange(1, count + 1)
    low = high - 0.5 * math.pi
    for _ in range(50):  # bisection: -kd tan(kd) falls from infinity to 0
        middle = 0.5 * (low + high)
        above = -middle * np.tan(middle) > alpha
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return high / depth, 4 * np.sin(high) ** 2 / (2 * high + np.sin(2 * high))


def cosine_ramp(t: float, ramp: float) -> tuple[float, float, float]:
    """A factor that rises from 0 at t = 0 to 1 at t = ramp [s], and its first two derivatives."""
    if t >= ramp:
        return 1.0, 0.0, 0.0
    n = math.pi / ramp
    return 0.5 * (1 - math.cos(n * t)), 0.5 * n * math.sin(n * t), 0.5 * n * n * math.cos(n * t)
