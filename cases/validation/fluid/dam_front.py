"""The front of a collapsing column of water on a dry bed, in two dimensions.

Experiment: Martin & Moyce (1952), Phil. Trans. R. Soc. A 244, 312-324: a column a = 2.25 in wide and 2 a high. With
T = t sqrt(2 g / a) the front is at Z = x / a. The gate takes time to open, so the curve of the experiment starts late:
its slope and the curve with the best shift in T are compared. The frontmost particle's edge is the front. Besides, the
mechanical energy never rises, and until the front has reached the end of the data next to none is lost; no particle
leaves the tank.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from fsi.simulation.loop import Simulation

WIDTH = 0.05715  # a [m]
TIME = np.array([0.83, 1.22, 2.00, 2.55, 3.35, 4.03, 4.42, 5.09, 5.69, 6.31, 6.82])  # T
FRONT = np.array([1.22, 1.47, 2.29, 3.00, 4.13, 4.94, 5.88, 6.98, 7.95, 8.97, 9.99])  # Z
FAST = FRONT > 2  # beyond the influence of the gate
STEEP = 0.25 * np.std(FRONT[FAST]) / np.ptp(FRONT[FAST])  # misfit of a curve a quarter too steep, after the best shift
FAILS = {"front_curve": Wrong("a front a quarter too fast", float(STEEP))}


def best_shift(time: np.ndarray, front: np.ndarray) -> float:
    """What to add to the run's T so that its front Z(T) meets the fast part of the experiment, in the mean."""
    return float((TIME[FAST] - np.interp(FRONT[FAST], front, time)).mean())


class Front(Pictured):
    """Front, energy and leaks."""

    colour, moments = "speed", (0.05, 0.1, 0.15, 0.2)

    def begin(self, sim: Simulation) -> None:
        self.scale = math.sqrt(2 * sim.scene.gravity / WIDTH)
        self.at_start = self.energy = self.least = sim.balance.kinetic + sim.balance.potential
        self.rise, self.time, self.front, self.leaks = 0.0, [0.0], [1.0], 0.0
        self.spent = [1.0]

    def sample(self, sim: Simulation) -> None:
        fluid, spacing = sim.fluid, sim.scene.spacing
        self.energy = sim.balance.kinetic + sim.balance.potential
        self.rise = max(self.rise, self.energy - self.least)
        self.least = min(self.least, self.energy)
        self.time.append(sim.time * self.scale)
        self.spent.append(self.energy / self.at_start)
        self.front.append((fluid.position[:, 0].max() + 0.5 * spacing) / WIDTH)
        outside = int((fluid.position < -0.5 * spacing).any(1).sum())  # beyond the first particles of a wall
        self.leaks = (fluid.lost + outside) / (fluid.count + fluid.lost)

    def charts(self) -> list[Chart]:
        time, front = np.array(self.time), np.maximum.accumulate(self.front)
        shift = best_shift(time, front)
        lines = ("run", time, front), (f"run, {shift:+.2f} later", time + shift, front)
        return [
            Chart("front", "Front of the column", "t sqrt(2 g / a)", "x / a", lines, (("experiment", TIME, FRONT),)),
            Chart("energy", "Energy", "t sqrt(2 g / a)", "energy over that at the start", (("run", time, self.spent),)),
        ]

    def errors(self) -> dict[str, float]:
        time, front = np.array(self.time), np.maximum.accumulate(self.front)
        shift = best_shift(time, front)
        there = np.interp(TIME[FAST], time + shift, front)
        slope = np.polyfit(TIME[FAST], there, 1)[0] / np.polyfit(TIME[FAST], FRONT[FAST], 1)[0]
        return {
            "front_speed": slope - 1,
            "front_curve": math.sqrt(((there - FRONT[FAST]) ** 2).mean()) / np.ptp(FRONT[FAST]),
            "energy_rise": self.rise / self.at_start,
            "energy_loss": 1 - self.energy / self.at_start,
            "leaks": self.leaks,
        }


def _inviscid(spacing: float, folder) -> dict:
    return _scene(spacing, folder) | {"numerics": {"viscosity": "none"}}


_scene = builder("dam_front")


NAMES = ("dam_front", "dam_energy")
CASES = {
    "dam_front": Case(
        "dam_front",
        "Front of a collapsing column on a dry bed, 57 mm wide and 114 mm high",
        "Experiment: Martin & Moyce (1952). Front speed over Z > 2; curve: root mean square after the best shift in time,"
        " as a share of the distance covered; energies as shares of the one at the start; leaks of the particles.",
        spacings("dam_front"),
        _scene,
        Front,
        {"front_speed": 0.1, "front_curve": 0.05, "energy_rise": 0.001, "energy_loss": 0.02, "leaks": 0.0},
        "water rubs on the bed of so small a tank, the more the finer the spacing resolves its boundary layer;"
        " `dam_energy` leaves that out.",
        fails_when=FAILS,
    ),
    "dam_energy": Case(
        "dam_energy",
        "The same column of a liquid without viscosity, to tell the scheme's losses from friction on the bed",
        "Exact: no loss of energy before an impact; energies as shares of the one at the start. The front is that of Martin"
        " & Moyce (1952), whose water had friction.",
        spacings("dam_front"),
        _inviscid,
        Front,
        {"front_speed": 0.1, "front_curve": 0.05, "energy_rise": 0.001, "energy_loss": 0.02, "leaks": 0.0},
        "the wall guard stops what meets the bed; its loss halves with the spacing.",
        fails_when=FAILS,
    ),
}
