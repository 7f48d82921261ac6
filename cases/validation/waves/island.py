"""A solitary wave half as high as the water is deep runs over a triangular shelf with a conical island at its offshore apex.

Experiment: Lynett et al., Oregon State University, benchmark of the NTHMP (Horrillo et al. 2015, Pure Appl. Geophys. 172,
869-884); heights, times and speeds below were read from its records, whose clock starts with the paddle (Goring 1978). The
basin is symmetric about y = 0, as far as the picture of its bed tells, and half of it is computed, with a wall at y = 0: the
case of Sampath et al. (2016, J. Ocean Eng. Mar. Energy 2, 313-329, section 8.2), who have 2.32 million particles at 47.5 mm.

The bed is `island_bed.csv` on its 0.5 m grid; the grid of the tank's floor is its own. Elevations are over the still water
level. A gauge over a film thinner than a spacing may read the bed there, 0.07 m below it, until the wave has come: what it
reads at rest is no zero for its crest. Times are those of the experiment, whose paddle starts less long before its crest than
ours: `LATE`.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.waves.ground import block
from fsi.fluid.gauges import Surface
from fsi.simulation.loop import Simulation
from fsi.waves.kinds.solitary import SolitaryPiston

G = 9.81
DEPTH, HEIGHT, END, SIDE = (
    0.78,
    0.39,
    31.2,
    12.48,
)  # m, multiples of the spacings; the beach rises to 0.93 m at x = 32.5
BED = Path(__file__).with_name("island_bed.csv")
GAUGES = np.array(
    [(7.5, 0), (13, 0), (21, 0), (7.5, 5), (13, 5), (21, 5), (25, 0), (25, 5), (25, 10)]
)  # WG1 to WG9 (x, y) [m]
CRESTS = np.array([0.412, 0.360, 0.075, 0.401, 0.394, 0.146, 0.180, 0.151, 0.121])  # largest before 10 s [m]
TIMES = np.array([3.62, 5.28, 7.42, 3.60, 5.28, 9.64, 9.16, 9.48, 9.86])  # of these [s]
ARRIVALS = np.array([2.68, 4.76, 7.26, 2.68, 4.42, 7.38, 8.90, 8.90, 8.62])  # of the first 2 cm [s]
PLAIN = [0, 1, 3, 4]  # gauges before the wave is past the island
PROBES = {
    "a": ((13.0, 0.0, 0.75), 1.77),
    "b": ((21.0, 0.0, 0.77), 1.02),
    "c": ((21.0, 5.0, 0.77), 1.93),
}  # m, largest u [m/s]
LAST = 10.0  # s, end of the comparison
REST = 1.0  # s, before the wave reaches any gauge
FIRST = 0.02  # m over still water, and over what is read at rest, from which on the wave counts as there


def _late() -> float:
    """How much later [s] the crest of our piston comes than that of the experiment's, which moves for 2 (3.8 + H / d) / (k c)
    along the path of Boussinesq's wave (Goring 1978): that has its crest at WG1 after 3.64 s, and the record after 3.62 s."""
    ours, kappa = SolitaryPiston(HEIGHT, DEPTH, G), math.sqrt(0.75 * HEIGHT / DEPTH**3)
    theirs, stroke = 2 * (3.8 + HEIGHT / DEPTH) / (kappa * ours.speed), 2 * HEIGHT / (kappa * DEPTH)
    return 0.5 * (ours.time - theirs) - 0.5 * (ours.stroke - stroke) / ours.speed


LATE = _late()


