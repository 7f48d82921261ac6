"""Error over run time of the pressure solvers: the default, one that is solved to its tolerance, and implicit ISPH.

`python -m cases.bench.solver_times ROWS.json [CASE ...] [--limit S]` runs what ROWS.json lacks of six cases at three spacings,
on one thread, coarse spacings first, and keeps each row as soon as it is there. A run that will take longer than the limit is
given up, and its row says how long it would have taken. `--figure PNG` draws the rows, and `--table` prints them, as they
stand in docs/guide/implicit.md.

Times are processor time after the first step, which compiles, and without measuring. The error of a case is the largest of
those named below, in magnitude, each a share of the reference.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from cases.validation.engine.case import Case
from cases.validation.engine.registry import load
from cases.validation.engine.runner import Stopwatch, scene_of
from cases.validation.engine.solvers import DEFAULT
from fsi.errors import RunError
from fsi.scene.binding import bind
from fsi.simulation.loop import Simulation

SOLVERS = (DEFAULT, "converged", "iisph")
LIMIT = 600.0  # s of processor time that a run may take
TRIED = 15.0  # s after which it is known how long it will take


@dataclass(frozen=True)
class Trial:
    """A case of `fsi validate` and the errors of it that count, in words and by name, and the spacings [m]."""

    title: str
    what: str
    errors: tuple[str, ...]
    spacings: tuple[float, ...]

    def error(self, row: dict) -> float | None:
        """The largest of the errors, None where one could not be measured."""
        found = [row["error"].get(name) for name in self.errors]
        return None if None in found else max(map(abs, found))


TRIALS = {
    "still_water": Trial("still water", "pressure", ("pressure_l2",), (0.05, 0.025, 0.0125)),
    "column_tall": Trial("tall column", "impulse, bore", ("force_impulse", "bore_speed"), (0.02, 0.01525, 0.01)),
    "solitary_wave": Trial(
        "solitary wave", "height, loss, speed", ("height", "height_loss", "speed"), (0.02, 0.01, 0.005)
    ),
    "dam_front": Trial(
        "dam front", "speed, curve", ("front_speed", "front_curve"), (0.0028575, 0.00142875, 0.000714375)
    ),
    "decay_heave_2d": Trial("floating box", "period, amplitude", ("period", "amplitude"), (0.04, 0.02, 0.01)),
    "island": Trial("island", "crests", ("crests",), (0.195, 0.156, 0.13)),
}


class Late(Exception):
    """A run that will take so many seconds."""


class Limited(Stopwatch):
    """Times the steps by processor time; raises `Late` where all of them will take longer than `limit` [s]."""

    def __init__(self, measure, limit: float):
        super().__init__(measure, time.process_time)
        self.limit = limit

    def __call__(self, sim: Simulation) -> None:
        super().__call__(sim)
        whole = self.seconds * sim.scene.duration / sim.time
        if self.seconds > TRIED and whole > self.limit:
            raise Late(whole)


def run(case: Case, spacing: float, solver: str, limit: float = LIMIT) -> dict:
    """One row: errors (none where the run failed or was given up), particles, steps, processor time [s] of the whole run."""
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_of(replace(case, spacing={"here": spacing}), "here", solver, Path(folder))
        bodies, coupler, ground = bind(scene, case.name)
        sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=1)
    particles = sim.fluid.count
    measure = case.measure(sim)
    watch, error, why = Limited(measure, limit), {}, ""
    try:
        sim.run(on_step=watch)
        error = {name: float(x) if math.isfinite(x) else None for name, x in measure.errors().items()}
        seconds = watch.seconds
    except Late as late:
        seconds, why = late.args[0], "given up"
    except RunError as fault:
        seconds, why = watch.seconds, str(fault)
    finally:
        sim.close()
    return {
        "case": case.name, "solver": solver, "spacing": spacing, "particles": particles, "steps": sim.step_count,
        "processor_s": seconds, "why": why, "error": error,
    }  # fmt: skip


def missing(rows: Iterable[dict], names: Iterable[str]) -> Iterator[tuple[str, float, str]]:
    """Case, spacing and solver of what is still to be run, coarse spacings first."""
    done = {(row["case"], row["spacing"], row["solver"]) for row in rows}
    for level in range(3):
        for name in names:
            for solver in SOLVERS:
                if (name, TRIALS[name].spacings[level], solver) not in done:
                    yield name, TRIALS[name].spacings[level], solver


def table(rows: list[dict]) -> Iterator[str]:
    """Lines of a table in Markdown: a case and a spacing each, error and processor time of each solver."""
    found = {(row["case"], row["spacing"], row["solver"]): row for row in rows}
    yield "| case and its errors | spacing [mm] | " + " | ".join(SOLVERS) + " |"
    yield "|---|---|" + "---|" * len(SOLVERS)
    for name, trial in TRIALS.items():
        for level, spacing in enumerate(trial.spacings):
            cells = [_cell(trial, found.get((name, spacing, solver))) for solver in SOLVERS]
            head = "" if level else f"{trial.title}: {trial.what}"
            yield f"| {head} | {1000 * spacing:.3g} | " + " | ".join(cells) + " |"


def _cell(trial: Trial, row: dict | None) -> str:
    if row is None:
        return "not run"
    if row["why"]:
        return f"not run, {row['processor_s'] / 60:.0f} min" if row["why"] == "given up" else "failed"
    error = trial.error(row)
    return f"{'none' if error is None else f'{100 * error:.2g} %'}, {_seconds(row['processor_s'])} s"


def _seconds(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def figure(rows: list[dict]):
    """Error over processor time on logarithmic axes: a panel a case, a line a solver. Returns the figure."""
    from cases.report.charts import COLOURS, canvas

    drawn, panels = canvas(2, 3, height=3.3)
    for panel, (name, trial) in zip(panels, TRIALS.items(), strict=True):
        for solver, colour, marker in zip(SOLVERS, COLOURS, "osD", strict=False):
            own = [row for row in rows if (row["case"], row["solver"]) == (name, solver)]
            own.sort(key=lambda row: -row["spacing"])
            points = [(row["processor_s"], 100 * error) for row in own if (error := trial.error(row)) is not None]
            if points:
                panel.loglog(*zip(*points, strict=True), marker + "-", color=colour, label=solver)
        panel.set(xlabel="processor time [s]", ylabel=f"{trial.what} [%]")
        panel.set_title(trial.title, loc="left", fontsize=13)
        ranges = (panel.xaxis, panel.dataLim.intervalx), (panel.yaxis, panel.dataLim.intervaly)
        for axis, values in ranges if panel.lines else ():
            axis.set_view_interval(*_decades(*values), ignore=True)
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("")
        panel.grid(True, which="both", color="0.9")
    named = {
        label: line
        for panel in panels
        for line, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }  # fmt: skip
    drawn.legend(named.values(), named, loc="outside upper center", ncols=3, fontsize=12, frameon=False)
    return drawn


def _decades(low: float, high: float) -> tuple[float, float]:
    """The whole decades around a range."""
    return 10 ** math.floor(math.log10(0.95 * low)), 10 ** math.ceil(math.log10(1.05 * high))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=Path, metavar="ROWS.json")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(TRIALS)}; all if none")
    parser.add_argument("--limit", type=float, default=LIMIT, metavar="S", help="processor time that a run may take")
    parser.add_argument("--figure", type=Path, metavar="PNG", help="run nothing, draw the rows")
    parser.add_argument("--table", action="store_true", help="run nothing, print the rows in Markdown")
    options = parser.parse_args()
    rows = json.loads(options.rows.read_text(encoding="utf-8")) if options.rows.exists() else []
    if options.figure:
        figure(rows).savefig(options.figure, dpi=100)
    if options.table:
        print("\n".join(table(rows)))
    if options.figure or options.table:
        return
    for name in options.cases:
        if name not in TRIALS:
            parser.error(f"no case {name!r} here; choose from {', '.join(TRIALS)}")
    warm = set()
    for name, spacing, solver in list(missing(rows, options.cases or TRIALS)):
        if (name, solver) not in warm:  # what is compiled after the first step is compiled here
            run(load(name), TRIALS[name].spacings[0], solver, limit=0.0)
            warm.add((name, solver))
        rows.append(run(load(name), spacing, solver, options.limit))
        options.rows.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        print(name, spacing, solver, _cell(TRIALS[name], rows[-1]), rows[-1]["why"], flush=True)


if __name__ == "__main__":
    main()
