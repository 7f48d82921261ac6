"""Linear wave theory and the motion of the piston wavemaker."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsi.errors import SceneError


def wavenumber(omega: float, depth: float, g: float) -> float:
    """Wavenumber k [1/m] of a wave of angular frequency omega [rad/s] in water of this depth [m]: the root of
    omega^2 = g k tanh(k depth), by Newton's method from the estimate of Guo (2002, eq. 10)."""
    alpha = omega * omega * depth / g
    kd = alpha / (1 - math.exp(-(alpha**1.25))) ** 0.4
    for _ in range(20):
        tanh = math.tanh(kd)
        change = (kd * tanh - alpha) / (tanh + kd * (1 - tanh * tanh))
        kd -= change
        if abs(change) < 1e-14 * kd:
            break
    return kd / depth


def piston_transfer(kd: float) -> float:
    """Wave height over stroke of a piston wavemaker, 2 (cosh 2kd - 1) / (sinh 2kd + 2kd)
    (Dean & Dalrymple 1991, eq. 6.25); written with exp(-2kd) so that deep water does not overflow."""
    e = math.exp(-2 * kd)
    return 2 * (1 - e) ** 2 / (1 - e * e + 4 * kd * e)


@dataclass(frozen=True)
class RegularPiston:
    """x = stroke/2 sin(omega t) under a cosine ramp; calling it gives displacement, velocity and acceleration."""

    stroke: float
    omega: float
    ramp: float

    def __call__(self, t: float) -> tuple[float, float, float]:
        a, w = 0.5 * self.stroke, self.omega
        s, c = math.sin(w * t), math.cos(w * t)
        if t >= self.ramp:
            return a * s, a * w * c, -a * w * w * s
        n = math.pi / self.ramp
        r, dr, ddr = 0.5 * (1 - math.cos(n * t)), 0.5 * n * math.sin(n * t), 0.5 * n * n * math.cos(n * t)
        return a * r * s, a * (dr * s + r * w * c), a * (ddr * s + 2 * dr * w * c - r * w * w * s)


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


def piston(waves, depth: float, g: float):
    """The motion t -> (x, velocity, acceleration) of the piston that a scene's `waves` asks for."""
    if waves.kind == "table":
        return TablePiston(waves.file)
    omega = 2 * math.pi / waves.period
    stroke = waves.wave_height / piston_transfer(wavenumber(omega, depth, g) * depth)
    return RegularPiston(stroke, omega, 2 * waves.period if waves.ramp is None else waves.ramp)
