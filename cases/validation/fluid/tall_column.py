"""A dam break hits a tall square column: force on the column and speed of the bore, in three dimensions.

Experiment: Yeh & Petroff at the University of Washington, as given by Raad & Bidoae (2005), Comput. Methods Appl. Mech.
Eng. 195, 5263-5278. Water 0.40 x 0.61 x 0.30 m behind a gate, about 1 cm of water on the bed beyond it, a column of 0.12 x
0.12 m with its upstream face 0.50 m from the gate. The velocity is taken 0.146 m upstream of the column's centre and
0.026 m above the bed, 0.814 m from the reservoir's wall by the geometry (other texts have 0.754 m); its times count from
the arrival of the bore there. Pressures at impact have no limit as the time step falls, so the peak of the force is read
through a mean over 20 ms.

The column is a body on a slide that does not move: that gives the force on it alone. The layer of water on the bed has as
many particles over its depth as come next to 1 cm, none at a spacing of 20 mm.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from cases.validation.fluid.leaks import Leaks
from cases.validation.theory.series import impulse, low_passed, relative_rms
from fsi.owners import FIRST_BODY
from fsi.simulation.loop import Simulation
from fsi.sph.kernel import value

LENGTH, WIDTH, HEIGHT = 1.60, 0.61, 0.75
RESERVOIR, DEPTH, LAYER = 0.40, 0.30, 0.01
SIDE = 0.12  # of the column
COLUMN = (RESERVOIR + 0.50 + 0.5 * SIDE, 0.24 + 0.5 * SIDE)  # its centre (x, y)
PROBE = (COLUMN[0] - 0.146, COLUMN[1], 0.026)
WINDOW = 0.02  # s
ARRIVAL = 0.24  # of the bore at the probe, s from the gate, "about"

FORCE = np.array([
    (0.30, 0.0), (0.35, 8.1), (0.396, 33.1), (0.40, 30.1), (0.45, 26.3), (0.50, 19.2), (0.60, 18.0), (0.70, 17.7),
    (0.80, 15.3), (0.90, 12.8), (1.00, 9.2), (1.10, 6.4), (1.20, 5.2), (1.30, 2.9), (1.40, -1.5), (1.50, -8.8),
    (1.55, -10.5), (1.60, -8.8), (1.80, -5.7), (2.00, -1.7),
])  # fmt: skip  # s from the gate, N
SPEED = np.array([
    (0.0, 2.12), (0.05, 1.88), (0.10, 1.70), (0.20, 1.49), (0.30, 1.38), (0.40, 1.23), (0.50, 1.01), (0.60, 0.91),
    (0.85, 0.45), (1.00, 0.38),
])  # fmt: skip  # s from the bore's arrival, m/s


class ColumnLoads(Pictured):
    """Force on the column along x and velocity of the bore at the probe."""

    colour, moments, plane = "speed", (0.3, 0.4, 0.6, 1.2), COLUMN[1]
    window = (0.0, LENGTH), (0.0, 0.6)

    def begin(self, sim: Simulation) -> None:
        self.time, self.force, self.speed = [], [], []
        self.leak, self.leaks = Leaks(sim), 0.0

    def sample(self, sim: Simulation) -> None:
        fluid = sim.fluid
        distance = np.sqrt(((fluid.position - PROBE) ** 2).sum(1))
        weight = value(distance, sim.scene.smoothing_length, 3)
        self.leaks = max(self.leaks, self.leak.share(sim))
        self.time.append(sim.time)
        self.force.append(sim.balance.wrench[FIRST_BODY, 0])
        self.speed.append(weight @ fluid.velocity[:, 0] / weight.sum() if weight.any() else 0.0)

    def arrival(self) -> float:
        """Time [s] from which on the water at the probe runs at half the bore's speed; nan where it never does."""
        there = np.array(self.speed) > 0.5 * SPEED[0, 1]
        return float(np.array(self.time)[there.argmax()]) if there.any() else math.nan

    def charts(self) -> list[Chart]:
        force, speed = (low_passed(np.array(self.time), np.array(y), WINDOW) for y in (self.force, self.speed))
        since = np.array(self.time) - self.arrival()
        return [
            Chart(
                "force", "Force on the column along x, mean over 20 ms", "time [s]", "force [N]",
                (("run", self.time, force),), (("experiment", *FORCE.T),),
            ),
            Chart(
                "speed", "Velocity ahead of the column, mean over 20 ms", "time from the bore's arrival [s]", "velocity [m/s]",
                (("run", since[since > -0.1], speed[since > -0.1]),), (("experiment", *SPEED.T),),
            ),
        ]  # fmt: skip

    def errors(self) -> dict[str, float]:
        t, force, speed = np.array(self.time), np.array(self.force), np.array(self.speed)
        read = low_passed(t, force, WINDOW)
        expected = impulse(*FORCE.T, 0.3, 1.2)
        arrival = self.arrival()
        there = np.interp(arrival + SPEED[:, 0], t, low_passed(t, speed, WINDOW))
        return {
            "leaks": self.leaks,
            "force_impulse": impulse(t, force, 0.3, 1.2) / expected - 1,
            "peak_force": read[t < 0.6].max() / FORCE[:, 1].max() - 1,
            "peak_time_s": t[read[t < 0.6].argmax()] - FORCE[FORCE[:, 1].argmax(), 0],
            "bore_arrival_s": arrival - ARRIVAL,
            "bore_speed": relative_rms(there[1:], SPEED[1:, 1], SPEED[0, 1]),
        }


def _scene(spacing: float, folder: Path) -> dict:
    blocks = [{"min": [0.0] * 3, "max": [RESERVOIR, WIDTH, DEPTH]}]
    layer = math.floor(LAYER / spacing + 0.5 - 1e-9) * spacing
    if layer:
        blocks.append({"min": [RESERVOIR, 0.0, 0.0], "max": [LENGTH, WIDTH, layer]})
    data = builder("column_tall")(spacing, folder)
    data["fluid"]["blocks"] = blocks
    return data


NAMES = ("column_tall",)
CASES = {
    "column_tall": Case(
        "column_tall",
        "A dam break hits a tall square column",
        "Experiment: Yeh & Petroff in Raad & Bidoae (2005). Impulse of the force over 0.3 to 1.2 s, its peak as a mean over"
        " 20 ms, and the velocity of the bore ahead of the column (root mean square, share of 2.12 m/s).",
        spacings("column_tall"),
        _scene,
        ColumnLoads,
        {
            "force_impulse": 0.05,
            "peak_force": 0.1,
            "bore_speed": 0.1,
            "bore_arrival_s": 0.02,
            "peak_time_s": 0.02,
            "leaks": 0.0,
        },
        fails_when={
            "bore_speed": Wrong("a quarter too fast", 0.25 * relative_rms(SPEED[1:, 1], np.zeros(1), SPEED[0, 1]))
        },
        reasons="The peak wants the layer of water on the bed, 10 mm deep, in more than one spacing: it falls from 46 to 18 %"
        " over the experiment's where 5 mm make two. The layer is missing at 20 mm, 15 mm deep at 15. The row at 5 mm was run"
        " with walls 0.75 m high and lost 327 particles: half of the tank throws some over walls of 1.5 m, which now are 2 m"
        " high. At 5 mm the water at the probe slows from 2.2 to 0.6 m/s within 40 ms of the bore's head (half of the tank),"
        " the experiment's to 1.9. The experiment's bore takes 0.1 s from the probe to the column, 86 mm at 2.1 m/s: the two"
        " records' times do not fit, by about as much as the force is early here.",
    )
}
