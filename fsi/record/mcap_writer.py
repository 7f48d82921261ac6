"""Writes an MCAP file of typed messages so that a kill or damage costs little of it, and so that the same messages make the
same bytes: chunks end by their size alone. Messages of a chunk that is open stand in a second file meanwhile, the tail."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.well_known import MessageEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from fsi.record.files import same_place, write_all
from fsi.record.mcap_file import ENTRY, LOST, MESSAGE, MESSAGE_HEAD, sealed, tail_of
from fsi.record.mcap_format import CHUNK_BYTES, SeriesMessage

ENTRY_BYTES = 4096  # of the records of an entry of the tail, or a little more
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


class _Indices:
    """The index of every chunk, packed as it will stand in the summary: as objects they would take kilobytes each."""

    def __init__(self) -> None:
        self._builder = RecordBuilder()

    def append(self, index: ChunkIndex) -> None:
        index.write(self._builder)

    def __iter__(self) -> Iterator[_Indices]:
        yield self

    def write(self, builder: RecordBuilder) -> None:
        builder.write(self._builder.end())


class LogWriter:
    """A log that begins with `facts` on the scene. Facts and channels are metadata with a checksum of their own, apart from
    the chunks that may be damaged. OSError where the file cannot be written, or is no longer there."""

    def __init__(self, path: Path, facts: dict[str, str]):
        self.path, self.count = path, 0
        self._facts = sealed(facts) if facts else {}
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._described: dict[str, str] = {}  # topic and facts of each channel by its number
        self._open: list[tuple[str, int, int, bytes]] = []  # messages of the open chunk: topic, step, stamp and content
        self._last = 0, 0  # step and stamp of the last message
        self._shown = 0  # how many of them are in the tail
        self._tail, self._broken = None, False
        self._file = path.open("wb")
        self._writer = Writer(_Stream(self), chunk_size=CHUNK_BYTES, enable_data_crcs=True)
        self._writer._Writer__chunk_indices = _Indices()
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
        self._described[str(number)] = json.dumps([topic, facts])
        self._writer.add_metadata("channels", sealed({str(number): self._described[str(number)]}))

    def add(self, topic: str, data: bytes, stamp: int, step: int) -> None:
        """A message of the time `stamp` [ns]."""
        before = self._file.tell()
        try:
            self._writer.add_message(self._channels[topic], stamp, data, stamp, sequence=step)
            chunk = self._file.tell() != before  # it was written, with this message as its last
            if chunk:
                self._file.flush()
        except OSError:
            self._broken = True
            self._open.append((topic, step, stamp, data))
            self.count += 1
            with suppress(OSError):
                self._show_rest()
            raise
        self.count, self._last = self.count + 1, (step, stamp)
        if not chunk:
            self._open.append((topic, step, stamp, data))
            return
        self._open, self._shown = [], 0
        if self._tail:
            self._tail.seek(0)
            self._tail.truncate()

    def lose(self, spans: list[tuple[float | None, float | None]]) -> None:
        """Note that the messages between these times [s] are lost, None for an end that is not known."""
        if spans:
            self._writer.add_metadata(LOST, sealed({str(n): json.dumps(span) for n, span in enumerate(spans)}))

    def show(self) -> None:
        """Bring all so far into the files, where a reader finds it. OSError where they were taken away."""
        same_place(self.path, os.fstat(self._file.fileno()))
        if self._shown < len(self._open):
            self._file.flush()
            self._show_rest()

    def _show_rest(self) -> None:
        if self._tail is None:
            self._tail = tail_of(self.path).open("wb", buffering=0)
        while self._shown < len(self._open):  # in small pieces: of a disk that is nearly full they take what is left
            records, first, end = b"", self._shown, self._shown
            while end < len(self._open) and len(records) < ENTRY_BYTES:
                records += self._record(*self._open[end])
                end += 1
            head = ENTRY.pack(len(records), zlib.crc32(records), self.count - len(self._open) + first)
            write_all(self._tail, head + records)
            self._shown = end  # not before: what was not written comes first the next time

    def _record(self, topic: str, step: int, stamp: int, data: bytes) -> bytes:
        return (
            MESSAGE_HEAD.pack(MESSAGE, MESSAGE_HEAD.size - 9 + len(data), self._channels[topic], step, stamp, stamp)
            + data
        )

    def position(self) -> dict:
        """Messages in closed chunks, all of which are on the disk when this returns, and the messages of the open one."""
        self._file.flush()
        os.fsync(self._file.fileno())
        topics, steps, stamps, contents = zip(*self._open, strict=True) if self._open else ((), (), (), ())
        facts = {
            "closed": self.count - len(self._open),
            "last": self._last,
            "topics": list(topics),
            "steps": list(steps),
        }
        sizes = [len(data) for data in contents]
        return facts | {"stamps": list(stamps), "sizes": sizes, "data": np.frombuffer(b"".join(contents), np.uint8)}

    def move(self, path: Path) -> None:
        """Take the place of the file `path`, and of its tail; closed in between, for Windows renames no file that is open."""
        was_open = not self._file.closed
        self._file.close()
        os.replace(self.path, path)
        self.path = path
        if was_open:
            self._file = path.open("ab")

    def finish(self) -> None:
        """Write the summary and close the file. What then stands in it no longer stands in the tail."""
        try:
            if self._broken:  # what it wrote last has not come down whole: nothing may follow it
                return
            self._describe()
            if self._described:
                self._writer.add_metadata("channels", sealed(self._described))
            self._writer.finish()
            self._file.flush()
            same_place(self.path, os.fstat(self._file.fileno()))
        except OSError:
            with suppress(OSError):
                self._show_rest()
            raise
        finally:
            if self._tail:
                self._tail.close()
            self._file.close()
        tail_of(self.path).unlink(missing_ok=True)
