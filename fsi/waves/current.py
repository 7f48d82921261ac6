"""Waves on a current U that is uniform over the depth.

Water that drifts with the current knows nothing of it: waves there have the frequency sigma of still water, and seen from a
fixed place omega = sigma + k U, so that (omega - k U)^2 = g k tanh k d for low ones (Peregrine 1976, Adv. Appl. Mech. 16,
eq. 2.8). Against a current faster than their energy travels there are none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fsi.errors import SceneError
from fsi.waves.incident import IncidentWaves
from fsi.waves.kind import WaveKind
from fsi.waves.linear import wavenumber

TRIES = 30  # of Newton's method for the period in the water; waves of finite height take a few more than low ones
CLOSE = 1e-12  # of the frequency


def group_speed(k: float, depth: float, g: float) -> float:
    """Speed [m/s] at which the energy of waves of wavenumber k [1/m] travels in still water."""
    kd = k * depth
    return 0.5 * math.sqrt(g / k * math.tanh(kd)) * (1 + 2 * kd / math.sinh(2 * kd) if kd < 300 else 1.0)


def intrinsic(omega: float, depth: float, g: float, current: float) -> float:
    """Frequency sigma [rad/s] in the water of low waves that are seen at omega, on a current [m/s] along their way: the root of
    sigma + k current = omega. Raises ArithmeticError where the current lets none through."""

    def speed(sigma: float) -> float:
        return group_speed(wavenumber(sigma, depth, g), depth, g)

    def seen(sigma: float) -> float:
        return sigma + wavenumber(sigma, depth, g) * current

    if current >= 0:
        return _bisected(lambda sigma: seen(sigma) < omega, 0.0, omega)
    if current <= -math.sqrt(g * depth):
        raise ArithmeticError(f"{-current:g} m/s against them is faster than any wave travels in {depth:g} m of water")
    most = g / -current  # twice the frequency of deep water's waves whose energy it stops
    most = _bisected(lambda sigma: speed(sigma) > -current, 0.0, most)
    if seen(most) < omega:
        raise ArithmeticError(f"{-current:g} m/s against them is faster than their energy travels")
    return _bisected(lambda sigma: seen(sigma) < omega, 0.0, most)


def _bisected(below: Callable[[float], bool], low: float, high: float) -> float:
    """Where `below` turns from True to False between low and high."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) else (low, middle)
    return 0.5 * (low + high)


def drifting(waves: IncidentWaves) -> IncidentWaves:
    """The waves in water without the return flow of a closed tank."""
    sigma = waves.omega - waves.k * waves.drift
    return replace(waves, omega=sigma, potential=waves.potential * waves.omega / sigma, drift=0.0)


def retimed(kind: WaveKind, depth: float, g: float, current: float) -> WaveKind:
    """Regular waves of the period at which water that drifts with the current [m/s, along their way] sees those that a fixed
    place sees at the period of `kind`, of whatever theory. Raises SceneError where the current lets none through."""
    omega = 2 * math.pi / kind.period
    try:
        sigma = intrinsic(omega, depth, g, current)
        for _ in range(TRIES):
            found = kind.model_copy(update={"period": 2 * math.pi / sigma})
            waves = drifting(found.incident(depth, g))
            off = omega - waves.omega[0] - waves.k[0] * current
            if abs(off) < CLOSE * omega:
                return found
            slope = 1 + current / group_speed(waves.k[0], depth, g)
            sigma += off / max(slope, 0.05)
    except ArithmeticError as fault:
        raise SceneError(
            f"there are no waves of {kind.period:g} s on this current: {fault}",
            key="sea.current",
            fix="use a slower current or longer waves",
        ) from None
    raise SceneError(
        f"{-current:g} m/s against waves of {kind.period:g} s nearly stop them",
        key="sea.current",
        fix="use a slower current or longer waves",
    )


def on_current(waves: IncidentWaves, current: np.ndarray, endless: bool) -> IncidentWaves:
    """Waves on a current (2,) [m/s]. `endless`: along a periodic axis, where no water has to flow back."""
    return replace(drifting(waves) if endless else waves, current=np.asarray(current, float))