class Passage(Measure):
    """Elevation at the gauges and velocity along x at the probes, over the experiment's time."""

    interval = 0.02

    def begin(self, sim: Simulation) -> None:
        self.time, self.level, self.speed = [], [], []
        self.late = LATE if sim.scene.waves.kind == "solitary" else 0.0  # a record has the experiment's clock
        self._surface = Surface(sim.fluid)

    def sample(self, sim: Simulation) -> None:
        fluid, reach = sim.fluid, 1.5 * sim.scene.spacing
        self.time.append(sim.time - self.late)
        self.level.append([self._surface(foot) - DEPTH for foot in GAUGES])
        row = []
        for place, _ in PROBES.values():
            near = ((fluid.position - place) ** 2).sum(1) < reach**2
            row.append(fluid.velocity[near, 0].mean() if near.any() else 0.0)
        self.speed.append(row)

    def elevations(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) [s] and elevations over still water (n, gauges) [m], 0 where there is no surface."""
        return np.array(self.time), np.nan_to_num(np.array(self.level), nan=0.0)

    def errors(self) -> dict[str, float]:
        t, level = self.elevations()
        crests, times = level.max(0), t[level.argmax(0)]
        there = level > np.maximum(level[t < REST].mean(0), 0.0) + FIRST
        arrivals = np.where(there.any(0), t[there.argmax(0)], math.nan)
        speeds = np.array(self.speed).max(0)
        found = {
            "crests_offshore": np.abs(crests[PLAIN] / CRESTS[PLAIN] - 1).max(),
            "crests": np.sqrt(np.mean((crests / CRESTS - 1) ** 2)),
            "crest_time_s": np.abs(times[PLAIN] - TIMES[PLAIN]).max(),
            "island_reached_s": arrivals[1] - ARRIVALS[1],
            "fronts_meet_s": arrivals[2] - ARRIVALS[2],
        }
        for (name, (_, largest)), speed in zip(PROBES.items(), speeds, strict=True):
            found[f"speed_{name}"] = speed / largest - 1
        return {name: float(error) for name, error in found.items()}


def bed() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x (n,), y (m,) and height (n, m) of the bed over half the basin [m]."""
    table = np.genfromtxt(BED, delimiter=",", skip_header=2)
    return table[1:, 0], table[0, 1:], table[1:, 1:]


def scene(spacing: float, folder: Path) -> dict:
    x, y, z = bed()
    wide = np.array([-1.0, *y, 14.0])  # beyond the walls it goes on as it is at the rim
    x, z = np.array([-6.0, *x]), np.vstack([z[:1], z])
    block(folder / "island.stl", x, wide, np.column_stack([z[:, 0], z, z[:, -1]]), -1.0)
    return {
        "dimension": 3,
        "duration": LAST + LATE,
        "tank": {
            "min": [0.0, 0.0, 0.0],
            "max": [END, SIDE, 2.6],
            "walls": ["x-", "x+", "y-", "y+"],
            "bathymetry": str(folder / "island.stl"),
        },
        "fluid": {"still_water_level": DEPTH},
        "waves": {"kind": "solitary", "wave_height": HEIGHT},
        "numerics": {"solver": "iisph"},
    }


NAMES = ("island",)
CASES = {
    "island": Case(
        "island",
        "A solitary wave past a conical island on a shelf",
        "Experiment: Lynett et al. (NTHMP benchmark), half of the basin. Crests and their times at nine gauges, the times at"
        " which the wave reaches the island and its fronts meet behind it, and the largest speed at three probes. Targets are"
        " those for a desktop; at the paper level 10 % of the crests are asked.",
        {"coarse": DEPTH / 6, "medium": DEPTH / 8, "paper": DEPTH / 16},
        scene,
        Passage,
        {
            "crests_offshore": 0.2,
            "crests": 0.3,
            "crest_time_s": 0.15,
            "island_reached_s": 0.1,
            "fronts_meet_s": 0.15,
            "speed_a": 0.15,
            "speed_b": 0.15,
            "speed_c": 0.15,
        },
        fails_when={
            "crests_offshore": Wrong("a wave half as high", 0.5),
            "crests": Wrong("a wave half as high", 0.5),
            "crest_time_s": Wrong("a wave at sqrt(g d), without its own height", 0.5),
            "island_reached_s": Wrong("a wave at sqrt(g d), without its own height", 0.5),
            "fronts_meet_s": Wrong("fronts that run at sqrt(g d) of the shelf alone, a second later", 1.0),
            "speed_a": Wrong("a quarter slower", 0.25),
            "speed_b": Wrong("a quarter slower", 0.25),
            "speed_c": Wrong("a quarter slower", 0.25),
        },
        reasons="Still water on the shelf is 75 mm deep; the lattice puts none there at 195 and 156 mm, 127 mm at 130 mm and"
        " 98 mm at 97.5 mm. Crests there are too high, most at WG3 and WG9 (0.214 m for 0.075, 0.247 m for 0.121), where the"
        " measured ones are lowest. Before the shelf crests, times and speeds meet their targets with the default solver."
        " At 48.75 mm, a row and a half on the shelf, `iisph` meets all but the speed behind the island and the crests"
        " on the shelf.",
    )
}
