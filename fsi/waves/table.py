"""A piston, or a joint, that follows a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsi.tables import read_table


class TablePiston:
    """Displacement from a table, as a natural cubic spline, held at its ends.

    Raises SceneError where the file is not two columns of at least three rows with increasing times.
    """

    def __init__(self, file: Path):
        self.t, self.x = read_motion_table(file)
        self.curvature = natural_spline(self.t, self.x)
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


def natural_spline(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Second derivatives (n,) at the knots t (n,) of the cubic spline through x (n,) that is straight at both ends, by
    elimination along the tridiagonal system (Thomas 1949; de Boor 1978, ch. IV)."""
    h = np.diff(t)
    right = 6 * np.diff(np.diff(x) / h)
    upper, middle = h[1:].tolist(), (2 * (h[:-1] + h[1:])).tolist()  # of the inner knots; symmetric
    right = right.tolist()
    for i in range(1, len(right)):
        share = upper[i - 1] / middle[i - 1]
        middle[i] -= share * upper[i - 1]
        right[i] -= share * right[i - 1]
    curvature, after = [0.0] * len(t), 0.0
    for i in reversed(range(len(right))):
        after = curvature[i + 1] = (right[i] - upper[i] * after) / middle[i]
    return np.array(curvature)


def read_motion_table(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Columns time [s] and position of a comma-separated file with one header line. Raises SceneError."""
    rows = read_table(file, ("time", "position"), 3)
    return rows[:, 0], rows[:, 1]
