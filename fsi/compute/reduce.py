"""The one place where numbers of many particles become one: sums, means, extremes, in a fixed order.

A run in one process reduces with numpy, in the order in which the values stand. A run on several hands down another object of
the same methods, whose results are the same on all of them. The methods take what has not been reduced yet wherever they can,
so that such an object may put the values into an order that does not depend on the number of processes.
"""

from __future__ import annotations

import numpy as np

from fsi.compute.jit import exact

BLOCK = 4096  # labels whose particles are summed up together


class Reductions:
    """Reductions over the particles of one process; `values` (n, ...) are reduced along their first axis. `processes`: of how
    many the particles are."""

    processes = 1

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

    def gathered(self, which: np.ndarray, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        """The rows of the arrays of all processes, for sums over few particles, in the order of cells; `which` (k,) are the
        numbers of the particles that the rows (k, ...) are of."""
        return arrays

    def together(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        """The rows (k, ...) of the arrays of all processes, one process after the other."""
        return arrays

    def whole(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        """Arrays (n, ...) of all particles of all processes, in the order of cells, for the first process; the others get
        no rows."""
        return arrays

    def by_label(self, label: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
        """Sums (c,) of the values (n, c) of all particles, in the order of their labels, which are below `count`."""
        row = np.full(count, -1)
        row[label] = np.arange(len(label))
        return label_sums(row, values).sum(0)

    def at_largest(self, values: np.ndarray, position: np.ndarray) -> np.ndarray:
        """The position (dim,) of the particle with the largest of the values (n,)."""
        return position[int(np.argmax(values))]

    def loads(self, add, placed, order, position, owner, forces, wrenches) -> None:
        """Call `add(position, force, owner, wrench)` for each of the forces (m, b, dim) on boundary particles and of the
        wrenches (m, owners, 6), with the particles of all processes in the order of cells. Here are those at `position`
        (b, dim), of `owner` (b,), whose numbers among those that were `placed` are order (b,)."""
        for force, wrench in zip(forces, wrenches, strict=True):
            add(position, force, owner, wrench)

    def around(self, point: np.ndarray, reach: float, position: np.ndarray, *values: np.ndarray) -> tuple:
        """position (n, dim) and values (n, ...) of at least all particles that are within `reach` [m] of a point (dim,), or of
        the vertical through it where only its dim - 1 horizontal coordinates are given: what a gauge reads."""
        return (position, *values)


def label_sums(row: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sums (blocks, c) of the values (n, c) of each BLOCK of labels, one label after the other; row (labels,): where the values
    of each stand, negative for none."""
    sums = np.zeros((-(-len(row) // BLOCK), values.shape[1]))
    _add_up(row, values, sums)
    return sums


@exact
def _add_up(row, values, sums):
    for label in range(row.size):
        i = row[label]
        if i >= 0:
            for c in range(values.shape[1]):
                sums[label // BLOCK, c] += values[i, c]


SERIAL = Reductions()
