"""How much of a wave a damping zone in front of a wall sends back."""

from __future__ import annotations

import cmath
import math


def reflection(length: float, rate: float, power: float = 2.0, layers: int = 2000) -> float:
    """Reflected over incident height of a long wave that meets a zone of this length [wavelengths] in which velocities
    decay at `rate` [omega] times a power of the distance into it, and a wall behind.

    Linear long waves, eta_t + d u_x = 0 and u_t + g eta_x + r u = 0: in a layer of constant r the wave number is
    q = sqrt(1 + i r / omega) k and u / eta goes with 1 / q, so that the reflection follows from layer to layer, whatever the
    length and the rate. It is 1 at the wall."""
    thick, back = 2 * math.pi * length / layers, 1 + 0j
    for n in reversed(range(layers)):
        q = cmath.sqrt(1 + 1j * rate * ((n + 0.5) / layers) ** power)
        back *= cmath.exp(2j * q * thick)  # to the start of the layer and, from the wall, back
        before = cmath.sqrt(1 + 1j * rate * ((n - 0.5) / layers) ** power) if n else 1
        into, off = q * (1 + back), before * (1 - back)
        back = (into - off) / (into + off)
    return abs(back)
