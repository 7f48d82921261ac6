"""A rigid slide runs down a ramp of 30 degrees into a flume, whose far end is a dam of 45 degrees; in water and in bentonite.

After experiments at the NHC flume for tailings dams: a slide 1.2 m long moves for 1.14 s and stops abruptly; in water and in
water with 6 % bentonite (yield stress 3 Pa, 0.006 Pa s) the wave near the slide and the run-up on the dam showed no noticeable
difference. That is the reference, and it needs no data. The sources at hand have no dimensions of the flume and no speed
of the slide. Ours: 0.4 m of water over 3 m of bed, 0.8 m wide; a slide 0.16 m thick and 0.56 m wide, 0.58 m up the ramp, that
gets faster evenly to 2.4 m/s and is stopped within 0.02 s; 1030 kg/m3 and, at rest, 6 Pa s for the bentonite.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.engine.scenes import builder, spacings
from cases.validation.engine.several import runs
from fsi.simulation.loop import Simulation


class Waves(Measure):
    """Highest water at probe 1, and highest run-up on the dam [m]."""

    interval = 0.02

    def begin(self, sim: Simulation) -> None:
        self.crest, self.run_up, self.leaks = 0.0, 0.0, 0

    def sample(self, sim: Simulation) -> None:
        read = sim.instruments.series(sim.time, 0.0)
        self.crest = max(self.crest, float(read["elevation"][0]))
        self.run_up = max(self.run_up, float(read["runup_height"][0]))
        self.leaks = sim.fluid.lost


def variants(name: str):
    """The scenes of a name with both liquids."""

    def both(spacing: float, folder: Path) -> dict[str, dict]:
        data = builder(name)(spacing, folder) | {"output": {}}
        water = {key: value for key, value in data["fluid"].items() if key not in ("density", "rheology")}
        return {"bentonite": data, "water": data | {"fluid": water}}

    return both


def judge(seen: Mapping[str, Waves]) -> dict[str, float]:
    """Bentonite over water, less 1."""
    mud, water = seen["bentonite"], seen["water"]
    return {
        "probe_1": mud.crest / water.crest - 1,
        "run_up": mud.run_up / water.run_up - 1,
        "leaks": float(mud.leaks + water.leaks),
    }


THICK = Wrong("bentonite in which a wave loses a tenth of its height", 0.1)


def _case(name: str, where: str, reasons: str = "") -> Case:
    return Case(
        name,
        f"A rigid slide runs into a flume with a dam: 6 % bentonite beside water, {where}",
        "Experiment at the NHC flume: no noticeable difference. Wave at probe 1, near the slide, and run-up on the dam.",
        spacings(name), builder(name), None, {"probe_1": 0.05, "run_up": 0.05, "leaks": 0.0}, reasons,
        run=runs(variants(name), Waves, judge), fails_when={"probe_1": THICK, "run_up": THICK},
    )  # fmt: skip


NAMES = ("slide_bentonite", "slide_bentonite_2d")
CASES = {
    "slide_bentonite": _case(
        "slide_bentonite",
        "3D",
        "At the coarse level, 10 spacings deep, bentonite runs up 7 % less. In two dimensions it"
        " is 2 % less at 20 and at 12.5 mm.",
    ),
    "slide_bentonite_2d": _case("slide_bentonite_2d", "its middle in 2D"),
}
