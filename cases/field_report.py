"""Inputs that users met, each with its answer in one table: `python -m cases.field_report DIR`.

Every scene and study in the folders of DIR goes through `fsi check` and, where it is accepted, through a short run, in a
process of its own under a limit of time. PATTERN after the folder picks inputs, such as 'F08/*'.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

LIMIT = 60.0  # [s] of wall time for the check, and for the run
UNTIL = 0.5  # [s] that an accepted scene is run


@dataclass
class Answer:
    """What became of one input: exit code of `fsi check` (None: no answer in time), the first line it said, its wall time
    [s]; of the run the status, the largest speed over sqrt(g H) and the particles lost."""

    name: str
    code: int | None
    line: str
    seconds: float
    run: str = ""
    speed: float = math.nan
    lost: float = math.nan


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m cases.field_report", description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("patterns", nargs="*", default=["*"], metavar="PATTERN")
    parser.add_argument("--until", type=float, default=UNTIL, help="simulated time of a run [s]; 0: no runs")
    parser.add_argument("--limit", type=float, default=LIMIT, help="wall time of each call [s]")
    parser.add_argument("--tables", action="store_true", help="also each table beside a scene that reads one")
    chosen = parser.parse_args(arguments)
    answers = []
    for name, file, settings in inputs(chosen.folder, chosen.patterns, chosen.tables):
        answers.append(answer(name, file, settings, chosen.until, chosen.limit))
        print(f"{len(answers)}: {said(answers[-1])}", file=sys.stderr, flush=True)
    console = Console()
    console.width = max(console.width, 160)
    console.print(table(answers))


def inputs(folder: Path, patterns: Sequence[str], tables: bool) -> list[tuple[str, Path, list[str]]]:
    """Name, file and settings of every input: the TOML files, and a scene once more for each table that it could read."""
    found = []
    for file in sorted(folder.rglob("*.toml")):
        name = str(file.relative_to(folder))
        if not any(Path(name).match(pattern) for pattern in patterns):
            continue
        found.append((name, file, []))
        key = _table_key(file) if tables else ""
        found += [
            (f"{name} with {other.name}", file, [f"{key}={other}"])
            for other in sorted(file.parent.glob("*.csv"))
            if key
        ]
    return found


def _table_key(file: Path) -> str:
    """The key of the table that a scene reads, empty if it reads none."""
    data = _read(file)
    if data.get("waves", {}).get("kind") == "table":
        return "waves.file"
    powered = (name for name, body in data.get("bodies", {}).items() if body.get("pto", {}).get("kind") == "table")
    return next((f"bodies.{name}.pto.file" for name in powered), "")


def _read(file: Path) -> dict:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (ValueError, OSError):
        return {}


def answer(name: str, file: Path, settings: Sequence[str], until: float, limit: float) -> Answer:
    """Check one input and run it for a while."""
    sets = [word for setting in settings for word in ("--set", setting)]
    with tempfile.TemporaryDirectory() as scratch:
        if "scene" in _read(file):
            code, line, seconds = call(["sweep", str(file), "--workers", "0", "--quiet", "--out", scratch], limit)
            return Answer(name, code, line, seconds)
        code, line, seconds = call(["check", str(file), *sets], limit)
        got = Answer(name, code, line, seconds)
        if code == 0 and until > 0:
            out, duration = Path(scratch, "run"), _read(file).get("duration", until)
            short = ["--until", repr(min(until, duration)), "--quiet", "--set", "output.timeline=false"]
            ended, why, _ = call(["run", str(file), *sets, *short, "--out", str(out)], limit)
            got.run = {0: "done", 1: f"failed: {why}", None: "no end in time"}.get(ended, f"refused: {why}")
            got.speed, got.lost = _figures(out)
        return got


def call(arguments: Sequence[str], limit: float) -> tuple[int | None, str, float]:
    """Exit code, first line of stderr and wall time [s] of `fsi` with these arguments; None where it did not end in time."""
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "fsi", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        _, said = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None, f"no answer within {limit:g} s", limit
    lines = [line for line in said.splitlines() if line.strip()] or [""]
    first = lines[-1] if lines[0].startswith("Traceback") else lines[0]
    return process.returncode, first, time.perf_counter() - began


def _figures(folder: Path) -> tuple[float, float]:
    """Largest speed over sqrt(g H), and particles lost, in the log of a run; nan where there is none."""
    from fsi.errors import SceneError
    from fsi.record.dataset import load_run
    from fsi.scene.file import load_scene
    from fsi.scene.geometry import fluid_depth

    try:
        data, scene = load_run(folder), load_scene(folder / "scene.toml")
        if not data.sizes.get("time"):
            return math.nan, math.nan
        wave = math.sqrt(scene.gravity * fluid_depth(scene)) or math.nan
        return float(data.max_speed.max()) / wave, float(data.lost_particles[-1])
    except (SceneError, AttributeError):
        return math.nan, math.nan


def said(a: Answer) -> str:
    """An answer in a line, so that a report that is cut short has told all that it found."""
    figures = f", speed {a.speed:.3g} sqrt(g H), {a.lost:.3g} lost" if not math.isnan(a.speed) else ""
    return f"{a.name}: {'no answer' if a.code is None else f'exit {a.code}'}: {a.line} ({a.seconds:.1f} s); {a.run}{figures}"


def table(answers: Sequence[Answer]) -> Table:
    """The answers as a table."""
    made = Table("input", "exit", "answer", "check [s]", "run", "speed / sqrt(g H)", "lost")
    for a in answers:
        figures = ["" if math.isnan(x) else f"{x:.3g}" for x in (a.speed, a.lost)]
        code = "-" if a.code is None else str(a.code)
        made.add_row(escape(a.name), code, escape(a.line), f"{a.seconds:.1f}", escape(a.run), *figures)
    return made


if __name__ == "__main__":
    main()
