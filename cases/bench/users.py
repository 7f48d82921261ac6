"""What users run: built-in scenes as they stand, bodies and logging included, in turns with another checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

import cases
from cases.bench import visitor
from fsi.errors import RunError

SCENES = ("flap", "owsc", "dam_tank", "floating_box", "spar")  # the last four in three dimensions
HERE = Path(cases.__file__).parents[1]
PHASES = ("neighbours", "predictor", "pressure", "corrector", "record")


class Visited:
    """A scene that a process of a checkout steps; `start` are the facts of its start."""

    def __init__(self, scene: str, checkout: Path, settings: tuple[str, ...] = (), threads: int = 1):
        asked = json.dumps({"scene": scene, "settings": list(settings), "threads": threads})
        self._process = subprocess.Popen(
            [sys.executable, "-P", visitor.__file__, asked],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)},
        )  # fmt: skip
        self.start = self._answer()
        self.visits: list[dict] = []

    def visit(self, seconds: float) -> None:
        self._process.stdin.write(f"{seconds}\n")
        self._process.stdin.flush()
        self.visits.append(self._answer())

    def close(self) -> None:
        self._process.communicate()

    def _answer(self) -> dict:
        line = self._process.stdout.readline()
        if not line:
            raise RunError(f"a run of the benchmark failed: {self._process.communicate()[1].strip()[-500:]}")
        return json.loads(line)


def users(
    scenes: tuple[str, ...], rounds: int, visit: float, against: Path | None = None, settings: tuple[str, ...] = ()
) -> list[dict]:
    """One row a scene, of this checkout, and after it one of the other: medians over so many visits of processor and wall
    seconds per simulated second, of one thread. A process that only starts goes before, so that compiled code is there."""
    rows = []
    sides = {"here": HERE} | ({"against": against.resolve()} if against else {})
    for scene in scenes:
        for checkout in sides.values():
            Visited(scene, checkout, settings).close()
        runs = {name: Visited(scene, checkout, settings) for name, checkout in sides.items()}
        for _ in range(rounds):
            for run in runs.values():
                run.visit(visit)
        for name, run in runs.items():
            run.close()
            rows.append({"scene": scene, "checkout": name} | facts(run.start, run.visits))
    for row in rows:
        other = next((r for r in rows if r["scene"] == row["scene"] and r["checkout"] == "against"), None)
        if other and row["checkout"] == "here":
            row["times_as_fast"] = other["processor_s"] / row["processor_s"]
    return rows


def facts(start: dict, visits: list[dict]) -> dict:
    """Figures of the visits of one run."""
    fluid, phases = start["counts"]["fluid"], visits[0]["phases"]
    each = lambda name: median(v[name] / v["simulated"] for v in visits)  # noqa: E731
    spent = {name: median(v["phases"].get(name, 0.0) / v["steps"] for v in visits) for name in PHASES if name in phases}
    whole = sum(spent.values())
    return {
        "fluid": fluid,
        "boundary": sum(start["counts"].values()) - fluid,
        "bytes_per_fluid_particle": start["memory_bytes"] / fluid,
        "start_s": start["start_s"],
        "processor_s": each("processor"),
        "wall_s": each("wall"),
        "ms_per_step": median(1e3 * v["processor"] / v["steps"] for v in visits),
        "ns_per_particle": median(1e9 * v["processor"] / v["steps"] / fluid for v in visits),
        "shares": {name: value / whole for name, value in spent.items()},
    }
