"""The plain scenes of scaling and load balance, held to what must be true of them, in three dimensions.

`tank_still`: hydrostatics (`still_water`). `column_collapse`: a square column in the middle of a tank stays symmetric, about
both axes and both diagonals, and never gains energy. `dam_tank`: no energy gained, no particle lost, and before it meets the
far wall a front no faster than 2 sqrt(g H) (Ritter 1892, ZVDI 36, 947-954), the limit of shallow water without friction.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from cases.validation.fluid.still_water import Stillness
from fsi.simulation.loop import Simulation

DAM, LENGTH = (0.4, 0.4), 1.6  # length and height of the dam, length of its tank [m]


class Collapse(Pictured):
    """Energy, symmetry and front of falling water."""

    colour, moments = "speed", (0.1, 0.3, 0.5, 0.8)

    def begin(self, sim: Simulation) -> None:
        self.plane = 0.5 * (sim.scene.tank.min[1] + sim.scene.tank.max[1])
        self.energy = self.least = self.start = sim.balance.kinetic + sim.balance.potential
        self.rise, self.lopsided, self.time, self.front = 0.0, 0.0, [0.0], []
        self._note(sim)

    def sample(self, sim: Simulation) -> None:
        energy = sim.balance.kinetic + sim.balance.potential
        self.rise, self.least = max(self.rise, energy - self.least), min(self.least, energy)
        self.time.append(sim.time)
        self._note(sim)

    def _note(self, sim: Simulation) -> None:
        position = sim.fluid.position
        x, y = position[:, 0], position[:, 1] - self.plane
        spread = (x * x + y * y).mean()
        skew = [x.mean() ** 2, y.mean() ** 2, (x * y).mean(), (x * x - y * y).mean()]
        self.lopsided = max(self.lopsided, float(np.abs(skew).max() / spread))
        self.front.append(float(x.max()) + 0.5 * sim.scene.spacing)
        self.leaks = sim.fluid.lost

    def front_speed(self) -> float:
        """Largest mean speed [m/s] of the front over 0.1 s before it nears the far wall."""
        t, x = np.array(self.time), np.array(self.front)
        free = x < 0.9 * LENGTH
        t, x = t[free], x[free]
        later = np.interp(t + 0.1, t, x, right=math.nan)
        return float(np.nanmax((later - x) / 0.1))

    def errors(self) -> dict[str, float]:
        ritter = 2 * math.sqrt(9.81 * DAM[1])
        return {
            "energy_rise": self.rise / self.start,
            "leaks": float(self.leaks),
            "asymmetry": self.lopsided,
            "front_beyond_ritter": max(0.0, self.front_speed() / ritter - 1),
        }

    def charts(self) -> list[Chart]:
        return [Chart("front", "Front", "time [s]", "x [m]", (("run", self.time, self.front),))]


class Column(Collapse):
    def errors(self) -> dict[str, float]:
        found = super().errors()
        return {name: found[name] for name in ("asymmetry", "energy_rise", "leaks")}


class Dam(Collapse):
    moments = (0.2, 0.4, 0.7, 1.4)

    def errors(self) -> dict[str, float]:
        found = super().errors()
        return {name: found[name] for name in ("front_beyond_ritter", "energy_rise", "leaks")}


def _case(name: str, title: str, reference: str, measure, target: dict, reasons: str = "") -> Case:
    return Case(name, title, reference, spacings(name), builder(name), measure, target, reasons)


NAMES = ("tank_still", "column_collapse", "dam_tank")
CASES = {
    case.name: case
    for case in (
        _case(
            "tank_still",
            "Water at rest in a tank of 1 x 0.5 x 0.5 m",
            "Exact: hydrostatic pressure, no motion, no change of volume.",
            Stillness,
            {"pressure_l2": 0.006, "pressure_linf": 0.012, "rms_speed": 0.002, "volume_drift": 0.001},
            "the bounds are those of water 25 spacings deep, as at the medium level; here it is 10.",
        ),
        _case(
            "column_collapse",
            "A square column of water collapses in the middle of a tank",
            "Exact: symmetry about both axes and diagonals (second moments), energy that never rises, no leaks.",
            Column,
            {"asymmetry": 0.01, "energy_rise": 0.001, "leaks": 0.0},
        ),
        _case(
            "dam_tank",
            "A dam break in a closed tank",
            "Limit: front speed 2 sqrt(g H) of Ritter (1892); energy that never rises, no leaks.",
            Dam,
            {"front_beyond_ritter": 0.0, "energy_rise": 0.001, "leaks": 0.0},
        ),
    )
}
