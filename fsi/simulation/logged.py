"""A simulation with a run folder: `run.json` stays true and the streams are closed, however the run ends."""

from __future__ import annotations

import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from fsi.errors import RunError
from fsi.protocols import Event, Recorder
from fsi.record.run_folder import RunFolder
from fsi.simulation.checkpoint import Checkpoints
from fsi.simulation.loop import Simulation
from fsi.simulation.signals import Interruption

BEAT = 2.0  # wall time [s] between the signs of life in `run.json`


def carry_out(
    sim: Simulation,
    folder: RunFolder,
    recorders: list[Recorder],
    until: float,
    on_step: Callable[[Simulation], None],
    say: Callable[[str], None],
) -> int | None:
    """Run a simulation to `until` [s] in its folder, with checkpoints; the signal that ended it before, None if none did.
    Raises RunError where it fails."""
    interruption = Interruption(say, lambda name: _leave(sim, folder, recorders, f"stopped by {name} within a step"))
    if sim.ranks:
        sim.ranks.watch.leave = lambda text: _leave(sim, folder, recorders, text, "failed")
    told: list[str] = []
    with interruption, logged(sim, folder, recorders, say) as checkpoints:

        def step(sim: Simulation) -> None:
            on_step(sim)
            _tell_heard(sim)
            if folder.fault and not told:
                fault = f"{folder.path} can no longer be written: {folder.fault}"
                if not goes_on(sim):
                    raise RunError(fault)
                told.append(fault)
                sim.report("warning", f"{fault}; the run goes on all the same")
            due = checkpoints is not None and checkpoints.due
            if sim.ranks:
                interruption.number, due = sim.ranks.agreed(interruption.number, due)
            if checkpoints and (due or interruption.number is not None):
                checkpoints.take()
            interruption.check()

        sim.run(until, step)
    return interruption.number


@contextmanager
def logged(
    sim: Simulation, folder: RunFolder, recorders: list[Recorder], say: Callable[[str], None] = lambda line: None
) -> Iterator[Checkpoints | None]:
    """Keep the folder of the run inside, with a heartbeat in `run.json`; an interruption (KeyboardInterrupt) is swallowed, an
    error passes on. Of two errors the run's own is the one raised, the other one is said. Gives what writes checkpoints,
    None where the scene wants none. Raises RunError where something could not be written."""
    every = sim.scene.output.checkpoint
    checkpoints = Checkpoints(sim, folder.path, every, say) if every else None
    with _manifest(folder, sim, checkpoints, say), _heartbeat(folder), _listening():
        try:
            with _closing(recorders, sim, say):
                yield checkpoints
        finally:
            if checkpoints:
                checkpoints.close()


def _leave(
    sim: Simulation, folder: RunFolder, recorders: list[Recorder], reason: str, status: str = "interrupted"
) -> None:
    """Complete the log and `run.json` from another thread, while the step in hand goes on, and will not be waited for."""
    event = Event(sim.now, "warning" if status == "interrupted" else "error", reason)
    for recorder in recorders:
        with suppress(Exception):  # the run may be closing it just now
            recorder.event(event)
            recorder.end()
    facts = {"steps": sim.step_count, "simulated_seconds": sim.time, "wall_seconds": sim.now.wall_time}
    folder.write(status=status, reason=reason, **facts)


OWN = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)  # for developers
_heard: deque[str] = deque(maxlen=100)  # Python's warnings belong to the process, and so does this


@contextmanager
def _listening() -> Iterator[None]:
    """Keep what libraries (numba, MuJoCo, NumPy) warn of, on whatever thread, for the log of the run."""
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message, category, *place, **options) -> None:
            shown(message, category, *place, **options)
            if not issubclass(category, OWN):
                _heard.append(f"{category.__name__}: {' '.join(str(message).split())}")

        warnings.showwarning = show
        yield


def _tell_heard(sim: Simulation) -> None:
    while _heard:
        sim.report("warning", _heard.popleft())
    for recorder in sim.recorders:
        if hasattr(recorder, "new_fault") and (fault := recorder.new_fault()):
            sim.report("warning", fault)


def goes_on(sim: Simulation) -> bool:
    """Whether the run goes on where its logs cannot be written."""
    return sim.scene.output.on_failure == "continue"


@contextmanager
def _heartbeat(folder: RunFolder) -> Iterator[None]:
    """Renew the time in `run.json` every `BEAT` seconds."""
    over = threading.Event()

    def beat() -> None:
        while not over.wait(BEAT):
            folder.beat()

    thread = threading.Thread(target=beat, name="heartbeat", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@contextmanager
def _manifest(
    folder: RunFolder, sim: Simulation, checkpoints: Checkpoints | None, say: Callable[[str], None]
) -> Iterator[None]:
    status, reason = "failed", ""
    try:
        yield
        status = "done"
    except KeyboardInterrupt as signal:
        status, reason = "interrupted", f"stopped by {signal}" if str(signal) else "stopped by a signal"
    except BaseException as error:
        reason = str(error) or type(error).__name__
        raise
    finally:
        facts = {"status": status, "reason": reason, "wall_seconds": sim.now.wall_time, **outcome(sim)}
        if checkpoints:
            facts["checkpoints"] = {"seconds": checkpoints.seconds, "bytes": checkpoints.bytes}
        try:
            folder.write(**facts)
        except OSError as fault:
            text = f"{folder.path}/run.json could not be written: {fault.strerror}"
            if status != "failed" and not goes_on(sim):
                raise RunError(text) from None
            say(text)  # the run's own error is the one raised


def outcome(sim: Simulation) -> dict:
    """What `run.json` says of a simulation so far."""
    return {
        "steps": sim.step_count,
        "simulated_seconds": sim.time,
        "memory_bytes": sim.memory_bytes,
        "phases": dict(sim.phases),
        "audit": sim.audit(),
        **({"coupling": sim.coupling()} if sim.bodies else {}),
        **({"ranks": sim.ranks.facts(sim.step_count)} if sim.ranks else {}),
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
        _tell_heard(sim)
        sim.finish(level, text)
    finally:
        for recorder in recorders:
            recorder.end()
        _tell_heard(sim)
