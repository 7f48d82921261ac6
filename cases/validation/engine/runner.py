"""Runs a case at one level with one solver, and measures it."""

from __future__ import annotations

import math
import tempfile
import time as clock
from collections.abc import Callable
from pathlib import Path

from cases.validation.engine.case import Case, Measure, Row, met
from cases.validation.engine.solvers import SOLVERS
from fsi.errors import RunError
from fsi.scene.binding import bind
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


class Stopwatch:
    """Hands each step on to a measure, and times the steps alone, by the clock `now` [s]: without the first one, which
    compiles, and without the measuring."""

    def __init__(self, measure: Measure, now: Callable[[], float] = clock.perf_counter):
        self.measure, self.seconds, self.particle_steps, self.resumed = measure, 0.0, 0, None
        self._now = now

    def __call__(self, sim) -> None:
        if self.resumed is not None:
            self.seconds += self._now() - self.resumed
        self.particle_steps += sim.fluid.count
        self.measure(sim)
        self.resumed = self._now()


def scene_of(case: Case, level: str, solver: str, folder: Path) -> Scene:
    """The scene of a case; its files are in `folder`, and nothing is logged. Where the case and the solver
    set the same numerics, the solver's hold."""
    data = case.scene(case.spacing[level], folder)
    extra = {"name": case.name, "spacing": case.spacing[level]}
    numerics = data.get("numerics", {})
    plain = Scene.model_validate(data | extra, context={"folder": folder})
    changed = {key: value(plain) if callable(value) else value for key, value in SOLVERS[solver].items()}
    return load_scene(Scene.model_validate(data | extra | {"numerics": numerics | changed}, context={"folder": folder}))


def _read(case: Case, measure: Measure) -> dict[str, float]:
    """The errors of a measure, nan where it has not met what it measures (bodies that never touched). Raises RunError where
    the run gave nothing that it can be read from: nothing moved, say."""
    try:
        return dict.fromkeys(case.target, math.nan) | measure.errors()
    except (ArithmeticError, ValueError, IndexError) as fault:  # those of numpy's linear algebra are ValueErrors
        raise RunError(f"the run ended, and its errors cannot be read ({fault})") from fault


def run_case(
    case: Case, level: str, solver: str, threads: int | None = None, figures: Path | None = None
) -> tuple[Row, str]:
    """The row of one run, and why it failed ("" where it did not); its page is written into the folder `figures`.
    Raises SceneError where the scene is wrong."""
    if case.run:
        return case.run(case, level, solver, threads, figures)
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_of(case, level, solver, Path(folder))
        bodies, coupler, ground = bind(scene, case.name)
        sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
    particles = sim.fluid.count
    measure = case.measure(sim)
    watch, reason = Stopwatch(measure), ""
    try:
        sim.run(on_step=watch)
        error = {name: float(value) if math.isfinite(value) else None for name, value in _read(case, measure).items()}
    except RunError as fault:
        error, reason = dict.fromkeys(case.target), str(fault)
    finally:
        sim.team.close()
    row = Row(
        case=case.name,
        level=level,
        solver=solver,
        spacing=scene.spacing,
        dimension=scene.dimension,
        particles=particles,
        steps=sim.step_count,
        particle_steps=watch.particle_steps,
        time_step=sim.time / max(sim.step_count, 1),
        wall_seconds=watch.seconds,
        simulated_seconds=sim.time,
        memory_bytes=sim.memory_bytes,
        error=error,
        target=dict(case.target),
        passed=all(met(error[name], target) for name, target in case.target.items()),
    )
    if figures and not reason:
        from cases.validation.engine.pictures import write_page

        write_page(case, row, {"": measure}, figures)
    return row, reason
