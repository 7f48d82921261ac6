"""Processor time to equal error, beside another code: whole runs of cases of `fsi validate`, without starting and compiling.

DualSPHysics 5.4 on one thread of such a machine, measured 2026-11-28 while it was busy: factors are to be trusted, digits are
not. Built with -O3 -ffast-math -march=native; Verlet or symplectic, artificial viscosity 0.01, h = 1.41 dp unless said. Its
standing wave and its waves were of its own tanks, as high in spacings as they are here.
"""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from cases.validation.engine.registry import load
from fsi.errors import RunError
from fsi.scene.binding import bind
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


@dataclass(frozen=True)
class Trial:
    """A case, the error that counts and its spacings [m]; `peer`: what the other code ran, its error and processor time [s]."""

    case: str
    error: str
    spacings: tuple[float, ...]
    peer: tuple[tuple[str, float, float], ...]
    made: float | None = None  # spacing that the scene is made with, of a case from a file with levels of its own


TRIALS = {
    "dam front, rms of the curve": Trial(
        "dam_front", "front_curve", (0.05715 / 8, 0.05715 / 20), (("a / 10", 0.046, 1.6), ("a / 20", 0.016, 11.6)),
        made=0.05715 / 20,
    ),
    "still water 5 s, pressure": Trial(
        "still_water", "pressure_l2", (0.05, 0.025), (("50 mm, mDBC", 0.087, 2.5), ("25 mm, mDBC", 0.015, 20.4))
    ),
    "standing wave, loss a period": Trial(
        "standing_wave", "energy_loss", (0.02, 0.01), (("50 mm, h = 2 dp", 0.142, 4.8), ("25 mm, h = 2 dp", 0.099, 30.7))
    ),
    "heave decay of a box, amplitude": Trial("decay_heave_2d", "amplitude", (0.05, 0.025), (("25 mm, DBC", -0.26, 26.0),)),
    "wave train, loss of height": Trial(
        "wave_decay", "height_loss", (0.1 / 3, 0.1 / 5), (("3 spacings high, h = 2 dp", 0.187, 126.0),)
    ),
}  # fmt: skip


def equal_error(trials: dict[str, Trial]) -> list[dict]:
    """One row a spacing: error, steps and processor time [s] here, and the other code's best error with its time;
    `times_less` is its time over ours, where our error is no larger."""
    rows = []
    for name, trial in trials.items():
        setup, error, seconds = min(trial.peer, key=lambda run: abs(run[1]))
        for spacing in trial.spacings:
            row = {"case": name, "spacing": spacing} | timed(trial, spacing)
            row |= {"peer": setup, "peer_error": error, "peer_s": seconds}
            better = row["error"] is not None and abs(row["error"]) <= abs(error)
            rows.append(row | {"times_less": seconds / row["processor_s"] if better else None})
    return rows


def timed(trial: Trial, spacing: float) -> dict:
    """Error (None where the run failed), steps and processor time [s] of a case at a spacing on one thread, after the first
    step."""
    case = load(trial.case)
    with tempfile.TemporaryDirectory() as folder:
        data = case.scene(trial.made or spacing, Path(folder)) | {"name": case.name, "spacing": spacing}
        scene = Scene.model_validate(data, context={"folder": Path(folder)})
        bodies, coupler, ground = bind(scene, case.name)
        sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=1)
    measure, spent, began = case.measure(sim), 0.0, None

    def watch(sim) -> None:
        nonlocal spent, began
        spent += 0.0 if began is None else time.process_time() - began
        measure(sim)
        began = time.process_time()

    try:
        sim.run(on_step=watch)
        error = measure.errors()[trial.error]
    except RunError:
        error = math.nan
    finally:
        sim.team.close()
    return {"error": float(error) if math.isfinite(error) else None, "steps": sim.step_count, "processor_s": spent}
