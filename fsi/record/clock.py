"""When each frame was computed, `run.clock`: what tells of the clock on the wall stands beside the logs, which are then the
same whenever a run was stopped and went on. Entries of a step and the wall time since the start [s], 16 bytes each."""

from __future__ import annotations

import os
import struct
from pathlib import Path

from fsi.protocols import Event, Frame
from fsi.record.files import write_all

ENTRY = struct.Struct("<qd")
NAME = "run.clock"


class ClockRecorder:
    """Writes `run.clock`; with `keep` it goes on after so many bytes of it."""

    def __init__(self, path: Path, keep: int | None = None):
        self._path, self._keep = path, keep
        self._waiting = bytearray()

    def begin(self, scene, bodies) -> None:
        self._file = self._path.open("wb" if self._keep is None else "ab", buffering=0)
        if self._keep is not None:
            self._file.truncate(min(self._keep, self._file.tell()))

    def series(self, frame: Frame) -> None:
        self._waiting += ENTRY.pack(frame.step, frame.wall_time)

    def particles(self, frame: Frame) -> None:
        pass

    def event(self, event: Event) -> None:
        pass

    def tick(self) -> None:
        if self._waiting:
            write_all(self._file, bytes(self._waiting))
            self._waiting.clear()

    idle = tick

    def position(self) -> dict[str, int]:
        """Bytes so far, all of which are on the disk when this returns."""
        self.tick()
        os.fsync(self._file.fileno())
        return {"clock": self._file.seek(0, os.SEEK_END)}

    def end(self) -> None:
        try:
            self.tick()
        finally:
            self._file.close()


def read_clock(log: Path) -> dict[int, float] | None:
    """Wall time [s] by step, as it stands beside a log; None where that is an older one, which holds it itself."""
    try:
        data = log.with_name(NAME).read_bytes()
    except OSError:
        return None
    return dict(ENTRY.iter_unpack(data[: len(data) // ENTRY.size * ENTRY.size]))
