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

`converged` goes on with Chebyshev's weights for the whole spectrum until a sweep changes the pressure by less than
`pressure_tolerance` of its maximum, at most `MOST` sweeps; its time step is that of Chebyshev's `sweeps`, so that the
two differ in nothing but the solution. The weights do not depend on the source: k sweeps are linear in it, and the
response to a body's acceleration is exact when it takes as many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsi.scene.model import Scene
from fsi.scene.numerics import Numerics

SOUND = 1 / math.sqrt(7)  # c dt / h for a gain of one
HIGHEST = 1.35  # largest eigenvalue of D^-1 A met on disordered particles, in two and three dimensions
MOST = 2000  # sweeps of a step to convergence
FARTHEST = 1.45  # eigenvalue that so many sweeps may meet, also between liquids of unequal density
SPAN = 30.0  # of the spectrum that Chebyshev's weights are made for


@dataclass(frozen=True)
class Iteration:
    """weights: (alpha, beta) of each sweep of a step; gain: how far a slow mode moves on, in Jacobi sweeps."""

    weights: tuple[tuple[float, float], ...]
    gain: float


def iteration(numerics: Numerics) -> Iteration:
    """The sweeps of a step, as a scene asks for them."""
    if numerics.solver in ("chebyshev", "converged"):
        return chebyshev(numerics.sweeps)
    return Iteration(((1.0, 0.0),) * numerics.sweeps, float(numerics.sweeps))


def solution(scene: Scene, depth: float, most: int = MOST) -> Iteration:
    """Sweeps that solve the pressure equation of a fluid `depth` metres high: as many as are needed of these."""
    return chebyshev(most, _span(scene, depth), FARTHEST)


def _span(scene: Scene, depth: float) -> float:
    """Of the spectrum, down to the slowest mode of the tank."""
    sides = [high - low for low, high in zip(scene.tank.min, scene.tank.max, strict=True)]
    wave = max(sides) if scene.closed else 2 * depth  # half length of the slowest mode [m]
    slowest = (SOUND * scene.smoothing_length * math.pi / wave) ** 2
    return FARTHEST / min(slowest, 0.5)


def sweeps_to(share: float, scene: Scene, depth: float) -> int:
    """Sweeps of `solution` that leave this share of any error."""
    span = _span(scene, depth)
    return min(MOST, math.ceil(math.acosh(1 / share) / math.acosh((span + 1) / (span - 1))))


def chebyshev(sweeps: int, span: float = SPAN, highest: float = HIGHEST) -> Iteration:
    """Chebyshev's weights for the spectrum highest / span to highest. The gain is minus the slope of the error polynomial
    T_k((centre - l) / half) / T_k(centre / half) at l = 0."""
    centre, half = 0.5 * highest * (1 + 1 / span), 0.5 * highest * (1 - 1 / span)
    sigma = centre / half
    weights, ratio = [(1 / centre, 0.0)], 1 / sigma
    for _ in range(sweeps - 1):
        last, ratio = ratio, 1 / (2 * sigma - ratio)
        weights.append((2 * ratio / half, ratio * last))
    angle = math.acosh(sigma)
    return Iteration(tuple(weights), sweeps * math.tanh(sweeps * angle) / (half * math.sinh(angle)))
