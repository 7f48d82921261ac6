"""A simulation with a run folder: `run.json` stays true and the streams are closed, however the run ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fsi.errors import RunError
from fsi.protocols import Recorder
from fsi.record.run_folder import RunFolder
from fsi.simulation.loop import Simulation


@contextmanager
def logged(
    sim: Simulation, folder: RunFolder, recorders: list[Recorder], say: Callable[[str], None] = lambda line: None
) -> Iterator[None]:
    """Keep the folder of the run inside; an interruption (KeyboardInterrupt) is swallowed, an error passes on. Of two errors
    the run's own is the one raised, the other one is said. Raises RunError where something could not be written."""
    with _manifest(folder, sim), _closing(recorders, sim, say):
        yield


@contextmanager
def _manifest(folder: RunFolder, sim: Simulation) -> Iterator[None]:
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
        facts = {"status": status, "reason": reason, "wall_seconds": time.perf_counter() - start, **outcome(sim)}
        try:
            folder.write(**facts)
        except OSError as fault:
            raise RunError(f"{folder.path}/run.json could not be written: {fault.strerror}") from None


def outcome(sim: Simulation) -> dict:
    """What `run.json` says of a simulation so far."""
    return {
        "steps": sim.step_count,
        "simulated_seconds": sim.time,
        "memory_bytes": sim.memory_bytes,
        "phases": dict(sim.phases),
        "audit": sim.audit(),
        **({"coupling": sim.coupling()} if sim.bodies else {}),
        "warnings": sim.warnings,
        "events": [{"time": e.moment.time, "level": e.level, "text": e.text} for e in sim.events],
    }


@contextmanager
def _closing(recorders: list[Recorder], sim: Simulation, say: Callable[[str], None]) -> Iterator[None]:
    """Close the streams after a last event that says how the run ended."""
    try:
        yield
    except BaseException as error:
        level, text = ("warning", "interrupted") if isinstance(error, KeyboardInterrupt) else ("error", str(error))
        try:
            _close(recorders, sim, level, text)
        except RunError as second:
            say(str(second))
        raise
    _close(recorders, sim, "info", "done")


def _close(recorders: list[Recorder], sim: Simulation, level: str, text: str) -> None:
    try:
        sim.finish(level, text)
    finally:
        for recorder in recorders:
            recorder.end()
