"""Cases whose errors compare several runs: each variant of a scene is run and measured, and a judge tells the errors."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cases.validation.engine.case import Case, Measure, Row, met
from cases.validation.engine.runner import Stopwatch, scene_of
from fsi.errors import RunError
from fsi.scene.binding import bind
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

Variants = Callable[[float, Path], Mapping[str, dict]]  # spacing [m], folder -> plain scenes by name
Judge = Callable[[Mapping[str, Any]], dict[str, float]]  # measures by name of the variant -> errors


def variant_scene(case: Case, data: dict, level: str, solver: str, folder: Path) -> Scene:
    """The scene of one variant, as plain data, at the level's spacing where it has none of its own."""
    spacing = {level: data.get("spacing", case.spacing[level])}
    return scene_of(Case(case.name, "", "", spacing, lambda spacing, folder: data, None, {}), level, solver, folder)


def runs(variants: Variants, measure: type[Measure], judge: Judge) -> Callable[..., tuple[Row, str]]:
    """The `run` of such a `Case`; the row adds all runs up, and its page shows what each of them draws."""

    def run(case: Case, level: str, solver: str, threads: int | None = None, figures: Path | None = None) -> tuple[Row, str]:
        seen: dict[str, Measure] = {}
        sims, watches, reason = [], [], ""
        with tempfile.TemporaryDirectory() as folder:
            try:
                for name, data in variants(case.spacing[level], Path(folder)).items():
                    scene = variant_scene(case, data, level, solver, Path(folder))
                    bodies, coupler, ground = bind(scene, f"{case.name}, {name}")
                    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
                    sims.append(sim)
                    seen[name] = measure(sim)
                    watches.append(Stopwatch(seen[name]))
                    sim.run(on_step=watches[-1])
                    sim.team.close()
                found = judge(seen)
                error = {name: float(value) if math.isfinite(value) else None for name, value in found.items()}
            except RunError as fault:
                error, reason = dict.fromkeys(case.target), str(fault)
        steps = sum(sim.step_count for sim in sims)
        time = sum(sim.time for sim in sims)
        row = Row(
            case=case.name, level=level, solver=solver, spacing=case.spacing[level], dimension=sims[0].scene.dimension,
            particles=max(sim.fluid.count for sim in sims), steps=steps,
            particle_steps=sum(watch.particle_steps for watch in watches), time_step=time / max(steps, 1),
            wall_seconds=sum(watch.seconds for watch in watches), simulated_seconds=time,
            memory_bytes=max(sim.memory_bytes for sim in sims), error=error, target=dict(case.target),
            passed=all(met(error[name], target) for name, target in case.target.items()),
        )  # fmt: skip
        if figures and not reason:
            from cases.validation.engine.pictures import write_page

            write_page(case, row, seen, figures)
        return row, reason

    return run
