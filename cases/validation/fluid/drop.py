"""A round drop without gravity in a strain flow: free, it is drawn out into an ellipse; in a central force field it
oscillates between two.

Exact (Monaghan 1994, J. Comput. Phys. 110, 399-406; with the force -B^2 x, Monaghan & Rafiee 2013, Int. J. Numer. Meth.
Fluids 71, 537-561): the velocities stay u = -A x, w = A z, the drop stays an ellipse with semi-axes a along x and b along
z, and dA/dt = (A^2 + B^2) (a^2 - b^2) / (a^2 + b^2), da/dt = -A a, db/dt = A b. The semi-axes of the run are those of the
ellipse with the same second moments, 2 sqrt(mean x^2) and 2 sqrt(mean z^2).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from cases.validation.fluid.standing_wave import crossings
from fsi.simulation.loop import Simulation

RADIUS, STRAIN, DURATION = 1.0, 1.0, 0.8  # R [m], A at the start [1/s], [s]
FIELD, PERIOD, PERIODS = 1.0, 4.827, 3  # B [1/s]; period [s] for A = B; how many of them are run


def exact_axes(t: float, field: float = 0.0, steps: int = 1000) -> tuple[float, float]:
    """Semi-axes (a, b) [m] at time t [s] in a field B [1/s], by the classical Runge-Kutta method."""

    def rate(y: np.ndarray) -> np.ndarray:
        a, b, A = y
        return np.array([-A * a, A * b, (A * A + field**2) * (a * a - b * b) / (a * a + b * b)])

    y, h = np.array([RADIUS, RADIUS, STRAIN]), t / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + 0.5 * h * k1)
        k3 = rate(y + 0.5 * h * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3))
    return float(y[0]), float(y[1])


def strain(position: np.ndarray) -> np.ndarray:
    """Velocity (n, 2) [m/s] at the start."""
    return STRAIN * position * [-1.0, 1.0]


class Strain(Measure):
    """Semi-axes and energy (per mass of a particle) of the drop that starts with the strain flow."""

    field = 0.0

    def begin(self, sim: Simulation) -> None:
        fluid = sim.fluid
        fluid.velocity[:] = strain(fluid.position)
        self.start = self.energy_of(fluid)
        # the lattice fills the circle to within a cell or two
        self.scale = RADIUS / (2 * math.sqrt((fluid.position**2).mean()))

    def energy_of(self, fluid) -> float:
        return float((fluid.velocity**2).sum() + self.field**2 * (fluid.position**2).sum())

    def axes_of(self, fluid) -> np.ndarray:
        return 2 * self.scale * np.sqrt((fluid.position**2).mean(0))


class Axes(Strain):
    """Semi-axes at the end, and the kinetic energy, all the energy that there is."""

    def sample(self, sim: Simulation) -> None:
        self.energy, self.axes, self.time = self.energy_of(sim.fluid), self.axes_of(sim.fluid), sim.time

    def errors(self) -> dict[str, float]:
        minor, major = exact_axes(self.time)
        return {
            "minor_axis": self.axes[0] / minor - 1,
            "major_axis": self.axes[1] / major - 1,
            "energy_loss": 1 - self.energy / self.start,
        }


class Oscillation(Strain):
    """Period, the smallest axis reached in each half period, and the loss of energy.

    log(b / a) passes zero twice a period. The energy lost is a share of what the motion adds to that of the round drop at
    rest, the least there is."""

    field = FIELD

    def begin(self, sim: Simulation) -> None:
        super().begin(sim)
        self.least = self.field**2 * float((sim.fluid.position**2).sum())
        self.time, self.stretch, self.energy = [0.0], [0.0], self.start

    def sample(self, sim: Simulation) -> None:
        a, b = self.axes_of(sim.fluid)
        self.time.append(sim.time)
        self.stretch.append(math.log(b / a))
        self.energy = self.energy_of(sim.fluid)

    def errors(self) -> dict[str, float]:
        t, stretch = np.array(self.time), np.array(self.stretch)
        zeros = np.concatenate([[0.0], crossings(t[1:], stretch[1:])])
        minor, major = exact_axes(0.25 * PERIOD, FIELD)
        first = stretch[t < 0.5 * PERIOD].max()
        return {
            "period": 2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1) / PERIOD - 1,
            "first_stretch": first / math.log(major / minor) - 1,
            "energy_loss": (self.start - self.energy) / (self.start - self.least) * PERIOD / t[-1],
        }


def _circle(spacing: float) -> list[dict]:
    """The circle as columns of one particle's width, a block each."""
    count = round(RADIUS / spacing)
    blocks = []
    for column in range(-count, count):
        half = math.sqrt(RADIUS**2 - ((column + 0.5) * spacing) ** 2)
        blocks.append({"min": [column * spacing, -half], "max": [(column + 1) * spacing, half]})
    return blocks


def _scene(duration: float, field: float):
    """Scene builder for a drop in a tank that is large enough for it at the end."""

    def scene(spacing: float, folder) -> dict:
        fluid = {"kinematic_viscosity": 0.0, "start": "zero", "blocks": _circle(spacing)}
        if field:
            fluid["acceleration_gradient"] = [[-(field**2), 0.0], [0.0, -(field**2)]]
        return {
            "duration": duration,
            "gravity": 0.0,
            "tank": {"min": [-4 * RADIUS, -4 * RADIUS], "max": [4 * RADIUS, 4 * RADIUS], "walls": []},
            "fluid": fluid,
            "numerics": {"max_time_step": 0.2 * spacing / (STRAIN * RADIUS)},
        }

    return scene


SPACING = {"coarse": RADIUS / 25, "medium": RADIUS / 50, "paper": RADIUS / 100}

NAMES = ("elliptical_drop", "oscillating_drop")
CASES = {
    case.name: case
    for case in (
        Case(
            "elliptical_drop",
            "A round drop drawn out into an ellipse of axes 1 : 4",
            "Exact: semi-axes of Monaghan (1994) by their differential equation; the kinetic energy is constant.",
            SPACING,
            _scene(DURATION, 0.0),
            Axes,
            {"minor_axis": 0.02, "major_axis": 0.02, "energy_loss": 0.05},
        ),
        Case(
            "oscillating_drop",
            f"A drop in a central force field oscillates for {PERIODS} periods, axes up to 3.7 : 1",
            "Exact: period 4.827 s and semi-axes of Monaghan & Rafiee (2013) for A = B = R = 1; no loss of energy (measured"
            " per period, as a share of what the motion adds to the drop at rest).",
            SPACING,
            _scene(PERIODS * PERIOD, FIELD),
            Oscillation,
            {"period": 0.02, "first_stretch": 0.05, "energy_loss": 0.05},
        ),
    )
}
