"""Runs and checks a scene: the one module that binds the fluid to `bodies`, `couplers` and `cases`, on first use.

`run` and `check` are the Python side of the command `fsi` (`fsi.command`).
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fsi.errors import RunError, SceneError
from fsi.extras import require
from fsi.record.run_folder import RunFolder, load_run
from fsi.scene.check import scene_warnings
from fsi.scene.check_effect import idle_solids
from fsi.scene.file import load_scene
from fsi.scene.model import Scene


@dataclass(frozen=True)
class Run:
    """A run that has ended: its folder, its status (`done` or `interrupted`) and why, its steps, the simulated and
    the wall time [s]."""

    folder: Path
    status: str
    reason: str
    steps: int
    simulated_seconds: float
    wall_seconds: float

    def load(self):
        """The time series as an `xarray.Dataset`, see `fsi.load_run`."""
        return load_run(self.folder)


def run(
    scene: Scene | str | Path,
    *,
    out: str | Path | None = None,
    until: float | None = None,
    threads: int | None = None,
    overrides: Iterable[str] = (),
    level: str | None = None,
    live: bool = False,
    quiet: bool = False,
) -> Run:
    """Run a scene, a scene file or a built-in scene into the folder `out` (`runs/NAME` if none is given).

    `until` replaces the duration [s], `overrides` and `level` are as in `fsi.load_scene`. Progress and warnings go to stderr.
    `live` shows the timeline in the browser as the run goes on, on this machine only.
    SIGINT and SIGTERM end the run after the step in hand, with status `interrupted`; a second SIGINT ends it at once.
    Raises SceneError where the input is wrong, RunError where the run fails; what was logged stays readable.
    """
    scene, label = _load(scene, overrides, until, level)
    say = _silent if quiet else _say
    bodies, coupler, ground = bind(scene, label)
    warnings = _warnings(scene, bodies, ground, label)
    for line in (*warnings, *(bodies.notes if bodies else ())):
        say(line)
    folder = RunFolder.choose(scene, out)
    from fsi.estimate import check_room
    from fsi.progress import Progress
    from fsi.record.background import open_recorders
    from fsi.simulation.loop import Simulation

    viewer = _viewer() if live else None
    recorders = open_recorders(scene, folder.path, viewer and viewer.sink)
    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, recorders=recorders, threads=threads)
    check_room(scene, bodies, sim.counts["fluid"], folder.path)
    folder.create(scene, threads=sim.threads, particles=sim.counts, scene_warnings=warnings)
    say(f"writing to {folder.path}")
    with (
        _manifest(folder, sim),
        _watched(viewer, say),
        Progress(scene.duration, quiet=quiet) as progress,
        _closing(recorders, sim),
        _interruption(say) as interrupted,
    ):

        def on_step(sim) -> None:
            progress(sim)
            if interrupted.is_set():
                raise KeyboardInterrupt

        sim.run(scene.duration, on_step)
    for line in sim.warnings:
        say(line)
    facts = folder.manifest
    return Run(folder.path, facts["status"], facts["reason"], sim.step_count, sim.time, facts["wall_seconds"])


def check(
    scene: Scene | str | Path,
    *,
    until: float | None = None,
    overrides: Iterable[str] = (),
    level: str | None = None,
    measure: int = 0,
    threads: int | None = None,
) -> dict:
    """What a run of the scene would be: `scene` (resolved), `estimate` (particle counts, memory_bytes, steps,
    seconds), `waves` in figures, `warnings` and `notes`; with `measure`, the estimate comes from so many steps that
    are run and timed (`fsi.estimate.measured`).

    Raises SceneError where the input is wrong, RunError where a measured step fails."""
    scene, label = _load(scene, overrides, until, level)
    bodies, coupler, ground = bind(scene, label)
    from fsi.estimate import estimate, measured
    from fsi.scene.check_waves import wave_summary

    cost = estimate(scene, bodies, ground)
    notes = [*cost.pop("notes"), *(bodies.notes if bodies else ())]
    if measure:
        cost |= measured(scene, measure, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
        cost["seconds"] = cost["seconds_per_step"] * cost["steps"]  # the steps of a fast flow, expected, not measured
    return {
        "scene": scene,
        "estimate": cost,
        "waves": wave_summary(scene),
        "warnings": _warnings(scene, bodies, ground, label),
        "notes": notes,
    }


def validate(
    names: Iterable[str] = (),
    *,
    levels: Iterable[str] = (),
    solvers: Iterable[str] = (),
    out: str | Path | None = None,
    threads: int | None = None,
    jobs: int = 1,
    figures: bool = False,
    quiet: bool = False,
):
    """Run validation cases and keep their rows, plots and VALIDATION.md; see `cases.validation.engine.validate`."""
    from cases.validation.engine.validate import validate as run_all

    say = _silent if quiet else _say
    return run_all(
        tuple(names),
        levels=tuple(levels),
        solvers=tuple(solvers),
        out=out,
        threads=threads,
        jobs=jobs,
        figures=figures,
        say=say,
    )


def bench(*, quick: bool = False, large: bool = False, out: str | Path | None = None, quiet: bool = False):
    """Measure the speed, the memory and the limits of this machine and write BENCHMARK.md; see `cases.bench.run.bench`."""
    from cases.bench.run import bench as run_all

    return run_all(quick=quick, large=large, out=out, say=_silent if quiet else _say)


def sweep(study, **options):
    """Run a parameter study (a file, or a `cases.Study`) and return its dataset; see `cases.study.engine.sweep`."""
    from cases.study.engine import sweep as run_all

    return run_all(study, **options)


def report(directory: str | Path) -> Path:
    """Write the page of the folder of a run or of a study and return its file. Raises SceneError where it holds none."""
    if Path(directory, "run.json").is_file():
        from cases.report.run import report as of_run

        return of_run(directory)
    from cases.study.report import report as of_study

    return of_study(directory)


def _load(
    source: Scene | str | Path, overrides: Iterable[str], until: float | None, level: str | None
) -> tuple[Scene, str]:
    """The scene, and what messages about it call it."""
    overrides = [*overrides, *([] if until is None else [f"duration={until!r}"])]
    scene = load_scene(source, overrides, level)
    return scene, scene.name if isinstance(source, Scene) else Path(source).name


def bind(scene: Scene, label: str) -> tuple:
    """The bodies, the coupler and the ground of a scene, each None where it has none."""
    bodies = coupler = ground = None
    if scene.bodies:
        require("mujoco", "bodies", "a scene with bodies")
        from bodies import load
        from couplers import make

        bodies = load(scene, label)
        coupler = make(scene.coupler, bodies, label)
    if scene.tank.bathymetry:
        require("trimesh", "bodies", "a bathymetry")
        from bodies import mesh_solid

        margin = (scene.layers + 1) * scene.spacing  # ground beyond the walls of the tank is not felt
        low, high = (
            [x + side * margin for x in corner] for corner, side in ((scene.tank.min, -1), (scene.tank.max, 1))
        )
        ground = mesh_solid(scene.tank.bathymetry, scene.dimension, crop=(low, high))
    return bodies, coupler, ground


def _warnings(scene: Scene, bodies, ground, label: str) -> list[str]:
    """What is allowed and likely not meant. Raises SceneError where a whole bathymetry lies beside the tank."""
    try:
        return scene_warnings(scene) + idle_solids(scene, bodies, ground)
    except SceneError as error:
        raise SceneError(error.fault, key=error.key, file=label, fix=error.fix) from None


def _viewer():
    from fsi.record.viewer import WebViewer

    return WebViewer()


@contextmanager
def _watched(viewer, say):
    """The live view, if there is one, as long as the run inside goes on; what it has received stays in the browser."""
    if viewer is None:
        yield
        return
    from fsi.record.viewer import open_browser

    with viewer:
        say(f"live view: {viewer.page}")
        open_browser(viewer.page)
        yield


@contextmanager
def _manifest(folder: RunFolder, sim):
    """Keep `run.json` true, however the run inside ends; an interruption is swallowed, an error passes on."""
    start, status, reason = time.perf_counter(), "failed", ""
    try:
        yield
        status = "done"
    except KeyboardInterrupt:
        status, reason = "interrupted", "stopped by a signal"
    except BaseException as error:
        reason = str(error) or type(error).__name__
        raise
    finally:
        facts = {
            "status": status,
            "reason": reason,
            "steps": sim.step_count,
            "simulated_seconds": sim.time,
            "wall_seconds": time.perf_counter() - start,
            "memory_bytes": sim.memory_bytes,
            "phases": sim.phases,
            "audit": sim.audit(),
            **({"coupling": sim.coupling()} if sim.bodies else {}),
            "warnings": sim.warnings,
            "events": [{"time": e.moment.time, "level": e.level, "text": e.text} for e in sim.events],
        }
        _write(folder, facts)


def _write(folder: RunFolder, facts: dict) -> None:
    try:
        folder.write(**facts)
    except OSError as fault:
        raise RunError(f"{folder.path}/run.json could not be written: {fault.strerror}") from None


@contextmanager
def _closing(recorders: list, sim):
    """Close the streams after a last event that says how the run ended; of two errors the run's own is the one seen."""
    try:
        yield
    except BaseException as error:
        level, text = ("warning", "interrupted") if isinstance(error, KeyboardInterrupt) else ("error", str(error))
        try:
            _close(recorders, sim, level, text)
        except RunError as second:
            _say(str(second))
        raise
    _close(recorders, sim, "info", "done")


def _close(recorders: list, sim, level: str, text: str) -> None:
    try:
        sim.finish(level, text)
    finally:
        for recorder in recorders:
            recorder.end()


@contextmanager
def _interruption(say):
    """An event that SIGINT and SIGTERM set. Outside the main thread signals are left alone."""
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return

    def handle(number, _) -> None:
        event.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        say("stopping after this step; press Ctrl-C again to stop at once")

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield event
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _silent(line: str) -> None:
    pass
