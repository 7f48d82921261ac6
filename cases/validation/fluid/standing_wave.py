"""A standing wave of half a wavelength in a tank, let go from a flat surface with the velocities of linear theory.

Elevation eta = a sin(omega t) cos(k x), k = pi / L. Exact frequency to second order in k a, for water of this depth:
Tadjbakhsh & Keller (1960), J. Fluid Mech. 8, 442-451; to first order omega^2 = g k tanh(k d). The elevation of the
mode is a moment of all particles, 2 V / L sum cos(k x), which needs no free surface to be found. Loss of energy per
period: from the decay of the amplitude, squared; the decay of an inviscid wave is zero, and viscosity's 2 nu k^2 is far
below the target.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

LENGTH, DEPTH, PERIODS = 1.0, 0.5, 6
HEIGHT = 8  # crest to trough [spacing]
K = math.pi / LENGTH


def standing_frequency(k: float, depth: float, amplitude: float, g: float) -> float:
    """Angular frequency [1/s] of a standing wave of this amplitude [m], to second order (Tadjbakhsh & Keller 1960):
    omega / sqrt(g k) = w + (k a)^2 / 2 (9 w^-7 - 12 w^-3 - 3 w - 2 w^5) / 32, w^2 = tanh(k depth)."""
    w = math.sqrt(math.tanh(k * depth))
    second = (9 * w**-7 - 12 * w**-3 - 3 * w - 2 * w**5) / 32
    return math.sqrt(g * k) * (w + 0.5 * (k * amplitude) ** 2 * second)


def crossings(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Times at which y changes its sign, by linear interpolation."""
    i = np.flatnonzero(np.sign(y[1:]) * np.sign(y[:-1]) < 0)
    return t[i] - y[i] * (t[i + 1] - t[i]) / (y[i + 1] - y[i])


def extremes(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Time and size |y| of each extreme of y between two of its zeros, by a parabola through three points."""
    zeros = crossings(t, y)
    times, sizes = [], []
    for start, end in pairwise(zeros):
        inside = np.flatnonzero((t > start) & (t < end))
        i = inside[np.abs(y[inside]).argmax()]
        curve = np.polyfit(t[i - 1 : i + 2] - t[i], y[i - 1 : i + 2], 2)
        top = -curve[1] / (2 * curve[0])
        times.append(t[i] + top)
        sizes.append(abs(np.polyval(curve, top)))
    return np.array(times), np.array(sizes)


class Sloshing(Measure):
    """Period and decay of the first mode."""

    def begin(self, sim: Simulation) -> None:
        scene = sim.scene
        self.amplitude = 0.5 * HEIGHT * scene.spacing
        self.omega = standing_frequency(K, DEPTH, self.amplitude, scene.gravity)
        x, z = sim.fluid.position.T
        speed = self.amplitude * math.sqrt(scene.gravity * K * math.tanh(K * DEPTH)) / math.sinh(K * DEPTH)
        sim.fluid.velocity[:, 0] = -speed * np.cosh(K * (z + DEPTH)) * np.sin(K * x)
        sim.fluid.velocity[:, 1] = speed * np.sinh(K * (z + DEPTH)) * np.cos(K * x)
        self.time, self.mode = [], []

    def sample(self, sim: Simulation) -> None:
        total = np.cos(K * sim.fluid.position[:, 0]).sum()
        self.time.append(sim.time)
        self.mode.append(2 / LENGTH * sim.scene.spacing**2 * total)

    def errors(self) -> dict[str, float]:
        t, y = np.array(self.time), np.array(self.mode)
        zeros = crossings(t, y)
        period = 2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1)
        times, sizes = extremes(t, y)
        decay = -np.polyfit(times, np.log(sizes), 1)[0]
        return {
            "period": period * self.omega / (2 * math.pi) - 1,
            "energy_loss": 1 - math.exp(-2 * decay * period),
        }


def _scene(spacing: float, folder) -> dict:
    omega = math.sqrt(9.81 * K * math.tanh(K * DEPTH))
    return {
        "duration": PERIODS * 2 * math.pi / omega,
        "tank": {"min": [0.0, -DEPTH], "max": [LENGTH, 0.3]},
    }


NAMES = ("standing_wave",)
CASES = {
    "standing_wave": Case(
        "standing_wave",
        "Standing wave of half a wavelength in a tank 1 m long and 0.5 m deep, 8 spacings high",
        "Exact: frequency of Tadjbakhsh & Keller (1960) for finite amplitude; no loss of energy (measured per period).",
        {"coarse": 0.02, "medium": 0.01, "paper": 0.005},
        _scene,
        Sloshing,
        {"period": 0.005, "energy_loss": 0.03},
        "8 spacings of 20 mm are a wave as high as a third of the depth.",
    )
}
