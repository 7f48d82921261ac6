"""What all tests of `cases.torture` share: small scenes, runs of them in processes of their own, and how runs are compared.

A process is forked from one that has compiled the scene's kernels but opened no recording and owns no threads, so that a run
begins within milliseconds.
"""

from __future__ import annotations

import filecmp
import os
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from itertools import count
from mmap import mmap
from pathlib import Path

import numpy as np

from cases.bench.identity import CHANNEL, LAYERS, SEA
from fsi.errors import RunError, SceneError
from fsi.record.dataset import load_run
from fsi.record.manifest import read_manifest
from fsi.resuming import resume
from fsi.runner import run
from fsi.scene.file import load_scene, resolved_toml
from fsi.scene.model import Scene

FLAP = ("spacing=0.07", "tank.max=[5.0, 0.49]", "bodies.flap.position=[2.1, 0.0, 0.0]", "gauges.lee.x=3.0",
        "damping[0].start=4.0", "damping[0].end=5.0", "probes=", "duration=0.6")  # fmt: skip
MUD = LAYERS.replace("kinematic_viscosity = 2e-3", "rheology = {mu_inf = 1.0, mu_0 = 100.0, yield_stress = 20.0}")
SCENES: dict[str, tuple[str, tuple[str, ...]]] = {
    "channel": (CHANNEL, ("spacing=0.05", "duration=4.0")),  # periodic
    "mud": (MUD, ("spacing=0.04", "duration=0.8")),  # two liquids, one with a yield stress
    "sea": (SEA, ("spacing=0.08", "tank.min=[0.0, -0.48]", "duration=1.6")),  # irregular waves, absorbed
    "box": ("floating_box_2d", ("spacing=0.06", "duration=1.0")),  # coupled by added mass
    "flap": (  # coupled by a fixed point, with a power take-off that remembers
        "flap",
        (*FLAP, "coupler.scheme=fixed_point", "bodies.flap.pto.kind=latching", "bodies.flap.pto.hold=0.1"),
    ),
    "slide": (  # in contact with its ramp
        "slide_submarine_contact",
        ("spacing=0.05", "tank.min=[-0.025, -1]", "tank.max=[3.975, 0.5]", "duration=0.15"),
    ),
}
OUTPUT = ("output.checkpoint=0.05", "output.series=0.01", "output.particles=0.05")
LOGS = ("run.mcap", "run.rrd")  # which are the same whatever happened to a run
WHOLE = {*LOGS, "run.clock", "run.json", "scene.toml", "checkpoints"}  # files of a run that is done
RECORDING = (
    "fsi.record.mcap",
    "fsi.record.timeline",
    "fsi.estimate",
    "filelock",
    "pandas",
    "pyarrow.compute",
    "xarray",
)
DONE, FAILED, REFUSED = 0, 1, 2  # exit codes
SEEN = 4096  # frames that a witness keeps in mind
PATIENCE = 120.0  # [s] that a process may take to end


@dataclass
class Score:
    """Of one test: how often it was tried, how often nothing was lost, what was lost in words; and what else was counted."""

    test: str
    tries: int = 0
    survived: int = 0
    lost: list[str] = field(default_factory=list)
    counts: Counter = field(default_factory=Counter)
    slowest_end: float = 0.0  # from a signal to the end of the process [s]
    dearest: float = 0.0  # share of the run time that checkpoints take

    def book(self, where: str, faults: list[str]) -> None:
        """One more try, with what was wrong afterwards."""
        self.tries += 1
        self.survived += not faults
        self.lost += (lines := [f"{self.test}, {where}: {fault}" for fault in faults])
        print(*lines, sep="\n", end="\n" if lines else "", file=sys.stderr, flush=True)

    def add(self, other: Score) -> None:
        """Put the score of the same test on another scene to this one."""
        self.tries, self.survived = self.tries + other.tries, self.survived + other.survived
        self.lost, self.counts = self.lost + other.lost, self.counts + other.counts
        self.slowest_end = max(self.slowest_end, other.slowest_end)
        self.dearest = max(self.dearest, other.dearest)

    @property
    def remark(self) -> str:
        """What else was counted, in words."""
        slowest = [f"the slowest ended within {self.slowest_end:.2f} s"] if self.slowest_end else []
        dearest = [f"at most {100 * self.dearest:.2g} % of the run time"] if self.dearest else []
        return ", ".join([*slowest, *dearest, *(f"{count} {what}" for what, count in self.counts.items())])


@dataclass(frozen=True)
class Subject:
    """A scene under test: its run that nothing happened to, in `whole`, and how long that took [s]."""

    name: str
    scene: Scene
    folder: Path
    whole: Path
    seconds: float

    @property
    def file(self) -> Path:
        """The scene as a file."""
        return self.folder / f"{self.name}.toml"

    def new(self, purpose: str, number: int) -> Path:
        """A folder that is not there yet."""
        return self.folder / f"{self.name}-{purpose}-{number}"


