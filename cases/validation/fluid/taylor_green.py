"""Taylor-Green vortices in a periodic square decay by viscosity alone.

Exact (Taylor & Green 1937, in two dimensions): u = -U e cos(2 pi x / L) sin(2 pi z / L), w = U e sin(2 pi x / L)
cos(2 pi z / L) with e = exp(-8 pi^2 nu t / L^2). Reynolds number U L / nu = 100. The velocities of the particles are
compared with those of the exact flow where they are; decay: rate of the root mean square speed over the whole run.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.simulation.loop import Simulation

LENGTH, SPEED, VISCOSITY, DURATION = 1.0, 1.0, 0.01, 1.0
WAVENUMBER = 2 * math.pi / LENGTH


def exact_velocity(position: np.ndarray, t: float) -> np.ndarray:
    """Velocity (n, 2) [m/s] of the decaying vortices."""
    x, z = WAVENUMBER * position.T
    e = SPEED * math.exp(-2 * WAVENUMBER**2 * VISCOSITY * t)
    return e * np.stack([-np.cos(x) * np.sin(z), np.sin(x) * np.cos(z)], 1)


def rms(velocity: np.ndarray) -> float:
    """Root mean square speed [m/s] of velocities (n, 2)."""
    return math.sqrt((velocity**2).sum(1).mean())


class Vortices(Measure):
    """Velocities against the exact ones, and their decay."""

    interval = DURATION / 50

    def begin(self, sim: Simulation) -> None:
        sim.fluid.velocity[:] = exact_velocity(sim.fluid.position, 0.0)
        self.start, self.found = rms(sim.fluid.velocity), []

    def sample(self, sim: Simulation) -> None:
        exact = exact_velocity(sim.fluid.position, sim.time)
        self.found.append(rms(sim.fluid.velocity - exact) / rms(exact))
        self.time, self.speed = sim.time, rms(sim.fluid.velocity)

    def errors(self) -> dict[str, float]:
        rate = math.log(self.start / self.speed) / self.time
        return {
            "velocity_l2": np.mean(self.found),
            "decay_rate": rate / (2 * WAVENUMBER**2 * VISCOSITY) - 1,
        }


def _scene(spacing: float, folder) -> dict:
    return {
        "duration": DURATION,
        "gravity": 0.0,
        "tank": {"min": [0.0, 0.0], "max": [LENGTH, LENGTH], "walls": [], "periodic": ["x", "z"]},
        "fluid": {"kinematic_viscosity": VISCOSITY, "still_water_level": LENGTH, "start": "zero"},
        "numerics": {"max_time_step": 0.2 * spacing / SPEED},
    }


NAMES = ("taylor_green",)
CASES = {
    "taylor_green": Case(
        "taylor_green",
        "Decaying Taylor-Green vortices at a Reynolds number of 100",
        "Exact: Taylor & Green (1937). Root mean square error of the velocities, as a share of the exact root mean square,"
        " averaged over 1 s in which they fall to 0.45; rate of decay.",
        {"coarse": LENGTH / 50, "medium": LENGTH / 100, "paper": LENGTH / 200},
        _scene,
        Vortices,
        {"velocity_l2": 0.05, "decay_rate": 0.05},
    )
}
