"""The figures that a study takes from one of its runs."""

from __future__ import annotations

from pathlib import Path

from cases.report import wave_figures
from cases.report.wave_figures import Figure
from cases.study.decay import decay_figures
from cases.study.plan import Measure
from cases.study.radiation import radiation_figures
from fsi.record.dataset import load_run
from fsi.record.manifest import read_manifest
from fsi.scene.model import Scene


def measured(folder: Path, scene: Scene, measure: Measure, routine: str | None = None) -> list[Figure]:
    """Figures of the run in `folder`; a free decay is measured from its start, anything else in settled waves.
    Raises SceneError where the run is too short for them."""
    data = load_run(folder)
    facts = read_manifest(folder)
    cost = Figure("wall_seconds", float(facts["wall_seconds"]), "s", "wall time of the run")
    if routine == "free_decay":
        return [*decay_figures(data, measure.decay_joint, measure.start or 0.0), cost]
    if routine == "radiation":
        return [*radiation_figures(data, scene, measure.start), cost]
    found = wave_figures.figures(data, scene, start=measure.start, device_width=measure.device_width)
    lost = Figure("lost_particles", float(data.lost_particles[-1]), "1", "particles that left the tank")
    measured_for = Figure(
        "measured_seconds", wave_figures.measured_seconds(data, scene, measure.start), "s", "measured time"
    )
    return [*found, measured_for, lost, cost, *(_implicit(facts) if scene.numerics.solver == "iisph" else ())]


def _implicit(facts: dict) -> list[Figure]:
    """What a run with the solver `iisph` cost, from its manifest: its parameters trade these for one another."""
    steps, phases, sweeps = facts["steps"], facts["phases"], facts["audit"]["pressure_sweeps"]
    return [
        Figure("pressure_iterations", sweeps / 2 / max(steps, 1), "1", "pressure iterations in a step"),
        Figure("time_step_mean", facts["simulated_seconds"] / max(steps, 1), "s", "time step"),
        Figure("pressure_seconds", phases.get("pressure", 0.0), "s", "wall time of the pressure"),
        Figure("search_seconds", phases.get("neighbours", 0.0), "s", "wall time of sorting and search"),
        Figure("memory_mb", facts["memory_bytes"] / 1e6, "MB", "memory of the particle arrays"),
    ]