def subject(name: str, folder: Path) -> Subject:
    """Compile a scene's kernels in this process and run it once, undisturbed, in another. RunError where that fails."""
    source, settings = SCENES[name]
    if "\n" in source:
        (folder / f"{name}-source.toml").write_text(source)
        source = str(folder / f"{name}-source.toml")
    scene = load_scene(source, [*settings, *OUTPUT])
    (folder / f"{name}.toml").write_text(resolved_toml(scene))
    _warm(scene)
    whole = folder / f"{name}-whole"
    began = time.perf_counter()
    if wait(fork(lambda: go(scene, whole))) != DONE:
        raise RunError(f"{name} does not run by itself")
    return Subject(name, scene, folder, whole, time.perf_counter() - began)


def _warm(scene: Scene) -> None:
    """Load or compile what a run takes; the modules that record are imported, and open nothing."""
    for module in RECORDING:
        import_module(module)
    from fsi.simulation.loop import Simulation

    simulation = Simulation(scene, recorders=[Deaf()], threads=1)
    simulation.run(0.02 * scene.duration)
    simulation.close()


class Deaf:
    """A recorder of nothing: with it a run computes all that is recorded."""

    def begin(self, scene, bodies) -> None: ...

    def series(self, frame) -> None: ...

    def particles(self, frame) -> None: ...

    def event(self, event) -> None: ...

    def end(self) -> None: ...


def go(scene: Scene, folder: Path, threads: int = 1) -> int:
    """Run a scene, or go on with it from its last checkpoint; the exit code."""
    if any(folder.glob("checkpoints/*.checkpoint")) and (folder / "run.json").exists():
        return resume(folder, threads=threads, quiet=True).exit_code
    if (folder / "run.json").exists():
        for file in sorted(
            folder.iterdir(), key=lambda file: file.name == "run.json"
        ):  # last, or a kill here leaves no run
            if file.is_file():
                file.unlink()
    return run(scene, out=folder, threads=threads, quiet=True).exit_code


def fork(call: Callable[[], int]) -> int:
    """Do something in a process of its own, which ends with what it returns, or as the command `fsi` would."""
    sys.stdout.flush()
    sys.stderr.flush()
    if child := os.fork():
        return child
    code = FAILED
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell turns off in the background
        code = call()
    except SceneError:
        code = REFUSED
    except RunError:
        code = FAILED
    except KeyboardInterrupt:
        code = 130
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else FAILED
    except BaseException as fault:
        print(f"{type(fault).__name__}: {fault}", file=sys.stderr, flush=True)
        code = 99
    finally:
        os._exit(code)


def wait(child: int, seconds: float = PATIENCE) -> int | None:
    """The exit code of a process, negative for the signal that ended it; None where it had to be killed after so long."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


class Witness:
    """Sees which frames a run in another process has computed and when, by memory that both share."""

    def __init__(self) -> None:
        kind = np.dtype([("step", np.int64), ("time", np.float64)])
        self._seen = np.frombuffer(mmap(-1, SEEN * kind.itemsize), kind)

    def watch(self) -> None:
        """In the process of the run: note every frame before it is recorded."""
        from fsi.record.background import Background

        record, number = Background.series, count()

        def series(recorder, frame) -> None:
            self._seen[next(number) % SEEN] = frame.step, time.time()
            record(recorder, frame)

        Background.series = series

    def forget(self) -> None:
        self._seen[:] = (-1, np.inf)

    def last(self, before: float) -> int:
        """Step of the last frame that was computed before this time, on the clock of files; -1 where none was."""
        return int(self._seen["step"][self._seen["time"] < before].max(initial=-1))


def is_done(folder: Path) -> bool:
    return (folder / "run.json").exists() and read_manifest(folder)["status"] == "done"


def load(folder: Path):
    """The series of a run, without a word on what is missing."""
    with warnings.catch_warnings(action="ignore"):
        return load_run(folder)


def compare(folder: Path, reference: Path) -> list[str]:
    """What is not the same in two runs that are done: bytes of the logs, and with those of `run.mcap` names of the series."""
    faults = []
    for name in LOGS:
        ours, theirs = (path / name for path in (folder, reference))
        if theirs.exists() and not (ours.exists() and filecmp.cmp(ours, theirs, shallow=False)):
            faults.append(f"bytes of {name}")
    try:
        log = load(folder)
        if faults:
            faults += different(log, load(reference), events=True)
        if np.isnan(log.wall_time).any():
            faults.append("frames without a wall time")
    except SceneError as fault:
        return [*faults, str(fault)]
    left = sorted(file.name for file in folder.iterdir() if file.name not in WHOLE and file.suffix != ".lock")
    return faults + [f"{name} is left" for name in left]


def different(one, two, events: bool = False) -> list[str]:
    """Names of the variables that are not the same in two datasets; `wall_time` is never the same."""
    names = sorted((set(one.variables) | set(two.variables)) - {"wall_time"})
    names = [name for name in names if events or not name.startswith("event")]
    return [n for n in names if n not in one.variables or n not in two.variables or not _same(one[n], two[n])]


def prefix_faults(folder: Path, whole, left=None) -> list[str]:
    """What of the series that a run has left, however it ended, is not as in the whole run up to there."""
    if not (folder / "run.mcap").exists():
        return []
    left = load(folder) if left is None else left
    frames = left.sizes.get("time", 0)
    return [f"other values: {name}" for name in different(left, whole.isel(time=slice(frames)))] if frames else []


def _same(a, b) -> bool:
    a, b = a.values, b.values
    return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
