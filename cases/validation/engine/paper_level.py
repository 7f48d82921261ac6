"""What the runs at the source documents' resolution would take: `python -m cases.validation.engine.paper_level [SCENE ...]`.

Every scene with a table `[levels.paper]` is started at that level and stepped for a while; the time of a step gives that of
the run. Rows are kept in `docs/developer/paper_level.json`, the table in `paper_level.md` beside it; scenes that are not named
keep theirs.

The processor time of one thread is measured, which others on the machine hardly change, and divided by what two threads
gain (`TWO`, BENCHMARK.md).
"""

from __future__ import annotations

import argparse
import time as clock
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from statistics import median

from cases.validation.engine.solvers import DEFAULT
from fsi.estimate import estimate
from fsi.scene.binding import bind
from fsi.scene.file import builtin_scenes, load_scene, scene_levels
from fsi.simulation.loop import Simulation
from fsi.strict_json import dumps, loads

DOCS = Path(__file__).parents[3] / "docs"
TWO = 1.66  # speed of two threads over one
STEPS, SECONDS = 200, 100.0  # of a measurement, at most; the step in hand is ended
THEIR_PARTICLES = {  # of the source documents, walls included
    "deck_overtopping": 79932,
    "column_tall": 298463,
    "wedge_entry": 85983,
    "owsc": 4222746,
    "spar": 2707963,
    "slide_submarine": 38680,
    "scott_russell": 17000,
    "slide_basin": 3163005,
    "dam_tank": 3558212,
    "column_collapse": 731860,
    "tank_still": 4600000,  # "4.6 million"
}
THEIR_TIME = {  # seconds of their code on 16 cores for so much of our run: (what, seconds, share of the run by steps or time)
    "owsc": ("15 s of waves", 12 * 86400.0, 15.0),
    "spar": ("two periods", 72 * 3600.0, 3.141593),
}
THEIR_STEPS = {"owsc": (200, 21426.0, 5341.0)}  # steps, seconds on one thread, on 16


def measure(name: str, steps: int = STEPS, seconds: float = SECONDS) -> dict:
    """The row of a scene: counts, and processor seconds a step with one thread, the first one left out, for it compiles. The
    run starts from hydrostatic pressure: a converged one takes as long as a hundred steps and changes nothing in theirs."""
    scene = load_scene(name, ["fluid.start=hydrostatic"], level="paper")
    bodies, coupler, ground = bind(scene, name)
    expected = estimate(scene, bodies, ground)
    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=1)
    marks = []
    try:
        sim.step()
        began = clock.process_time()
        while len(marks) < steps and clock.process_time() - began < seconds:
            start = clock.process_time()
            sim.step()
            marks.append(clock.process_time() - start)
    finally:
        sim.team.close()
    return {
        "scene": name,
        "spacing": scene.spacing,
        "dimension": scene.dimension,
        "duration": scene.duration,
        "fluid": sim.fluid.count,
        "particles": sum(sim.counts.values()),
        "memory_bytes": sim.memory_bytes,
        "measured_steps": len(marks),
        "step_seconds": median(marks),
        "steps": _steps(scene) or max(expected["steps"], round(scene.duration / (sim.time / sim.step_count))),
        "date": date.today().isoformat(),
    }


def _steps(scene) -> int | None:
    """Steps of the run, from those of the coarse one in the validation's rows: a step is as long as a spacing at the same
    speed of sound and flow."""
    file = DOCS / "validation" / "results.json"
    rows = loads(file.read_text()) if file.is_file() else []
    for row in rows:
        if (row["case"], row["level"], row["solver"]) == (scene.name, "coarse", DEFAULT):
            return round(row["steps"] * row["spacing"] / scene.spacing * scene.duration / row["simulated_seconds"])
    return None


def run_seconds(row: dict) -> float:
    """Time of the whole run on two cores [s]."""
    return row["steps"] * row["step_seconds"] / TWO


