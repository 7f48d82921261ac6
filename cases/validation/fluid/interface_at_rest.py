"""Water over sand with a yield stress stays where it is, on a flat bed of sand and on one that slopes by less than it yields.

The sand is that of `slope_at_rest`, 1950 kg/m3, 1000 Pa, mu_0 = 3e4 Pa s; flat, 0.125 m deep, or sloping by 3 degrees. Exact:
nothing moves. The paper level runs a minute, the coarser ones a part of it. `creep`: the way of the sand's fastest tenth in a
minute, from the second half of the run, over ten spacings, so that 0.1 is a spacing; `energy_rise`: the largest rise of kinetic
and potential energy over what it has been before, as a share of the energy at hand (`Balance.energy_scale`).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.several import runs
from cases.validation.fluid.slope_at_rest import Creep, _scene
from fsi.simulation.loop import Simulation

SPACING = {"coarse": 0.025, "medium": 0.02, "paper": 0.0125}
DURATION = {0.025: 4.0, 0.02: 8.0, 0.0125: 60.0}  # at a spacing [s]
FLAT = [[0.0, -0.5], [1.0, -0.5], [1.0, -0.375], [0.0, -0.375]]


class Rest(Creep, Pictured):
    """Creep, and energy that comes from nowhere."""

    moments = (0.0, 4.0)

    def begin(self, sim: Simulation) -> None:
        super().begin(sim)
        self.start = self.least = sim.balance.kinetic + sim.balance.potential
        self.rise, self.energy = 0.0, []

    def sample(self, sim: Simulation) -> None:
        super().sample(sim)
        energy = sim.balance.kinetic + sim.balance.potential
        self.rise = max(self.rise, (energy - self.least) / sim.balance.energy_scale)
        self.least = min(self.least, energy)
        self.energy.append((sim.time, 100 * (energy - self.start) / sim.balance.energy_scale))

    def charts(self) -> list[Chart]:
        lines = (("run", *np.transpose(self.energy)),)
        return [Chart("energy", "Energy since the start", "time [s]", "% of that at hand", lines)]


def variants(spacing: float, folder: Path) -> dict[str, dict]:
    """Scenes: a sloping and a flat bed of sand."""
    slope = _scene(spacing, folder) | {"duration": DURATION[spacing]}
    sand = slope["liquids"]["sand"] | {"blocks": [{"polygon": FLAT}]}
    return {"slope": slope, "flat": slope | {"liquids": {"sand": sand}}}


def judge(seen: Mapping[str, Rest]) -> dict[str, float]:
    """Creep of either, the larger rise of the energy, and the particles that are lost."""
    return {
        "creep_flat": seen["flat"].errors()["creep"],
        "creep_slope": seen["slope"].errors()["creep"],
        "energy_rise": max(rest.rise for rest in seen.values()),
        "leaks": float(sum(rest.leaks for rest in seen.values())),
    }


TWO = Wrong("two spacings in a minute", 0.2)

NAMES = ("interface_at_rest",)
CASES = {
    "interface_at_rest": Case(
        "interface_at_rest",
        "Water over sand of 1950 kg/m3 with a yield stress of 1000 Pa, flat and sloping by 3 degrees",
        "Exact: it stays; less than a spacing in a minute, and no energy from nowhere.",
        SPACING, _scene, None, {"creep_flat": 0.1, "creep_slope": 0.1, "energy_rise": 0.001, "leaks": 0.0},
        "At 25 mm the energy rises by 0.12 % of that at hand, at 20 mm by 0.04 %: after 2 s the rows of the water over the"
        " slope leave their lattice, and out of order they take more room, their centre 0.1 mm higher by 4 s. Shifting"
        " brings the same rise at once. At 12.5 mm it is 0.05 % in a minute.",
        run=runs(variants, Rest, judge), fails_when={"creep_flat": TWO, "creep_slope": TWO},
    )
}  # fmt: skip
