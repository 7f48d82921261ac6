"""A piston, or a joint, that follows a table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from fsi.errors import SceneError
from fsi.parts import FilePath
from fsi.tables import read_table
from fsi.waves.kind import Fault, Water, WaveKind


class Waves(WaveKind):
    """Piston that follows a table: columns time [s], displacement [m], commas, a header line."""

    kind: Literal["table"]
    file: FilePath

    def piston(self, depth: float, g: float) -> TablePiston:
        return TablePiston(self.file)

    def faults(self, water: Water) -> Iterator[Fault]:
        if fault := table_fault(self.file):
            yield "waves.file", *fault
            return
        motion = TablePiston(self.file)
        start = float(motion(0.0)[0])
        if abs(start) > 1e-6 * max(map(abs, motion.excursion)):
            first = f"the first row is {motion.t[0]:g}, {motion.x[0]:g}"
            fault = f"column position: {first}, so the piston begins at {start:.4g} m, and the wall is at 0"
            yield "waves.file", fault, f"add {-start:.4g} to the column, or begin with a row of 0"


class TablePiston:
    """Displacement from a table, as a natural cubic spline, held at its ends.

    Raises SceneError where the file is not two columns of at least three rows with increasing times.
    """

    def __init__(self, file: Path):
        self.t, self.x = read_motion_table(file)
        self.curvature = natural_spline(self.t, self.x)
        self.excursion = float(self.x.min()), float(self.x.max())

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


def table_fault(file: Path) -> tuple[str, str] | None:
    """Fault and fix of a motion table that is not there or cannot be read, None for a good one."""
    if not file.is_file():
        return f"no such file: {file}", "check the path; it is relative to the scene file"
    try:
        read_motion_table(file)
    except SceneError as error:
        return error.fault, error.fix
    return None
