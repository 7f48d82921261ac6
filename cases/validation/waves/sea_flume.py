"""The same flap in a box with a sea around it and in a flume, two dimensions: `python -m cases.validation.waves.sea_flume`.

The flap of `owsc_2d`, submerged, in waves of 0.15 m and 1.34 s. `pitch`: its amplitude in the box over that in the flume.
The flume brings the waves over 3.5 m, waits for its ramp and their way, and ends in a damping zone of one wave length.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.engine.scenes import builder, spacings
from cases.validation.engine.several import runs, variant_scene
from cases.validation.engine.solvers import DEFAULT
from cases.validation.theory.separation import first_harmonic
from cases.validation.waves.wavemaker import NUMERICS
from fsi.scene.binding import bind
from fsi.simulation.loop import Simulation
from fsi.waves.linear import wavenumber

PERIOD, HEIGHT, DEPTH = 1.34, 0.15, 0.7
OMEGA = 2 * math.pi / PERIOD
LENGTH = 2 * math.pi / wavenumber(OMEGA, DEPTH, 9.81)
PERIODS, RECORD = 8, 3  # in the box, and of the record in both


class Pitch(Measure):
    """Amplitude of the hinge's first harmonic over the last periods, particles, and processor time."""

    def begin(self, sim: Simulation) -> None:
        self.time, self.angle, self.sim, self._began = [], [], sim, time.process_time()

    def sample(self, sim: Simulation) -> None:
        self.time.append(sim.time)
        self.angle.append(sim.bodies.joints()["joint_position"][0])

    def amplitude(self) -> float:
        t, angle = np.array(self.time), np.array(self.angle)
        late = t > t[-1] - RECORD * PERIOD
        self.seconds = time.process_time() - self._began
        return float(abs(first_harmonic(t[late], angle[late, None], OMEGA)[0]))


def variants(spacing: float, folder: Path) -> Mapping[str, dict]:
    """The flume as it is, and a box of two wave lengths in its place."""
    flume = builder("owsc_2d")(spacings("owsc_2d")["coarse"], folder)
    foot, half = flume["bodies"]["flap"]["position"][0], round(LENGTH / spacing) * spacing
    box = {key: value for key, value in flume.items() if key not in ("waves", "damping", "gauges", "probes")}
    box["tank"] = flume["tank"] | {"min": [foot - half, -DEPTH], "max": [foot + half, flume["tank"]["max"][1]]}
    box |= {"sea": {"waves": {"wave_height": HEIGHT, "period": PERIOD}}, "duration": PERIODS * PERIOD}
    return {name: scene | {"numerics": NUMERICS} for name, scene in (("flume", flume), ("box", box))}


def judge(seen: Mapping[str, Pitch]) -> dict[str, float]:
    box, flume = (seen[name].amplitude() for name in ("box", "flume"))
    return {"pitch": box / flume - 1}


NAMES = ("sea_flume",)
CASES = {
    "sea_flume": Case(
        "sea_flume",
        "The submerged flap of owsc_2d in a box with a sea around it against the flume, 2D",
        "The same flap in the flume at the same spacing.",
        spacings("owsc_2d"),
        lambda spacing, folder: variants(spacing, folder)["box"],
        Pitch,
        {"pitch": 0.03},
        run=runs(variants, Pitch, judge),
        fails_when={"pitch": Wrong("waves a tenth too low in the box", -0.1)},
    ),
}


def main() -> None:
    """Both runs at the coarse spacing beside each other."""
    case = CASES["sea_flume"]
    with tempfile.TemporaryDirectory() as folder:
        for name, data in variants(case.spacing["coarse"], Path(folder)).items():
            scene = variant_scene(case, data, "coarse", DEFAULT, Path(folder))
            bodies, coupler, ground = bind(scene, name)
            sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=1)
            pitch = Pitch(sim)
            sim.run(on_step=pitch)
            degrees = math.degrees(pitch.amplitude())
            print(
                f"{name}: pitch {degrees:.2f} degrees, {sim.fluid.count} particles, {sim.time:.1f} s simulated, "
                f"{pitch.seconds:.0f} s of processor time"
            )


if __name__ == "__main__":
    main()
