"""Recording beside the computation: frames are copied into a bounded queue that one thread writes out."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from queue import Empty, Queue
from threading import Lock, Thread

import numpy as np

from fsi.errors import RunError, SceneError
from fsi.extras import installed
from fsi.protocols import BodySet, Event, Frame, Recorder
from fsi.record.fields import fraction, thinned
from fsi.record.files import FULL
from fsi.scene.model import Scene

QUEUE_LENGTH = 8  # batches; the run waits for the writer beyond it, so that memory stays bounded
TICK = 0.25  # wall time [s] between the looks for what has waited
BATCH, BATCH_SECONDS = 32, 0.25  # frames, wall time [s]: every hand-over may cost the run a change of threads


def open_recorders(scene: Scene, folder: Path, live: str | None = None, log: dict | None = None) -> list[Recorder]:
    """Recorders of the streams that the scene asks for; the packages of the others are not imported. A run that has another
    stream goes on without a timeline where its package is not installed, unless the timeline is looked at, or was begun.
    `live`: address of a viewer that the timeline is sent to as well; `log`: positions in the files of the folder, from
    which on they go on (`Background.mark`)."""
    log = log or {}
    if live and not scene.output.timeline:
        raise SceneError("the live view shows the timeline", key="output.timeline", fix="set it to true")
    streams: list[Recorder] = []
    if scene.output.mcap:
        from fsi.record.clock import NAME, ClockRecorder
        from fsi.record.mcap import McapRecorder

        streams.append(McapRecorder(folder / "run.mcap", log.get("messages")))
        streams.append(ClockRecorder(folder / NAME, log.get("clock")))
    if scene.output.timeline and (installed("rerun") or live or log.get("timeline") or not streams):
        from fsi.record.timeline import TimelineRecorder

        streams.append(TimelineRecorder(folder / "run.rrd", live, log.get("timeline")))
    return [Background(streams, go_on=scene.output.on_failure == "continue")] if streams else []


class Background:
    """A recorder that passes copies of all it sees to other recorders, on a thread of its own.

    What goes wrong there is raised as RunError at the next call, at the latest by `end`; with `go_on`, the recorder that it
    went wrong in is left out from then on, and `new_fault` says so.
    """

    def __init__(self, recorders: list[Recorder], go_on: bool = False):
        self._recorders, self._go_on = recorders, go_on
        self._failed: dict[Recorder, str] = {}
        self._told = 0
        self._queue: Queue = Queue(QUEUE_LENGTH)
        self._thread: Thread | None = None
        self._fault: Exception | None = None
        self._batch: list[Frame] = []
        self._handed = clock.monotonic()
        self._lock = Lock()  # of the batch

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        """Open the streams here and now: the bodies' meshes must not be read while MuJoCo steps. Once only (RuntimeError):
        two writers would share one queue."""
        if self._thread:
            raise RuntimeError("this recorder has begun already")
        for recorder in self._recorders:
            try:
                recorder.begin(scene, bodies)
            except (OSError, RuntimeError) as fault:  # the second is rerun's
                self._give_up(recorder, fault)
                self._raise()
        self._scene, self._fraction = scene, None
        self._thread = Thread(target=self._write, name="recorder", daemon=True)
        self._thread.start()

    def series(self, frame: Frame) -> None:
        series = {name: np.array(value, np.float64) for name, value in frame.series.items()}
        with self._lock:
            self._batch.append(Frame(frame.time, frame.step, frame.wall_time, series))
        if len(self._batch) >= BATCH or clock.monotonic() - self._handed > BATCH_SECONDS:
            self._hand_over_batch()

    def particles(self, frame: Frame) -> None:
        """Hand over the share of the particles that is drawn."""
        if self._fraction is None:
            self._fraction = fraction(self._scene, len(frame.position))
        self._hand_over("particles", _copy(thinned(frame, self._fraction)))

    def event(self, event: Event) -> None:
        self._hand_over("event", event)

    def mark(self, arrived: Callable[[dict], None]) -> None:
        """Call `arrived` with the positions in the files (messages of the log, bytes of the timeline) once all that was
        handed over before is on the disk."""
        self._hand_over("mark", arrived)

    def end(self) -> None:
        """Write out what is queued and close the streams; a second call does nothing."""
        if self._thread:
            if self._batch and not self._fault:
                self._hand_over_batch()
            self._queue.put(None)
            self._thread.join()
            self._thread = None
            self._raise()

    def _hand_over(self, method: str, *arguments) -> None:
        if self._batch:
            self._hand_over_batch()
        self._raise()
        self._queue.put([(method, arguments)])

    def _hand_over_batch(self) -> None:
        self._raise()
        self._queue.put([("series", (frame,)) for frame in self._taken()])

    def _taken(self) -> list[Frame]:
        with self._lock:
            batch, self._batch, self._handed = self._batch, [], clock.monotonic()
        return batch

    def _raise(self) -> None:
        if self._fault:
            raise _run_error(self._fault) from self._fault

    def new_fault(self) -> str:
        """What has gone wrong since the last call, where the run goes on all the same; empty where nothing has."""
        faults = list(self._failed.values())[self._told :]
        self._told += len(faults)
        return "; ".join(faults)

    def _write(self) -> None:
        ticked = clock.monotonic()
        while (jobs := self._next()) is not None:
            for method, arguments in jobs:
                if method == "mark":
                    self._pass_on("tick")  # what comes now may take a while
                    self._arrive(*arguments)
                else:
                    self._pass_on(method, *arguments)
            if clock.monotonic() - ticked >= TICK:  # also while news keep coming
                ticked = clock.monotonic()
                self._pass_on("tick")
        for recorder in self._recorders:
            self._try(recorder, "end", even_after_fault=True)

    def _pass_on(self, method: str, *arguments) -> None:
        """To all recorders; only those that hold something back have `tick` and `idle`."""
        for recorder in self._recorders:
            if method not in ("tick", "idle") or hasattr(recorder, method):
                self._try(recorder, method, *arguments)

    def _next(self) -> list | None:
        """The next jobs; where there are none for `TICK`, the frames that wait and an `idle`."""
        try:
            return self._queue.get(timeout=TICK)
        except Empty:
            return [*(("series", (frame,)) for frame in self._waiting()), ("idle", ())]

    def _waiting(self) -> list[Frame]:
        # Between taking a batch and handing it over the run's thread may add nothing newer to the queue.
        return self._taken() if self._queue.empty() else []

    def _arrive(self, arrived) -> None:
        found: dict = {}
        for recorder in self._recorders:
            if hasattr(recorder, "position"):
                found |= self._try(recorder, "position") or {}
        if not self._failed:  # a log that has ended cannot be gone on with
            arrived(found)

    def _try(self, recorder: Recorder, method: str, *arguments, even_after_fault: bool = False):
        # After a fault the queue is still emptied, or the run would wait for it for ever.
        if (self._fault or recorder in self._failed) and not even_after_fault:
            return None
        try:
            return getattr(recorder, method)(*arguments)
        except Exception as fault:
            self._give_up(recorder, fault)
            return None

    def _give_up(self, recorder: Recorder, fault: Exception) -> None:
        self._failed.setdefault(recorder, f"{_run_error(fault)}; the run goes on without it")
        if not self._go_on:
            self._fault = self._fault or fault


def _run_error(fault: Exception) -> RunError:
    if isinstance(fault, OSError) and fault.errno in FULL:
        return RunError("the disk is full: the log could not be written; what came before can be read")
    text = f"{fault.filename}: {fault.strerror}" if isinstance(fault, OSError) and fault.filename else str(fault)
    return RunError(f"the log could not be written: {text}")


def _copy(frame: Frame) -> Frame:
    """A frame with particles of its own, in single precision: they are drawn only."""
    single = {
        name: np.array(array, np.float32)
        for name in ("position", "velocity", "pressure")
        if (array := getattr(frame, name)) is not None
    }
    fields = {name: np.array(values, np.float32) for name, values in frame.fields.items()}
    return replace(frame, fields=fields, label=None, **single)
