"""A round drop without gravity that a strain flow draws out into an ellipse.

Exact (Monaghan 1994, J. Comput. Phys. 110, 399-406): the velocities stay u = -A x, w = A z, the drop stays an ellipse with
semi-axes a along x and b along z, and dA/dt = A^2 (a^2 - b^2) / (a^2 + b^2), da/dt = -A a, db/dt = A b. The semi-axes of
the run are those of the ellipse with the same second moments, 2 sqrt(mean x^2) and 2 sqrt(mean z^2).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.case import Case, Measure
from fsi.simulation import Simulation

RADIUS, STRAIN, DURATION = 1.0, 1.0, 0.8  # R [m], A at the start [1/s], [s]


def exact_axes(t: float, radius: float = RADIUS, strain: float = STRAIN, steps: int = 1000) -> tuple[float, float]:
    """Semi-axes (a, b) [m] at time t [s], by the classical Runge-Kutta method."""

    def rate(y: np.ndarray) -> np.ndarray:
        a, b, A = y
        return np.array([-A * a, A * b, A * A * (a * a - b * b) / (a * a + b * b)])

    y, h = np.array([radius, radius, strain]), t / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + 0.5 * h * k1)
        k3 = rate(y + 0.5 * h * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3))
    return float(y[0]), float(y[1])


class Axes(Measure):
    """Semi-axes at the end, and the kinetic energy, all the energy that there is."""

    def begin(self, sim: Simulation) -> None:
        fluid = sim.fluid
        fluid.velocity[:] = STRAIN * fluid.position * [-1.0, 1.0]
        self.start = (fluid.velocity**2).sum()
        # the lattice fills the circle to within a cell or two
        self.scale = RADIUS / (2 * math.sqrt((fluid.position**2).mean()))

    def sample(self, sim: Simulation) -> None:
        self.energy = (sim.fluid.velocity**2).sum()
        self.axes = 2 * self.scale * np.sqrt((sim.fluid.position**2).mean(0))
        self.time = sim.time

    def errors(self) -> dict[str, float]:
        minor, major = exact_axes(self.time)
        return {
            "minor_axis": self.axes[0] / minor - 1,
            "major_axis": self.axes[1] / major - 1,
            "energy_loss": 1 - self.energy / self.start,
        }


def _scene(spacing: float, folder) -> dict:
    """The circle as columns of one particle's width, a block each; the tank is large enough for the drop at the end."""
    count = round(RADIUS / spacing)
    blocks = []
    for column in range(-count, count):
        half = math.sqrt(RADIUS**2 - ((column + 0.5) * spacing) ** 2)
        blocks.append({"min": [column * spacing, -half], "max": [(column + 1) * spacing, half]})
    return {
        "duration": DURATION,
        "gravity": 0.0,
        "tank": {"min": [-2 * RADIUS, -4 * RADIUS], "max": [2 * RADIUS, 4 * RADIUS], "walls": []},
        "fluid": {"kinematic_viscosity": 0.0, "start": "zero", "blocks": blocks},
        "numerics": {"max_time_step": 0.2 * spacing / (STRAIN * RADIUS)},
    }


CASES = {
    "elliptical_drop": Case(
        "elliptical_drop",
        "A round drop drawn out into an ellipse of axes 1 : 4",
        "Exact: semi-axes of Monaghan (1994) by their differential equation; the kinetic energy is constant.",
        {"coarse": RADIUS / 25, "medium": RADIUS / 50, "paper": RADIUS / 100},
        _scene,
        Axes,
        {"minor_axis": 0.02, "major_axis": 0.02, "energy_loss": 0.05},
    )
}
