"""Runs and checks a scene; studies, validation, reports and benchmarks come from the packages that register them.

`run` and `check` are the Python side of the command `fsi` (`fsi.command`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fsi import garbage
from fsi.errors import SceneError
from fsi.messages import Messages
from fsi.plugins import function
from fsi.record.dataset import load_run
from fsi.record.run_folder import RunFolder
from fsi.scene.binding import bind
from fsi.scene.check import scene_warnings
from fsi.scene.check_effect import idle_solids, no_timeline
from fsi.scene.check_floating import afloat, narrow, slowed
from fsi.scene.check_waves import bed_at_piston
from fsi.scene.file import load_scene, namesakes, scene_folder
from fsi.scene.model import Scene
from fsi.scene.paths import outside_notes
from fsi.trust import checking, trusting

if TYPE_CHECKING:
    from xarray import Dataset

    from fsi.protocols import Controller
    from fsi.simulation.view import View


STARTED = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")  # how many processes were started together


@dataclass(frozen=True)
class Run:
    """A run that has ended: its folder, its status (`done` or `interrupted`) and why, its steps, the simulated and
    the wall time [s], and the particles that it lost."""

    folder: Path
    status: str
    reason: str
    steps: int
    simulated_seconds: float
    wall_seconds: float
    lost_particles: int = 0
    exit_code: int = 0  # of the command

    def load(self) -> Dataset:
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
    trust: bool = False,
    quiet: bool = False,
    on_step: Callable[[View], None] | None = None,
    controller: Controller | None = None,
    control_interval: float | None = None,
    viewer: Literal["mujoco"] | None = None,
    ranks: Any = None,
) -> Run:
    """Run a scene, a scene file or a built-in scene into the folder `out` (`runs/NAME` if none is given).

    `until` replaces the duration [s], `overrides` and `level` are as in `fsi.load_scene`. Progress and warnings go to stderr.
    `live` shows the timeline in the browser as the run goes on, `viewer="mujoco"` the bodies in MuJoCo's own viewer, both on
    this machine only. `trust` lets the Python code run that the scene names (`fsi.trust`). `on_step` is called after each step
    with the run as it stands (`fsi.simulation.view.View`); `controller` before every step, or every `control_interval` seconds,
    and may set `data.ctrl` (`fsi.protocols.Controller`). `ranks`: this process as one of several that
    the run is shared among (`joined`).
    SIGINT, SIGTERM, SIGHUP, SIGXCPU and SIGUSR1 end the run after the step in hand, within 2 s, with status `interrupted` and
    a checkpoint for `fsi.resume`; a second SIGINT ends it at once.
    Raises SceneError where the input is wrong, RunError where the run fails; what was logged stays readable.
    """
    source, (scene, label) = scene, _load(scene, overrides, until, level)
    say = Messages(quiet)
    with trusting(trust):
        bodies, coupler, ground = bind(scene, label)
    warnings = _warnings(scene, bodies, ground, label)
    for line in (*warnings, *(bodies.notes if bodies else ()), *_outside(scene, source, bodies)):
        say(line)
    from fsi.estimate import check_room
    from fsi.record.background import open_recorders
    from fsi.simulation.loop import Simulation

    taken = ranks.folder(RunFolder.choose, scene, out) if ranks else RunFolder.choose(scene, out)
    first = ranks is None or ranks.root
    with taken as folder, _window(bodies) if viewer and first else nullcontext() as window:
        web = _viewer() if live and first else None
        recorders = opened(ranks, open_recorders, scene, folder.path, web and web.sink)
        parts = {"bodies": bodies, "coupler": coupler, "ground": ground, "recorders": recorders}
        with trusting(trust):
            sim = Simulation(scene, **parts, threads=ranks.threads(threads) if ranks else threads, ranks=ranks)
        if controller is not None:
            sim.steer(controller, control_interval)
        check_room(scene, bodies, sim.counts["fluid"], folder.path)
        folder.create(scene, threads=sim.threads, particles=sim.counts, scene_warnings=warnings)
        say(f"writing to {folder.path}")
        return finish(sim, folder, recorders, scene.duration, say, web, quiet, _watching(sim, window, on_step))


def together() -> int | None:
    """How many processes were started with this one, as the environment says; None where it says nothing."""
    return next((int(os.environ[name]) for name in STARTED if os.environ.get(name, "").isdigit()), None)


@contextmanager
def joined(shape: str | None = None) -> Iterator[Any]:
    """This process as one of several that a run is shared among, arranged as `shape`, such as 4x1x1 (chosen if not given), for
    `run` and `resume`; None where `mpiexec` has not started several, or asks for none."""
    started = together()
    if shape is None and (started or 1) == 1:
        yield None
        return
    from fsi.ranks.start import join

    ranks = join(shape, started)
    with ranks.watch.over():
        yield ranks


def opened(ranks, open_recorders, *arguments) -> list:
    """The recorders of a run, of which the first of several processes alone writes."""
    return ranks.recorders(lambda: open_recorders(*arguments)) if ranks else open_recorders(*arguments)


def finish(
    sim, folder: RunFolder, recorders: list, until: float, say: Messages, viewer=None, quiet: bool = False, watch=None
) -> Run:
    """Run a simulation to `until` [s] in its folder, with a line of progress; `watch` is called with it after each step."""
    from fsi.progress import Progress
    from fsi.simulation.logged import carry_out
    from fsi.simulation.signals import exit_code

    told: list[str] = [
        event.text for event in sim.events
    ]  # texts of the events so far, whose warnings are said at once
    with _watched(viewer, say), Progress(until, say, quiet=quiet) as progress:

        def on_step(sim) -> None:
            progress(sim)
            if watch:
                watch(sim)
            if fault := say.new_fault():
                sim.report("warning", f"messages are lost: {fault}")
            for event in sim.events[len(told) :]:
                told.append(event.text)
                if event.level == "warning":
                    say(event.text)

        garbage.resume()
        number = carry_out(sim, folder, recorders, until, on_step, say)
    for line in sim.warnings:
        if line not in told:
            say(line)
    facts = folder.manifest
    code = exit_code(number) if facts["status"] == "interrupted" else 0
    lost = facts["audit"].get("lost_particles", 0)
    wall = facts["wall_seconds"]
    return Run(folder.path, facts["status"], facts["reason"], sim.step_count, sim.time, wall, lost, code)


def check(
    scene: Scene | str | Path,
    *,
    until: float | None = None,
    overrides: Iterable[str] = (),
    level: str | None = None,
    measure: int = 0,
    periods: bool = False,
    threads: int | None = None,
    ranks: str | None = None,
) -> dict[str, Any]:
    """What a run of the scene would be, found without running code that it names: `scene` (resolved), `estimate` (particle
    counts, memory_bytes, steps, seconds), `waves` in figures, `hydrostatics` of the bodies
    (`fsi.protocols.BodySet.hydrostatics`), `warnings` and `notes`; with `measure`, the estimate comes from so many steps that
    are run and timed (`fsi.estimate.measured`), with `periods` there are `natural_periods` (`fsi.periods`), with `ranks`, such
    as 4x1x1, what each of the processes arranged so would have to do (`fsi.estimate.shared`).

    Raises SceneError where the input is wrong, RunError where a measured step fails."""
    source, (scene, label) = scene, _load(scene, overrides, until, level)
    with checking():
        bodies, coupler, ground = bind(scene, label)
        if scene.control:
            from fsi.simulation.control import controller_of

            controller_of(scene, label)
    floats = bodies.hydrostatics() if bodies else {}  # before the bodies are moved
    from fsi.estimate import checkpoint_cost, estimate, measured, shared
    from fsi.scene.check_sea import sea_summary
    from fsi.scene.check_waves import wave_summary

    cost = estimate(scene, bodies, ground)
    notes = [*cost.pop("notes"), *(bodies.notes if bodies else ()), *_outside(scene, source, bodies)]
    if scene.control:
        notes.append(f"control: {scene.control.function.name} is not run by a check")
    cost |= checkpoint_cost(scene, cost)
    if measure:
        with checking():
            cost |= measured(scene, measure, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
        cost["seconds"] = cost["seconds_per_step"] * cost["steps"]  # the steps of a fast flow, expected, not measured
    if periods:
        from fsi.periods import natural_periods

        natural = natural_periods(scene, label)
    return {
        "scene": scene,
        "estimate": cost,
        "waves": wave_summary(scene) + sea_summary(scene),
        "hydrostatics": floats,
        **({"natural_periods": natural} if periods else {}),
        "warnings": _warnings(scene, bodies, ground, label) + afloat(scene, floats) + narrow(scene, bodies, ground),
        "notes": notes,
        **({"ranks": shared(scene, ranks, bodies, ground)} if ranks else {}),
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
    trust: bool = False,
    quiet: bool = False,
) -> Any:
    """Run validation cases and keep their rows, plots and VALIDATION.md; see `cases.validation.engine.validate`."""
    options = {"out": out, "threads": threads, "jobs": jobs, "figures": figures, "say": Messages(quiet)}
    with trusting(trust):
        return function("validate")(tuple(names), levels=tuple(levels), solvers=tuple(solvers), **options)


def bench(
    *,
    quick: bool = False,
    large: bool = False,
    only_users: bool = False,
    against: str | Path | None = None,
    out: str | Path | None = None,
    quiet: bool = False,
) -> Any:
    """Measure the speed, the memory and the limits of this machine and write BENCHMARK.md; see `cases.bench.run.bench`."""
    options = {"only_users": only_users, "against": against}
    return function("bench")(quick=quick, large=large, out=out, say=Messages(quiet), **options)


def sweep(study: Any, **options: Any) -> Any:
    """Run a parameter study (a file, or a `cases.Study`) and return its dataset; see `cases.study.engine.sweep`."""
    return function("sweep")(study, **options)


def report(*directories: str | Path, **options: Any) -> Path:
    """Write the page of the folder of a run or of a study, or one that compares several, and return its file; options are
    those of `cases.pages.report`. Raises SceneError where a folder holds none."""
    page: Path = function("report")(*directories, **options)
    return page


def _load(
    source: Scene | str | Path, overrides: Iterable[str], until: float | None, level: str | None
) -> tuple[Scene, str]:
    """The scene, and what messages about it call it."""
    overrides = [*overrides, *([] if until is None else [f"duration={until!r}"])]
    scene = load_scene(source, overrides, level)
    return scene, scene.name if isinstance(source, Scene) else Path(source).name


def _outside(scene: Scene, source: Scene | str | Path, bodies) -> list[str]:
    """Notes on which file is the scene, and on those outside its folder; a scene that was made in Python has none."""
    if isinstance(source, Scene):
        return []
    return namesakes(source) + outside_notes(scene, scene_folder(source), getattr(bodies, "files", ()))


def _warnings(scene: Scene, bodies, ground, label: str) -> list[str]:
    """What is allowed and likely not meant. Raises SceneError where a whole bathymetry lies beside the tank."""
    try:
        told = scene_warnings(scene) + bed_at_piston(scene, ground)
        told += slowed(scene, bodies)
        return told + idle_solids(scene, bodies, ground) + no_timeline(scene)
    except SceneError as error:
        raise SceneError(error.fault, key=error.key, file=label, fix=error.fix) from None


def _window(bodies):
    """MuJoCo's own viewer. Raises SceneError where it cannot be opened."""
    if bodies is None:
        raise SceneError("MuJoCo's viewer shows bodies, and the scene has none", key="--viewer", fix="use --live")
    return function("mujoco_viewer")(bodies)


def _watching(sim, window, on_step):
    """What is called after each step, None where nothing is."""
    if not window and not on_step:
        return None
    from fsi.simulation.view import View

    view = View(sim)

    def watch(sim) -> None:
        if on_step:
            view.refresh()
            on_step(view)
            view.settle()
        if window:
            window.show(sim)

    return watch


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
