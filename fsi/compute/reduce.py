"""The one place where numbers of many particles become one: sums, means, extremes, in a fixed order.

A run in one process reduces with numpy, in the order in which the values stand. A run on several hands down another object of
the same methods, whose results are the same on all of them. The methods take what has not been reduced yet wherever they can,
so that such an object may put the values into an order that does not depend on the number of processes.
"""

from __future__ import annotations

import numpy as np


class Reductions:
    """Reductions over the particles of one process; `values` (n, ...) are reduced along their first axis."""

    def total(self, values: np.ndarray) -> np.ndarray:
        """Sum of the values of all particles, or of all chunks of particles."""
        return values.sum(0)

    def weighted(self, weights: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Sum of the values, each times its weight (n,)."""
        return weights @ values

    def mean(self, values: np.ndarray) -> np.ndarray:
        return values.mean(0)

    def largest(self, values: np.ndarray, least: float = 0.0) -> np.ndarray:
        """Maximum of the values and `least`."""
        return values.max(0, initial=least)

    def smallest(self, values: np.ndarray) -> np.ndarray:
        return values.min(0)

    def largest_of(self, part: float) -> float:
        """Maximum over the processes of what each of them has found alone."""
        return part

    def combined(self, part):
        """Sum over the processes of what each of them has summed up alone: a number or an array."""
        return part

    def gathered(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        """The rows of the arrays of all processes, for sums over few particles."""
        return arrays

    def around(self, point: np.ndarray, reach: float, position: np.ndarray, *values: np.ndarray) -> tuple:
        """position (n, dim) and values (n, ...) of at least all particles that are within `reach` [m] of a point (dim,), or of
        the vertical through it where only its dim - 1 horizontal coordinates are given: what a gauge reads."""
        return (position, *values)


SERIAL = Reductions()
