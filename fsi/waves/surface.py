"""The elevation near the piston that each kind of waves would have if nothing came back."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fsi.waves.linear import evanescent, wavenumber

Surface = Callable[[float, float], float]  # time [s], distance from the piston's mean position [m] -> elevation [m]


def surface(waves, motion, depth: float, g: float) -> Surface:
    """The elevation that the motion of the piston for a scene's `waves` makes in water of this depth [m]: progressive
    waves and, for regular and irregular ones, the modes that stay near the piston; for a table by long-wave theory."""
    return {
        "regular": _regular,
        "irregular": _irregular,
        "solitary": _solitary,
        "packet": _packet,
        "table": _table,
    }[waves.kind](waves, motion, depth, g)


def _regular(waves, motion, depth: float, g: float) -> Surface:
    k, a = wavenumber(motion.omega, depth, g), 0.5 * waves.wave_height
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


def _irregular(waves, motion, depth: float, g: float) -> Surface:
    k = np.array([wavenumber(w, depth, g) for w in motion.omega])
    modes = [evanescent(w, depth, g) for w in motion.omega]
    decay, share = (np.array(part) for part in zip(*modes, strict=True))

    def elevation(t: float, x: float) -> float:
        angle = motion.omega * t + motion.phase
        near = (share * np.exp(-decay * x)).sum(1)
        eta = motion.wave_amplitude @ np.cos(angle - k * x) + (motion.amplitude * near) @ np.sin(angle)
        return motion.envelope(t) * float(eta)

    return elevation


def _solitary(waves, motion, depth: float, g: float) -> Surface:
    crest = motion.start + 0.5 * motion.time  # when it passes the middle of the stroke

    def elevation(t: float, x: float) -> float:
        theta = motion.k * (motion.speed * (t - crest) - (x - 0.5 * motion.stroke))
        return waves.wave_height / math.cosh(min(abs(theta), 50.0)) ** 2

    return elevation


def _packet(waves, motion, depth: float, g: float) -> Surface:
    pieces = [
        (start, end, omega, phase, 0.5 * group.wave_height, wavenumber(omega, depth, g))
        for (start, end, omega, _, phase, _), group in zip(motion.pieces, waves.groups, strict=True)
    ]

    def elevation(t: float, x: float) -> float:
        for start, end, omega, phase, a, k in pieces:
            since = t - start - k / omega * x
            if 0 <= since < end - start:
                return a * math.sin(phase + omega * since)
        return 0.0

    return elevation


def _table(waves, motion, depth: float, g: float) -> Surface:
    return lambda t, x: motion(t - x / math.sqrt(g * depth))[1] * math.sqrt(depth / g)
