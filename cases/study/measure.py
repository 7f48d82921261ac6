"""The figures that a study takes from one of its runs."""

from __future__ import annotations

from pathlib import Path

from cases.report import wave_figures
from cases.report.wave_figures import Figure
from cases.study.decay import decay_figures
from cases.study.plan import Measure
from cases.study.radiation import radiation_figures
from fsi.record.run_folder import load_run, read_manifest
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
    return [*found, measured_for, lost, cost]
