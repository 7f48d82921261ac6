"""Writes an MCAP file of typed messages so that a kill or damage costs little of it."""

from __future__ import annotations

import json
import os
import time as clock
from pathlib import Path

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from mcap.well_known import MessageEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from fsi.record.files import same_place
from fsi.record.mcap_file import sealed
from fsi.record.mcap_format import CHUNK_BYTES, SeriesMessage

WAIT = 0.5  # wall time [s] after which a chunk is closed though it is small, so that a kill costs no more
KINDS = {"/tf": FrameTransforms, "/events": LogMessage, "/particles": PointCloud}  # topic -> message, else a series


class _Stream:
    """The file that a log is in just now, as the library writes to it."""

    def __init__(self, log: LogWriter):
        self._log = log

    def write(self, data: bytes) -> int:
        return self._log._file.write(data)

    def tell(self) -> int:
        return self._log._file.tell()

    def flush(self) -> None:
        self._log._file.flush()


class LogWriter:
    """A log that begins with `facts` on the scene. Facts and channels are metadata with a checksum of their own, apart from
    the chunks that may be damaged. OSError where the file cannot be written, or is no longer there."""

    def __init__(self, path: Path, facts: dict[str, str]):
        self.path, self.count = path, 0
        self._facts = sealed(facts) if facts else {}
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._new: dict[str, str] = {}  # channels that stand in no metadata yet
        self._open_since: float | None = None  # wall time of the oldest message that is not in the file yet
        self._file = path.open("wb")
        self._writer = Writer(_Stream(self), chunk_size=CHUNK_BYTES)
        self._writer.start(profile="", library="spindrift")
        self._describe()
        self._file.flush()

    def _describe(self) -> None:
        if self._facts:
            self._writer.add_metadata("scene", self._facts)

    def opened(self, topic: str) -> bool:
        return topic in self._channels

    def open(self, topic: str, facts: dict[str, str]) -> None:
        """A channel for a topic that has none."""
        kind = KINDS.get(topic, SeriesMessage)
        name = kind.DESCRIPTOR.full_name
        if name not in self._schemas:
            self._schemas[name] = register_schema(self._writer, kind)
        number = self._writer.register_channel(topic, MessageEncoding.Protobuf, self._schemas[name], facts)
        self._channels[topic] = number
        self._new[str(number)] = json.dumps([topic, facts])

    def add(self, topic: str, data: bytes, stamp: int, step: int) -> None:
        """A message of the time `stamp` [ns]."""
        self._writer.add_message(self._channels[topic], stamp, data, stamp, sequence=step)
        self.count += 1
        self._open_since = self._open_since or clock.monotonic()

    def flush(self) -> None:
        """Hand what is written to the operating system; messages of a chunk that is open are not."""
        if self._new:
            self._writer.add_metadata("channels", sealed(self._new))
            self._new = {}
        self._file.flush()

    def settle(self) -> None:
        """Close the chunk."""
        self._writer.flush()
        self.flush()
        self._open_since = None
        self._check_place()

    def tick(self) -> None:
        """Called about twice a second: what has waited for so long goes into the file."""
        if self._open_since is not None and clock.monotonic() - self._open_since > WAIT:
            self.settle()
        self._check_place()

    def sync(self) -> None:
        """All so far is on the disk when this returns."""
        self.settle()
        os.fsync(self._file.fileno())

    def move(self, path: Path) -> None:
        """Take the place of the file `path`; closed in between, for Windows renames no file that is open."""
        was_open = not self._file.closed
        self._file.close()
        os.replace(self.path, path)
        self.path = path
        if was_open:
            self._file = path.open("ab")

    def finish(self) -> None:
        """Write the summary and close the file."""
        try:
            self.flush()
            self._describe()
            self._writer.finish()
            self._file.flush()
            self._check_place()
        finally:
            self._file.close()

    def _check_place(self) -> None:
        """OSError where another file, or none, is under the name of this one."""
        same_place(self.path, os.fstat(self._file.fileno()))
