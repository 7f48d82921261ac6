"""What tests and measures do with time series."""

from __future__ import annotations

import numpy as np


def impulse(t: np.ndarray, y: np.ndarray, start: float, end: float) -> float:
    """Integral of y over time from start to end [s], by trapezoids; the ends are interpolated."""
    inside = t[(t > start) & (t < end)]
    times = np.concatenate([[start], inside, [end]])
    return float(np.trapezoid(np.interp(times, t, y), times))


def low_passed(t: np.ndarray, y: np.ndarray, window: float) -> np.ndarray:
    """Mean of y over `window` seconds around each time, as a sensor of finite bandwidth would read it."""
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(t))])
    low, high = np.maximum(t - 0.5 * window, t[0]), np.minimum(t + 0.5 * window, t[-1])
    return (np.interp(high, t, sums) - np.interp(low, t, sums)) / (high - low)


def relative_rms(found: np.ndarray, expected: np.ndarray, scale: float) -> float:
    """Root mean square of the differences, as a share of `scale`."""
    return float(np.sqrt(((found - expected) ** 2).mean()) / scale)
