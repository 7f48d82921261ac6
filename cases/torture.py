"""Does a run survive being killed? `python -m cases.torture [--kills N] [--seed S] [NAME ...]`.

Each scene runs once undisturbed. Then it is started again and again, ended by a signal at a random instant, looked at, and
resumed from its last checkpoint (or started anew where it has none yet), until it is done. After each kill, what was
logged must be readable and be the same as in the undisturbed run, up to 2 s of wall time before the kill; at the end all
series (but `wall_time`) and all snapshots of particles must be those of the undisturbed run, bit for bit.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from cases.bench.identity import CHANNEL, LAYERS, SEA
from fsi.errors import SceneError
from fsi.record.run_folder import load_run, read_manifest
from fsi.resuming import recover, resume
from fsi.runner import run
from fsi.scene.file import load_scene
from fsi.scene.model import Scene

SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)  # the first twice as often
BOUND = 2.0  # wall time [s] before a SIGKILL, up to which everything must be readable
FLAP = ("spacing=0.07", "tank.max=[5.0, 0.49]", "bodies.flap.position=[2.1, 0.0, 0.0]", "gauges.lee.x=3.0",
        "damping[0].start=4.0", "damping[0].end=5.0", "probes=", "duration=2.0")  # fmt: skip
SCENES: dict[str, tuple[str, tuple[str, ...]]] = {
    "channel": (CHANNEL, ("spacing=0.025", "duration=3.0")),
    "layers": (LAYERS, ("spacing=0.02", "duration=0.6")),
    "sea": (SEA, ("spacing=0.05", "duration=2.0")),
    "box": ("floating_box_2d", ("spacing=0.05", "duration=3.0")),
    "flap": (
        "flap",
        (*FLAP, "coupler.scheme=fixed_point", "bodies.flap.pto.kind=latching", "bodies.flap.pto.hold=0.1"),
    ),
    "slide": ("slide_submarine_contact", ("spacing=0.05", "tank.min=[-0.025, -1]", "tank.max=[3.975, 0.5]")),
}


@dataclass
class Score:
    """Of one scene: kills by signal, kills survived, resumes, and what was lost, in words."""

    kills: Counter = field(default_factory=Counter)
    survived: int = 0
    resumes: int = 0
    lost: list[str] = field(default_factory=list)
    slowest_end: float = 0.0  # from a signal that can be caught to the end of the process [s]


def scene_of(name: str, folder: Path) -> Scene:
    source, settings = SCENES[name]
    if "\n" in source:
        file = folder / f"{name}.toml"
        file.write_text(source)
        source = str(file)
    return load_scene(source, [*settings, "output.checkpoint=0.2", "output.series=0.005", "output.particles=0.05"])


def torture(name: str, kills: int, folder: Path, dice: random.Random) -> Score:
    """Kill a scene so many times."""
    scene, score = scene_of(name, folder), Score()
    reference = folder / f"{name}-whole"
    began = time.perf_counter()
    run(scene, out=reference, threads=1, quiet=True)
    length = time.perf_counter() - began
    whole = load_run(reference)
    attempt, victim = 0, None
    while score.kills.total() < kills:
        if victim is None:
            attempt += 1
            victim = folder / f"{name}-{attempt}"
        number = dice.choice(SIGNALS)
        ended, wall = _child(scene, victim, dice.uniform(0.05, 0.6) * length, number, dice.choice((1, 2)), score)
        if not ended:
            score.kills[signal.Signals(number).name] += 1
            faults = _look(victim, whole, number, wall)
            score.lost += [f"{name}: {fault}" for fault in faults]
            score.survived += not faults
        if ended or score.kills.total() == kills:
            _child(scene, victim, None, 0, 1, score)
            score.lost += [f"{name}, at the end: {fault}" for fault in _compare(victim, reference)]
            victim = None
    return score


def _child(
    scene: Scene, folder: Path, after: float | None, number: int, threads: int, score: Score
) -> tuple[bool, float]:
    """Start or resume the run in a process of its own and send it the signal `after` so many seconds; whether it came to its
    end before, and when it was sent, on the clock of files."""
    resumable = any(folder.glob("checkpoints/*.checkpoint"))
    if (folder / "run.json").exists() and read_manifest(folder)["status"] == "done":
        return True, 0.0
    score.resumes += resumable
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        _run(scene, folder, threads, resumable)
    sent = 0.0
    if after is not None:
        deadline = time.perf_counter() + after
        while time.perf_counter() < deadline:
            if os.waitpid(child, os.WNOHANG)[0]:
                return True, 0.0
            time.sleep(0.002)
        os.kill(child, number)
        sent = time.perf_counter()
    wall = time.time()
    os.waitpid(child, 0)
    if sent and number != signal.SIGKILL:
        score.slowest_end = max(score.slowest_end, time.perf_counter() - sent)
    done = (folder / "run.json").exists() and read_manifest(folder)["status"] == "done"
    return done, wall


def _run(scene: Scene, folder: Path, threads: int, resumable: bool) -> None:
    code = 1
    try:
        if resumable:
            code = resume(folder, threads=threads, quiet=True).exit_code
        else:
            if (folder / "run.json").exists():
                _clear(folder)
            code = run(scene, out=folder, threads=threads, quiet=True).exit_code
    except BaseException as fault:
        print(f"{folder.name}: {type(fault).__name__}: {fault}", file=sys.stderr, flush=True)
    finally:
        os._exit(code)


def _clear(folder: Path) -> None:
    for file in folder.iterdir():
        if file.is_file():
            file.unlink()


def _look(folder: Path, whole, number: int, killed: float) -> list[str]:
    """What is wrong with what a kill left."""
    if not (folder / "run.json").exists() or not (folder / "run.mcap").exists():
        return []  # before the first step
    try:
        left = load_run(folder)
        status = left.attrs["status"]
        faults = [] if status in ("killed", "interrupted") else [f"a dead run counts as {status}"]
        if number == signal.SIGKILL:
            recover(folder)
            if load_run(folder).sizes["time"] != left.sizes["time"]:
                faults.append("recover changed the number of frames")
        if left.sizes.get("time"):
            faults += [f"before the kill, {n}" for n in _different(left, whole.isel(time=slice(left.sizes["time"])))]
        facts = read_manifest(folder)
        if left.sizes.get("time") and not facts.get("resumed"):  # a resumed run has the clock of two runs
            age = killed - datetime.fromisoformat(facts["started"]).timestamp()
            if (gap := age - float(left.wall_time[-1])) > BOUND:
                faults.append(f"the last {gap:.1f} s of wall time are not in the log")
        return faults
    except (SceneError, OSError, ValueError, KeyError) as fault:
        return [f"{type(fault).__name__}: {fault}"]


def _compare(folder: Path, reference: Path) -> list[str]:
    """Names of what is not the same in two runs that are done."""
    try:
        faults = _different(load_run(folder), load_run(reference), events=True)
    except SceneError as fault:
        return [str(fault)]
    if (reference / "run.rrd").exists():
        from fsi.record.timeline_reader import read_snapshots

        times = np.arange(0, 100, 0.05)
        ours, theirs = (read_snapshots(path / "run.rrd", times) for path in (folder, reference))
        same = len(ours) == len(theirs) and all(
            a.time == b.time and np.array_equal(a.position, b.position) and np.array_equal(a.level, b.level)
            for a, b in zip(ours, theirs, strict=True)
        )
        faults += [] if same else [f"snapshots ({len(ours)} of {len(theirs)})"]
    return faults


def _different(one, two, events: bool = False) -> list[str]:
    names = sorted((set(one.variables) | set(two.variables)) - {"wall_time"})
    names = [name for name in names if events or not name.startswith("event")]
    return [n for n in names if n not in one.variables or n not in two.variables or not _same(one[n], two[n])]


def _same(a, b) -> bool:
    a, b = a.values, b.values
    return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SCENES)}; all if none")
    parser.add_argument("--kills", type=int, default=60, help="in all")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    names, dice, lost = options.names or list(SCENES), random.Random(options.seed), []
    print(f"{'scene':10} {'kills':>6} {'survived':>9} {'resumes':>8} {'lost':>5}  slowest end after a signal")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            score = torture(name, -(-options.kills // len(names)), Path(folder), dice)
            lost += score.lost
            counts = f"{score.kills.total():6} {score.survived:9} {score.resumes:8} {len(score.lost):5}"
            kinds = ", ".join(f"{n} {s}" for s, n in score.kills.items())
            print(f"{name:10} {counts}  {score.slowest_end:.2f} s  ({kinds})", flush=True)
    print("\n".join(lost))
    sys.exit(1 if lost else 0)


if __name__ == "__main__":
    main()
