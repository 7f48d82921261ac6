"""Extreme values: the largest response of a storm, from the largest values of runs with different seeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

EULER = 0.5772156649015329
DRAWS = 2000  # of the parametric bootstrap
GOAL = 0.1  # relative half width of the 95 % confidence interval that the runs are to reach


@dataclass(frozen=True)
class Extreme:
    """Of a storm: the most probable largest value `mode` and the one that 95 of 100 storms stay below, `high`, with its 95 %
    confidence interval from `high_low` to `high_high`; how many seeds would bring that to +-10 %."""

    mode: float
    high: float
    high_low: float
    high_high: float
    seeds: float


def gumbel_fit(maxima: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Location and scale of a Gumbel distribution of block maxima (.., n) by probability-weighted moments
    (Landwehr, Matalas & Wallis 1979): scale (2 b1 - b0) / ln 2, location b0 - 0.5772 scale."""
    x = np.sort(np.asarray(maxima, float), axis=-1)
    n = x.shape[-1]
    b0 = x.mean(axis=-1)
    b1 = (np.arange(n) * x).sum(axis=-1) / (n * (n - 1))
    scale = (2 * b1 - b0) / math.log(2)
    return b0 - EULER * scale, scale


def largest_of(location, scale, repeats: float):
    """The most probable largest value of `repeats` independent blocks, and the value that 95 of 100 such largest stay
    below: the distribution to the power of repeats is a Gumbel again, its location moved by scale ln(repeats)."""
    mode = location + scale * math.log(repeats)
    return mode, mode - scale * math.log(-math.log(0.95))


def draws(location: float, scale: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Fits (draws,) to samples of n from a Gumbel distribution: how far a fit to so few can be off (parametric bootstrap, Efron
    & Tibshirani 1993, section 6.5)."""
    uniform = np.random.default_rng(0).random((DRAWS, n))
    return gumbel_fit(location - scale * np.log(-np.log(uniform)))


def storm_extreme(maxima: np.ndarray, repeats: float) -> Extreme:
    """The extreme of a storm of `repeats` times the length of the runs with these largest values (n,), three or more."""
    n = len(maxima)
    location, scale = map(float, gumbel_fit(maxima))
    mode, high = largest_of(location, scale, repeats)
    low, upper = np.quantile(largest_of(*draws(location, scale, n), repeats)[1], (0.025, 0.975))
    half = 0.5 * float(upper - low)
    seeds = max(n * (half / (GOAL * abs(high))) ** 2, 3.0) if high else math.nan
    return Extreme(mode, high, float(low), float(upper), float(math.ceil(seeds)) if math.isfinite(seeds) else math.nan)
