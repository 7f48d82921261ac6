"""One run of a study, in a worker process: claimed by a lock, finished runs reused, leftovers of a kill run again.

The lock belongs to the open file, so that it goes when its process dies, however it dies. A worker of a killed study on
a cluster may still be at a run when the next study comes for it: the next one waits, and takes the result.
"""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cases.study.plan import Measure
from fsi.errors import RunError, SceneError
from fsi.record.files import claimed
from fsi.record.mcap_reader import log_complete
from fsi.scene.model import Scene
from fsi.strict_json import dumps, loads

KEPT = {"inputs"}  # of a run folder that is run again
ROW, LOG = "figures.json", "run.mcap"
WATCH_EVERY = 0.5  # [s]


@dataclass(frozen=True)
class Job:
    """A run to be had: its scene, its folder, what is measured on it, the threads it may take; `again` runs one that
    failed once more; `trust` lets code run that the scene names."""

    scene: Scene
    folder: Path
    measure: Measure
    routine: str | None = None
    threads: int = 1
    again: bool = False
    trust: bool = False


@dataclass
class Outcome:
    """What came of a run: `status` is done, failed or invalid, `figures` key -> (name, value, units, long name, dimension,
    label); `reused` where an earlier run was taken."""

    status: str
    reason: str = ""
    figures: dict[str, tuple] | None = None
    wall_seconds: float = 0.0
    reused: bool = False


def execute(job: Job) -> Outcome:
    """Run the job, or take it from its folder; whatever goes wrong is an outcome, not an error, for one run must not end
    the study."""
    try:
        job.folder.mkdir(parents=True, exist_ok=True)
        with _claimed(job.folder):
            return _outcome(job)
    except Exception as error:
        return Outcome("failed", _reason(error), {})


def _outcome(job: Job) -> Outcome:
    facts = read_facts(job.folder)
    reused = facts.get("status") in ("done", "failed")
    if reused and job.again and (facts["status"] == "failed" or _damage(job, facts)):
        reused = False
    if not reused:
        facts = _run(job)
    outcome = Outcome(facts["status"], facts.get("reason", ""), {}, facts.get("wall_seconds", 0.0), reused)
    if damage := _damage(job, facts):
        outcome.status, outcome.reason = "failed", damage
    elif outcome.status == "done":
        try:
            outcome.figures = _figures(job)
        except Exception as error:
            outcome.status, outcome.reason = "failed", _reason(error)
    return outcome


def _damage(job: Job, facts: dict) -> str:
    """Why a run that says it is done is not; empty where it is."""
    if facts.get("status") != "done" or not job.scene.output.mcap or log_complete(job.folder / LOG):
        return ""
    return f"{job.folder.name}/{LOG} is damaged or incomplete; run it again with --retry"


def _reason(error: Exception) -> str:
    return str(error) if isinstance(error, SceneError | RunError) else f"{type(error).__name__}: {error}"


def read_facts(folder: Path) -> dict:
    """`run.json` of a run folder, empty where there is none."""
    try:
        facts = loads((folder / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return facts if isinstance(facts, dict) else {}


def record_failure(folder: Path, reason: str) -> None:
    """Write down that a run failed whose worker could not say so itself."""
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "run.json", dumps(read_facts(folder) | {"status": "failed", "reason": reason}, indent=2))


def replace(file: Path, text: str) -> None:
    """Write a file in one go, so that it is never half written."""
    new = file.with_name(f"{file.name}.{os.getpid()}.new")
    new.write_text(text, encoding="utf-8")
    os.replace(new, file)


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """Hold the lock of a run folder; wait for whoever has it."""
    with claimed(folder.with_name(folder.name + ".lock"), wait=True):
        yield


def _run(job: Job) -> dict:
    """Go on with the run from its last checkpoint, or run the scene from the start where it has none that can be used."""
    try:
        if not _resumed(job):
            _clear(job.folder)
            from fsi.runner import run

            run(job.scene, out=job.folder, threads=job.threads, trust=job.trust, quiet=True)
    except Exception as error:
        record_failure(job.folder, _reason(error))
    return read_facts(job.folder)


def _resumed(job: Job) -> bool:
    """Whether the folder held an unfinished run that has now come to an end. RunError where that has failed."""
    from fsi.simulation.checkpoint import files

    facts = read_facts(job.folder)
    if facts.get("status") not in ("running", "interrupted", "killed") or not files(job.folder):
        return False
    if facts["status"] == "running":  # by whom the lock was held, who is no more, on whatever machine
        record_failure(job.folder, "its process ended without a word")
    from fsi.resuming import resume

    try:
        resume(job.folder, threads=job.threads, trust=job.trust, quiet=True)
    except SceneError:  # damaged, or of another version
        return False
    return True


def _clear(folder: Path) -> None:
    """Remove what a run has left, but for what it was made from."""
    for left in folder.iterdir():
        if left.name not in KEPT:
            shutil.rmtree(left) if left.is_dir() else left.unlink()


def _figures(job: Job) -> dict[str, tuple]:
    """Figures of a run, kept beside it until something else is measured."""
    key = f"{job.measure.model_dump_json()} {job.routine}"
    file = job.folder / ROW
    try:
        kept = loads(file.read_text(encoding="utf-8"))
        if kept["measure"] == key:
            return {k: tuple(v) for k, v in kept["figures"].items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        pass  # there are none, or damaged ones
    from cases.study.measure import measured

    found = measured(job.folder, job.scene, job.measure, job.routine)
    figures = {f.key: (f.name, f.value, f.units, f.long_name, f.dim, f.label) for f in found}
    replace(file, dumps({"measure": key, "figures": figures}, indent=1))
    return figures


def follow_parent() -> None:
    """End this process when its parent does; the parent of a worker is the study that started it."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_EVERY)
        os._exit(1)

    threading.Thread(target=watch, name="parent watch", daemon=True).start()