def table(rows: Iterable[dict]) -> str:
    """The page of these rows."""
    lines = [
        "# The cases at the source documents' resolution",
        "",
        "Written by `python -m cases.validation.engine.paper_level`; not edited by hand. Each scene was"
        " started with `--level paper` and stepped as often",
        "as stated; processor time of a step on one thread, median; time of the run on two cores, taken as"
        f" {TWO:g} times as fast. The steps",
        "of the run follow from those of the coarse run by the spacing, or are expected where there is none.",
        "",
        "| scene | spacing [mm] | particles (theirs) | of them fluid | memory [MB] | steps measured | a step [s] | us per"
        " particle | steps of the run | run on 2 cores |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [_line(row) for row in rows]
    ratios = [line for row in rows for line in _ratios(row)]
    if ratios:
        lines += ["", "Beside the run times of the thesis's code:", "", *ratios]
    return "\n".join(lines) + "\n"


def _line(row: dict) -> str:
    theirs = THEIR_PARTICLES.get(row["scene"])
    counted = f"{row['particles']:,}" + (f" ({theirs:,})" if theirs else "")
    cells = (
        row["scene"],
        f"{1000 * row['spacing']:g}",
        counted,
        f"{row['fluid']:,}",
        f"{row['memory_bytes'] / 1e6:.0f}",
        row["measured_steps"],
        f"{row['step_seconds']:.3g}",
        f"{1e6 * row['step_seconds'] / row['particles']:.2f}",
        f"{row['steps']:,}",
        _spelt(run_seconds(row)),
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def _ratios(row: dict) -> list[str]:
    lines, name = [], row["scene"]
    if name in THEIR_STEPS:
        steps, one, sixteen = THEIR_STEPS[name]
        ours = steps * row["step_seconds"] * THEIR_PARTICLES[name] / row["particles"]
        lines.append(
            f"- `{name}`, {steps} steps of {THEIR_PARTICLES[name]:,} particles on one thread: theirs {one:,.0f} s, ours"
            f" {ours:,.0f} s, {one / ours:.1f} times as fast; theirs on 16 threads {sixteen:,.0f} s."
        )
    if name in THEIR_TIME:
        what, seconds, duration = THEIR_TIME[name]
        ours = run_seconds(row) * duration / row["duration"]
        lines.append(
            f"- `{name}`, {what}: theirs {_spelt(seconds)} on 16 cores, ours {_spelt(ours)} on two:"
            f" {seconds / ours:.1f} times as fast, {8 * seconds / ours:.0f} times by core."
        )
    return lines


def _spelt(seconds: float) -> str:
    for unit, size in ("days", 86400), ("h", 3600), ("min", 60):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.1f} s"


def main() -> None:
    """Measure the named scenes, all if there are none, and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m cases.validation.engine.paper_level", description=__doc__.splitlines()[0]
    )
    known = [name for name in builtin_scenes() if "paper" in scene_levels(name)]
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(known)}")
    parser.add_argument("--steps", type=int, default=STEPS, help="steps to measure, at most")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="processor seconds to spend on a scene")
    chosen = parser.parse_args()
    if unknown := sorted(set(chosen.scenes) - set(known)):
        parser.error(f"no scene with a paper level: {', '.join(unknown)}; known are {', '.join(known)}")
    file = DOCS / "developer" / "paper_level.json"
    for name in chosen.scenes or known:
        row = measure(name, chosen.steps, chosen.seconds)
        rows = {row["scene"]: row for row in loads(file.read_text())} if file.is_file() else {}
        rows[name] = row
        rows = [rows[key] for key in known if key in rows]
        file.write_text(dumps(rows, indent=1) + "\n")
        (DOCS / "developer" / "paper_level.md").write_text(table(rows))
        print(_line(row), *_ratios(row), sep="\n", flush=True)


if __name__ == "__main__":
    main()
