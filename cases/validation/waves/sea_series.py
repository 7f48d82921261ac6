"""Regular waves of four lengths in a box with a sea around it, over 100 periods; the worst of each error counts.

The incident waves are Fenton's (Rienecker & Fenton 1981, by Raschii) in shallow and in deep water, up to a steepness of 0.06.
`python -m cases.validation.waves.sea_series [LEVEL]` prints the errors of each.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.several import runs, variant_scene
from cases.validation.engine.solvers import DEFAULT
from cases.validation.waves.open_sea import DEPTH, Stays
from cases.validation.waves.wavemaker import SEA
from fsi.simulation.loop import Simulation

G, PERIODS = 9.81, 100
WAVES = {"0.5": 0.015, "1": 0.04, "2": 0.06, "3": 0.06}  # kd, by linear theory, and height over length
PER_HEIGHT = {"coarse": 5, "medium": 10, "paper": 20}


def variants(spacing: float, folder: Path) -> Mapping[str, dict]:
    """Boxes of two wave lengths; the `spacing` of the level is that of kd = 1, and is in the others the same share of H."""
    return {kd: _scene(float(kd), steepness, spacing / _height(1.0, WAVES["1"])) for kd, steepness in WAVES.items()}


def _height(kd: float, steepness: float) -> float:
    return steepness * 2 * math.pi * DEPTH / kd


def _scene(kd: float, steepness: float, share: float) -> dict:
    height, length = _height(kd, steepness), 2 * math.pi * DEPTH / kd
    spacing, period = share * height, 2 * math.pi / math.sqrt(G * kd / DEPTH * math.tanh(kd))
    end = round(length / spacing) * spacing
    return {
        "spacing": spacing,
        "duration": PERIODS * period,
        "tank": {"min": [-end, -DEPTH], "max": [end, math.ceil(1.5 * height / spacing) * spacing]},
        "sea": {"waves": {"kind": "nonlinear", "wave_height": height, "period": period}},
        "numerics": SEA,
    }


def judge(seen: Mapping[str, Stays]) -> dict[str, float]:
    found = [measure.errors() for measure in seen.values()]
    return {key: max((errors[key] for errors in found), key=abs) for key in found[0]}


NAMES = ("sea_series",)
CASES = {
    "sea_series": Case(
        "sea_series",
        "Regular waves of kd = 0.5, 1, 2 and 3 in a box with a sea around it, H/L up to 0.06, 100 periods",
        "The incident waves: Fenton's, with the return flow of a closed tank.",
        {level: _height(1.0, WAVES["1"]) / per for level, per in PER_HEIGHT.items()},
        lambda spacing, folder: variants(spacing, folder)["1"],
        Stays,
        {"height": 0.02, "spread": 0.02, "phase_speed": 0.005, "level": 0.005, "growth": 0.02, "second_harmonic": 0.2},
        "The level: as that of `sea_regular`.",
        run=runs(variants, Stays, judge),
        fails_when={
            "spread": Wrong("a wave of a tenth comes back from the zones", 0.1),
            "phase_speed": Wrong("linear waves, slower by their steepness", 0.015),
            "level": Wrong("the level creeps by a hundredth of the wave height", 0.01),
            "growth": Wrong("waves that grow by a twentieth", 0.05),
            "second_harmonic": Wrong("free second harmonics as high as half of the bound ones", 0.5),
        },
    ),
}


def main(level: str = "coarse") -> None:
    case = CASES["sea_series"]
    with tempfile.TemporaryDirectory() as folder:
        for kd, data in variants(case.spacing[level], Path(folder)).items():
            measure = Stays(sim := Simulation(variant_scene(case, data, level, DEFAULT, Path(folder))))
            sim.run(on_step=measure)
            told = ", ".join(f"{key} {100 * value:+.2f} %" for key, value in measure.errors().items())
            print(f"kd {kd}, H/L {WAVES[kd]}, {sim.fluid.count} particles: {told}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
