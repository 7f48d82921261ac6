"""The plain scenes of scaling and load balance, held to what must be true of them, in three dimensions.

`tank_still`: hydrostatics (`still_water`). `column_collapse`: a square column in the middle of a tank falls, stays symmetric,
about both axes and both diagonals, and never gains energy. `dam_tank`: no energy gained, no particle lost, and a front between
two columns' widths and the far wall at 0.8 of 2 sqrt(g H), the limit of shallow water without friction (Ritter 1892, ZVDI 36,
947-954): that is what Martin & Moyce (1952) measured of columns twice as high as wide (`dam_front`).

The sizes at the paper level are those of the scaling runs of the source documents: 3,558,212 particles for the dam at 5 mm,
731,860 for the column at 10 mm, walls included; of the full tank only counts are given, from 4.6 million on. With walls of five
rows 10 mm make 4.6, 7.5 mm 10.5, 4 mm 66 and 2.5 mm 266 million: 10 mm here. Walls here have fewer rows (`paper_level.md`).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from cases.validation.fluid.still_water import Stillness
from fsi.simulation.loop import Simulation

DAM, LENGTH = (0.6, 0.6), 3.22  # length and height of the dam, length of its tank [m]
MEASURED = 0.8  # front speed over 2 sqrt(g H), Martin & Moyce (1952)


class Collapse(Pictured):
    """Energy, symmetry and front of falling water."""

    colour, moments = "speed", (0.1, 0.3, 0.5, 0.8)

    def begin(self, sim: Simulation) -> None:
        self.plane = 0.5 * (sim.scene.tank.min[1] + sim.scene.tank.max[1])
        self.energy = self.least = self.start = sim.balance.kinetic + sim.balance.potential
        self.potential = sim.balance.potential
        self.rise, self.lopsided, self.time, self.front = 0.0, 0.0, [0.0], []
        self._note(sim)

    def sample(self, sim: Simulation) -> None:
        energy = sim.balance.kinetic + sim.balance.potential
        self.rise, self.least = max(self.rise, energy - self.least), min(self.least, energy)
        self.potential = min(self.potential, sim.balance.potential)
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
        """Mean speed [m/s] of the front from twice the width of the dam to near the far wall; 0 where it does not come
        so far."""
        t, x = np.array(self.time), np.array(self.front)
        free = (x > 2 * DAM[0]) & (x < 0.9 * LENGTH)
        return float(np.polyfit(t[free], x[free], 1)[0]) if free.sum() > 1 else 0.0

    def errors(self) -> dict[str, float]:
        ritter = 2 * math.sqrt(9.81 * DAM[1])
        return {
            "energy_rise": self.rise / self.start,
            "leaks": float(self.leaks),
            "asymmetry": self.lopsided,
            "front_speed": self.front_speed() / (MEASURED * ritter) - 1,
            "standing": self.potential / self.start,
        }

    def charts(self) -> list[Chart]:
        return [Chart("front", "Front", "time [s]", "x [m]", (("run", self.time, self.front),))]


class Column(Collapse):
    def errors(self) -> dict[str, float]:
        found = super().errors()
        return {name: found[name] for name in ("asymmetry", "standing", "energy_rise", "leaks")}


class Dam(Collapse):
    moments = (0.2, 0.4, 0.7, 1.4)

    def errors(self) -> dict[str, float]:
        found = super().errors()
        return {name: found[name] for name in ("front_speed", "energy_rise", "leaks")}


def _case(name: str, title: str, reference: str, measure, target: dict, reasons: str = "", **more) -> Case:
    return Case(name, title, reference, spacings(name), builder(name), measure, target, reasons, **more)


NAMES = ("tank_still", "column_collapse", "dam_tank")
CASES = {
    case.name: case
    for case in (
        _case(
            "tank_still",
            "Water at rest in a tank of 1 x 0.5 x 0.5 m (2 x 2 x 1 m at the paper level)",
            "Exact: hydrostatic pressure, no motion, no change of volume.",
            Stillness,
            {"pressure_l2": 0.006, "pressure_linf": 0.012, "rms_speed": 0.002, "volume_drift": 0.001},
            "the bounds are those of water 25 spacings deep, as at the medium level; here it is 10.",
        ),
        _case(
            "column_collapse",
            "A square column of water collapses in the middle of a tank",
            "Exact: symmetry about both axes and diagonals (second moments), energy that never rises, no leaks; within 0.8 s"
            " most of the potential energy is spent (at rest 0.04 of it is left).",
            Column,
            {"asymmetry": 0.01, "standing": 0.2, "energy_rise": 0.001, "leaks": 0.0},
            fails_when={"standing": Wrong("the column does not fall", 1.0)},
        ),
        _case(
            "dam_tank",
            "A dam break in a closed tank of 3.22 x 0.6 x 1 m",
            "Front speed between two widths of the dam and the far wall against 0.8 of Ritter's (1892) limit 2 sqrt(g H), as"
            " Martin & Moyce (1952) measured; energy that never rises, no leaks.",
            Dam,
            {"front_speed": 0.2, "energy_rise": 0.001, "leaks": 0.0},
        ),
    )
}
