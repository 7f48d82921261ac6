"""The island, started from what its first gauge recorded: the sea before it is left to long-wave theory.

`python -m cases.validation.waves.island_record [WG1.txt] [--spacing M] [--solver NAME]` takes the record of the experiment
(`island`; time in s and elevation in cm, 50 rows a second), makes a series of elevation and flux of it, q = c eta with
c = sqrt(g (d + H)) of the solitary wave, and drives a piston at the gauge with it (`kind = "shallow"`). Without a record the
series is that of a solitary wave of the experiment's nominal height, whose crest passes the gauge when the record's does. It
prints the largest elevations within 10 s and their times at the gauges behind.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path

import numpy as np

from cases.validation.waves.island import CRESTS, DEPTH, END, GAUGES, HEIGHT, LAST, TIMES, G, Passage, scene
from cases.validation.waves.solitary_wave import write_series
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

LINE, RATE = 7.54, 50.0  # x of the line, 40 mm behind the gauge [m]; rows a second


def series(record: Path | None, file: Path) -> None:
    """Write time [s], elevation [m] and flux [m2/s] of the first `LAST` seconds of a record, its first second being zero; of a
    solitary wave without one."""
    if record is None:
        write_series(file, HEIGHT, DEPTH, TIMES[0], LAST, RATE)
        return
    eta = 0.01 * np.loadtxt(record)[: int(LAST * RATE) + 1, 1]
    eta = eta - eta[: int(RATE)].mean()
    rows = np.column_stack([np.arange(len(eta)) / RATE, eta, math.sqrt(G * (DEPTH + HEIGHT)) * eta])
    np.savetxt(file, rows, delimiter=",", header="time,elevation,flux", comments="")


def shortened(record: Path | None, spacing: float, solver: str, folder: Path) -> Scene:
    """The scene of the island from the line on."""
    data = scene(spacing, folder)
    series(record, folder / "line.csv")
    data |= {"duration": LAST, "numerics": {"solver": solver}}
    data["tank"] |= {"min": [LINE, 0.0, 0.0], "max": [END, *data["tank"]["max"][1:]]}
    data["waves"] = {"kind": "shallow", "file": str(folder / "line.csv"), "carries": "flux"}
    return load_scene(
        Scene.model_validate(data | {"name": "island_record", "spacing": spacing}, context={"folder": folder})
    )


def run(record: Path | None, spacing: float, solver: str) -> tuple[Simulation, Passage]:
    """The run and what it has measured."""
    with tempfile.TemporaryDirectory() as folder:
        sim = Simulation(shortened(record, spacing, solver, Path(folder)))
    found = Passage(sim)
    sim.run(on_step=found)
    return sim, found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("record", type=Path, nargs="?", metavar="WG1.txt")
    parser.add_argument("--spacing", type=float, default=0.13, metavar="M")
    parser.add_argument("--solver", default="chebyshev", metavar="NAME")
    options = parser.parse_args()
    sim, found = run(options.record, options.spacing, options.solver)
    t, level = found.elevations()
    print(f"{sim.fluid.count} particles, {sim.step_count} steps\ngauge  crest [m]  measured  time [s]  measured")
    for n in np.flatnonzero(GAUGES[:, 0] > LINE):
        top = int(level[:, n].argmax())
        print(f"WG{n + 1}    {level[top, n]:9.3f} {CRESTS[n]:9.3f} {t[top]:9.2f} {TIMES[n]:9.2f}")


if __name__ == "__main__":
    main()
