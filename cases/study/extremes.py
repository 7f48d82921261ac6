"""Extreme values: the largest response of a storm, from the largest values of runs with different seeds."""

from __future__ import annotations

import math

import numpy as np

EULER = 0.5772156649015329


def gumbel_fit(maxima: np.ndarray) -> tuple[float, float]:
    """Location and scale of a Gumbel distribution of block maxima by probability-weighted moments
    (Landwehr, Matalas & Wallis 1979): scale (2 b1 - b0) / ln 2, location b0 - 0.5772 scale."""
    x = np.sort(np.asarray(maxima, float))
    n = len(x)
    b0 = x.mean()
    b1 = float(np.sum(np.arange(n) * x) / (n * (n - 1)))
    scale = (2 * b1 - b0) / math.log(2)
    return float(b0 - EULER * scale), float(scale)


def largest_of(location: float, scale: float, repeats: float) -> tuple[float, float]:
    """The most probable largest value of `repeats` independent blocks, and the value that 95 of 100 such largest stay
    below: the distribution to the power of repeats is a Gumbel again, its location moved by scale ln(repeats)."""
    mode = location + scale * math.log(repeats)
    return mode, mode - scale * math.log(-math.log(0.95))
