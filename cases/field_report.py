"""Inputs that users met, each with its answer in one table: `python -m cases.field_report DIR`.

Every scene and study in the folders of DIR goes through `fsi check` and, where it is accepted, through a short run, in a
process of its own under a limit of time. PATTERN after the folder picks inputs, such as 'F08/*'. Each answer is held against
what is expected of the input (`cases.field_expected`); the exit code is 1 where one disagrees.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cases.field_expected import EXPECTED, VARIANTS, Expected, disagreements
from fsi.command import main as fsi_command

if TYPE_CHECKING:
    from xarray import Dataset

LIMIT = 60.0  # [s] of wall time for the check
RUNS = 10  # times as long for the run
UNTIL = 0.5  # [s] that an accepted scene is run of which nothing is expected


@dataclass
class Answer:
    """What became of one input: exit code of `fsi check` (None: no answer in time), the line of what it said that counts, its
    wall time [s]; of the run the status, the speed at its end over sqrt(g H) and the particles lost; `wrong`: what it lacks
    of what is expected, None where nothing is."""

    name: str
    code: int | None
    line: str
    seconds: float
    run: str = ""
    speed: float = math.nan
    lost: float = math.nan
    wrong: list[str] | None = None


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m cases.field_report", description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("patterns", nargs="*", default=["*"], metavar="PATTERN")
    parser.add_argument("--until", type=float, help="simulated time of a run at most [s]; 0: no runs")
    parser.add_argument("--limit", type=float, default=LIMIT, help="wall time of each call [s]")
    chosen = parser.parse_args(arguments)
    _warm()
    answers = []
    for name, file, settings in inputs(chosen.folder, chosen.patterns):
        answers.append(answer(name, file, settings, chosen.until, chosen.limit))
        print(f"{len(answers)}: {said(answers[-1])}", file=sys.stderr, flush=True)
    console = Console()
    console.width = max(console.width, 160)
    console.print(table(answers))
    wrong = [a.name for a in answers if a.wrong]
    console.print(
        f"{len(answers)} inputs, {sum(a.wrong is not None for a in answers)} with an expectation, {len(wrong)} disagree"
    )
    raise SystemExit(bool(wrong))


def inputs(folder: Path, patterns: Sequence[str]) -> list[tuple[str, Path, list[str]]]:
    """Name, file and settings of every input: the TOML files, a scene once more for each table that it could read, and under
    other settings (`VARIANTS`)."""
    found = []
    for file in sorted(folder.rglob("*.toml")):
        name = str(file.relative_to(folder))
        if not any(Path(name).match(pattern) for pattern in patterns):
            continue
        found.append((name, file, []))
        key = _table_key(file)
        found += [
            (f"{name} with {other.name}", file, [f"{key}={other}"])
            for other in sorted(file.parent.glob("*.csv"))
            if key
        ]
        found += [
            (other, file, [setting.format(folder=file.parent) for setting in settings])
            for other, settings in VARIANTS.items()
            if other.startswith(f"{name}, ")
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


def answer(name: str, file: Path, settings: Sequence[str], until: float | None, limit: float) -> Answer:
    """Check one input and run it as far as is expected of it, `until` [s] at most."""
    expected = EXPECTED.get(name)
    wanted = expected.until if expected else min(_read(file).get("duration", UNTIL), UNTIL)
    end = wanted if until is None else min(wanted, until)
    sets = [word for setting in settings for word in ("--set", setting)]
    with tempfile.TemporaryDirectory() as scratch:
        if "scene" in _read(file):
            code, text, seconds = call(["sweep", str(file), "--workers", "0", "--quiet", "--out", scratch], limit)
        else:
            code, text, seconds = call(["check", str(file), *sets], limit)
        got, data = Answer(name, code, _line(text, expected), seconds), None
        if code == 0 and end > 0 and "scene" not in _read(file):
            out = Path(scratch, "run")
            short = ["--until", repr(end), "--quiet", "--trust", "--threads", "1", "--set", "output.timeline=false"]
            ended, why, _ = call(["run", str(file), *sets, *short, "--out", str(out)], RUNS * limit)
            why = _line(why, None)
            got.run = {0: "done", 1: f"failed: {why}", None: "no end in time"}.get(ended, f"refused: {why}")
            data, got.speed, got.lost = _figures(out)
        if expected:
            whole = data if end == wanted and got.run == "done" else None
            got.wrong = disagreements(expected, code, text, got.run, got.speed, whole)
        return got


def _line(text: str, expected: Expected | None) -> str:
    """The line of an answer that holds the words that are expected; else the first, of a traceback the last."""
    lines = [
        line
        for line in text.splitlines()
        if line.strip() and not line.startswith(("#", "[")) and " = " not in line[:40]
    ]
    words = expected.says[0] if expected and expected.says else "\0"
    first = lines[-1:] if lines and lines[0].startswith("Traceback") else lines[:1]
    return next((line.lstrip("# ") for line in text.splitlines() if words in line), "".join(first))


def call(arguments: Sequence[str], limit: float) -> tuple[int | None, str, float]:
    """Exit code, stderr and stdout, and wall time [s] of `fsi` with these arguments; None where it did not end in time. It runs
    in a fork of this process, which has imported what it needs."""
    began = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        child = os.fork()
        if child == 0:
            _become(arguments, said.fileno())
        code = _ended(child, began + limit)
        said.seek(0)
        text = said.read().decode(errors="replace")
    if code is None:
        return None, f"no answer within {limit:g} s", limit
    return code, text, time.perf_counter() - began


def _warm() -> None:
    """Import what a check and a run need, and load what they have compiled: the forks have it then."""
    import fsi.estimate
    import fsi.record.background
    import fsi.simulation.loop

    fsi.check("floating_box_2d")


def _become(arguments: Sequence[str], output: int) -> NoReturn:
    """Be the command `fsi` with these arguments, which writes into `output`."""
    os.setsid()
    os.dup2(output, 1)
    os.dup2(output, 2)
    code = 1
    try:
        sys.argv = ["fsi", *arguments]
        fsi_command()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _ended(child: int, until: float) -> int | None:
    """The exit code of a child, negative of one that a signal ended; None where it had to be killed at `until` [s]."""
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.perf_counter() > until:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return None
        time.sleep(0.02)


def _figures(folder: Path) -> tuple[Dataset | None, float, float]:
    """The log of a run, None where there is none; largest speed at its end over sqrt(g H), and particles lost."""
    from fsi.errors import SceneError
    from fsi.record.dataset import load_run
    from fsi.scene.file import load_scene
    from fsi.scene.geometry import fluid_depth

    try:
        data, scene = load_run(folder), load_scene(folder / "scene.toml")
        if not data.sizes.get("time"):
            return None, math.nan, math.nan
        wave = math.sqrt(scene.gravity * fluid_depth(scene)) or math.nan
        return data, float(data.max_speed[-1]) / wave, float(data.lost_particles[-1])
    except (SceneError, AttributeError):
        return None, math.nan, math.nan


def said(a: Answer) -> str:
    """An answer in a line, so that a report that is cut short has told all that it found."""
    figures = f", speed {a.speed:.3g} sqrt(g H), {a.lost:.3g} lost" if not math.isnan(a.speed) else ""
    answer = "no answer" if a.code is None else f"exit {a.code}"
    return f"{a.name}: {_verdict(a)}: {answer}: {a.line} ({a.seconds:.1f} s); {a.run}{figures}"


def _verdict(a: Answer) -> str:
    if a.wrong is None:
        return "nothing expected"
    return "; ".join(a.wrong) or "as expected"


def table(answers: Sequence[Answer]) -> Table:
    """The answers as a table."""
    made = Table("input", "expected", "agrees", "exit", "answer", "check [s]", "run", "speed / sqrt(g H)", "lost")
    for a in answers:
        figures = ["" if math.isnan(x) else f"{x:.3g}" for x in (a.speed, a.lost)]
        code = "-" if a.code is None else str(a.code)
        words = EXPECTED[a.name].words if a.name in EXPECTED else ""
        agrees = "" if a.wrong is None else "; ".join(a.wrong) or "yes"
        known = map(escape, (a.name, words, agrees))
        made.add_row(*known, code, escape(a.line), f"{a.seconds:.1f}", escape(a.run), *figures)
    return made


if __name__ == "__main__":
    main()
