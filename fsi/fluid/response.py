"""What accelerations of the owners change: linear responses of the pressure, found in its own sweeps.

A pressure update is linear in the accelerations that its walls move with. Each sweep of the pressure therefore takes along
the changes by a unit of each acceleration, in the groups of particles that they can have reached by then, so that a pair's
geometry and weights serve both.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fsi.sph import columns


class LinearResponse:
    """Responses to m accelerations in the course of one pressure update.

    rows (r, m): changes of the pressure, in the rows of the sweeps; twin (r, m): those before the last sweep; lift (b, m):
    of the boundary particles (`fsi.sph.walls.lift_of`); low, high (dim,): the box that they have reached.
    """

    def __init__(self, rows: np.ndarray, twin: np.ndarray, lift: np.ndarray, box: tuple[np.ndarray, np.ndarray], reach):
        self.rows, self.twin, self.lift = rows, twin, lift
        (self.low, self.high), self._reach = box, reach

    @classmethod
    def none(cls, dim: int, dtype) -> LinearResponse:
        """No responses."""
        empty, origin = np.empty((0, 0), dtype), np.zeros(dim)
        return cls(empty, empty, empty, (origin, origin), 0.0)

    @property
    def columns(self) -> int:
        return self.lift.shape[1]

    def begin(self, count: int, shepard: np.ndarray) -> None:
        """No change of the `count` fluid particles yet; the boundary, whose weights are `shepard` (b, ...), has its lift."""
        end = count + len(self.lift)
        self.rows[:end] = self.twin[:end] = 0.0
        total = columns.shepard(len(self.low)).total
        weight = shepard[: len(self.lift), total : total + 1]
        np.divide(self.lift, weight, out=self.rows[count:end], where=weight > 0)

    def spread(self) -> None:
        """From the boundary to the fluid that feels it, or back."""
        if self.columns:
            self.low, self.high = self.low - self._reach, self.high + self._reach

    def swap(self) -> None:
        self.rows, self.twin = self.twin, self.rows


def box_around(clouds: Iterable[np.ndarray], slack: float, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """The box around these points (b, dim), larger by `slack`; an empty one without any."""
    low, high = np.full(dim, np.inf), np.full(dim, -np.inf)
    for cloud in clouds:
        low, high = np.minimum(low, cloud.min(0, initial=np.inf)), np.maximum(high, cloud.max(0, initial=-np.inf))
    return low - slack, high + slack
