"""One fuzzed input: made from its number, checked, run for some steps."""

from __future__ import annotations

import json
import random
import resource
import sys
import time
import traceback
import warnings
from pathlib import Path

import numpy as np

import fsi
from tests.fuzz.mjcfs import mjcf
from tests.fuzz.scenes import scene

STEPS = 20
ROOM = 1e9  # bytes that a check may take beyond the imports
RUNNABLE = 4000  # particles


def make(kind: str, number: int, folder: Path, seed: int = 0) -> Path:
    """Write input `number` of a kind, `scene` or `mjcf`, into a folder; the scene file."""
    rng = random.Random(f"{kind} {seed} {number}")
    file = folder / "s.toml"
    if kind == "scene":
        text = scene(rng)
    else:
        text, bodies = mjcf(rng)
        (folder / "b.xml").write_text(bodies, encoding="utf-8")
    file.write_text(text, encoding="utf-8")
    return file


def check(file: Path) -> tuple[str, str, dict | None]:
    """`accepted`, `refused` or `broken`, the first line of the answer, and the facts of `fsi.check`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            facts = fsi.check(file)
    except fsi.SceneError as error:
        line = str(error).splitlines()[0] if str(error) else ""
        return ("refused" if line else "broken"), line, None
    except BaseException:
        return "broken", traceback.format_exc(), None
    return "accepted", next(iter(facts["warnings"]), ""), facts


def run(file: Path) -> tuple[str, str]:
    """`calm`, `alarm` (the run says what is wrong) or `broken`, and why, after STEPS steps."""
    from fsi.scene.binding import bind
    from fsi.simulation.loop import Simulation

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = fsi.load_scene(file)
            bodies, coupler, ground = bind(made, file.name)
            sim = Simulation(made, bodies=bodies, coupler=coupler, ground=ground, threads=1)
            try:
                for _ in range(STEPS):
                    sim.step()
            finally:
                sim.team.close()
    except (fsi.RunError, fsi.SceneError) as error:
        return "alarm", str(error)
    except BaseException:
        return "broken", traceback.format_exc()
    fluid = sim.fluid
    for name, values in (
        ("position", fluid.position),
        ("velocity", fluid.velocity),
        ("pressure", fluid.pressure_values),
    ):
        if not np.isfinite(values).all():
            return "broken", f"{name} is not finite, and no alarm"
    return "calm", ""


def serve() -> None:
    """Read `kind number seed folder run` from stdin, one a line, and answer each by a line of JSON."""
    import bodies.bodyset  # noqa: F401
    import fsi.estimate  # noqa: F401

    pages = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (int(pages + ROOM), resource.RLIM_INFINITY))
    answers = sys.stdout
    sys.stdout = sys.stderr
    for line in sys.stdin:
        kind, number, seed, folder, runs = json.loads(line)
        file = make(kind, number, Path(folder), seed)
        start = time.process_time()
        state, text, facts = check(file)
        answer = {"state": state, "text": text, "seconds": time.process_time() - start}
        if facts and runs:
            cost = facts["estimate"]
            if sum(cost[owner] for owner in ("fluid", "wall", "body")) <= RUNNABLE:
                resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
                answer["run"], answer["why"] = run(file)
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    serve()
