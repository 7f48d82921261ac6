"""How a step updates the pressure: a few sweeps over the neighbours, starting from the last step's pressure.

The pressure equation is A p = -s with A = D (1 - J), D its diagonal, J the Jacobi iteration matrix. A sweep computes
J(p) = (sum a_ij p_j - s_i) / a_ii and moves on by

    p' = p + alpha (J(p) - p) + beta (p - p_before).

With alpha = 1 and beta = 0 that is Jacobi's method; Chebyshev's weights (Golub & Varga 1961) damp the spectrum of D^-1 A
between `HIGHEST / span` and `HIGHEST` evenly, and carry slow modes on much faster. At the free surface and in spray
every sweep is Jacobi's: fragments of a few particles amplify under any other weights.

Starting from the last pressure, k sweeps are one step of a slightly compressible fluid: a slow mode of eigenvalue l
moves on by `gain` l of its way, so that sound travels at c = 0.378 h sqrt(gain) / dt (sum a_ij = 7 / (rho h^2) on a
lattice, in two dimensions and in three). The gain is k for Jacobi's method and larger for Chebyshev's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsi.scene import Numerics

SOUND = 1 / math.sqrt(7)  # c dt / h for a gain of one
HIGHEST = 1.35  # largest eigenvalue of D^-1 A met on disordered particles, in two and three dimensions
SPAN = 30.0  # of the spectrum that Chebyshev's weights are made for


@dataclass(frozen=True)
class Iteration:
    """weights: (alpha, beta) of each sweep of a step; gain: how far a slow mode moves on, in Jacobi sweeps."""

    weights: tuple[tuple[float, float], ...]
    gain: float


def iteration(numerics: Numerics) -> Iteration:
    """The sweeps of a step, as a scene asks for them."""
    if numerics.solver == "chebyshev":
        return chebyshev(numerics.sweeps)
    return Iteration(((1.0, 0.0),) * numerics.sweeps, float(numerics.sweeps))


def chebyshev(sweeps: int, span: float = SPAN) -> Iteration:
    """Chebyshev's weights for the spectrum HIGHEST / span to HIGHEST. The gain is minus the slope of the error polynomial
    T_k((centre - l) / half) / T_k(centre / half) at l = 0."""
    centre, half = 0.5 * HIGHEST * (1 + 1 / span), 0.5 * HIGHEST * (1 - 1 / span)
    sigma = centre / half
    weights, ratio = [(1 / centre, 0.0)], 1 / sigma
    for _ in range(sweeps - 1):
        last, ratio = ratio, 1 / (2 * sigma - ratio)
        weights.append((2 * ratio / half, ratio * last))
    angle = math.acosh(sigma)
    return Iteration(tuple(weights), sweeps * math.tanh(sweeps * angle) / (half * math.sinh(angle)))
