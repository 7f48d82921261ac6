"""A piston, or a joint, that follows a table."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from fsi.errors import SceneError


class TablePiston:
    """Displacement from a table, as a natural cubic spline, held at its ends.

    Raises SceneError where the file is not two columns of at least three rows with increasing times.
    """

    def __init__(self, file: Path):
        self.t, self.x = read_motion_table(file)
        h = np.diff(self.t)
        n = len(h)
        system, right = np.eye(n + 1), np.zeros(n + 1)  # second derivatives at the knots
        for i in range(1, n):
            system[i, i - 1 : i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
            right[i] = 6 * ((self.x[i + 1] - self.x[i]) / h[i] - (self.x[i] - self.x[i - 1]) / h[i - 1])
        self.curvature = np.linalg.solve(system, right)
        self.reach = float(self.x.min()), float(self.x.max())

    def __call__(self, t: float) -> tuple[float, float, float]:
        if t <= self.t[0]:
            return self.x[0], 0.0, 0.0
        if t >= self.t[-1]:
            return self.x[-1], 0.0, 0.0
        i = int(np.searchsorted(self.t, t, side="right")) - 1
        h, (m0, m1), (x0, x1) = self.t[i + 1] - self.t[i], self.curvature[i : i + 2], self.x[i : i + 2]
        a, b = self.t[i + 1] - t, t - self.t[i]
        slope0, slope1 = x0 / h - m0 * h / 6, x1 / h - m1 * h / 6
        return (
            (m0 * a**3 + m1 * b**3) / (6 * h) + slope0 * a + slope1 * b,
            (m1 * b**2 - m0 * a**2) / (2 * h) - slope0 + slope1,
            (m0 * a + m1 * b) / h,
        )


def read_motion_table(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Columns time [s] and position of a comma-separated file with one header line. Raises SceneError."""
    try:
        with warnings.catch_warnings(action="ignore"):  # an empty table is refused below
            rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as fault:
        raise SceneError(str(fault), file=file, fix="give two comma-separated columns under one header line") from None
    if rows.shape[1] != 2 or len(rows) < 3 or (np.diff(rows[:, 0]) <= 0).any():
        raise SceneError(
            f"a motion table needs two columns and three or more rows with increasing times; this has {rows.shape}",
            file=file,
            fix="give time [s] and position in rows sorted by time",
        )
    return rows[:, 0], rows[:, 1]
