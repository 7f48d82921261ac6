"""The bytes of a timeline, `.rrd`: the same data make the same bytes, and nothing of what is written stays in memory.

rerun encodes; it would name chunks, rows and layouts by chance and by the clock on the wall, and its own file sink keeps a
directory of all chunks until the end (0.5 kB each) and waits for ever for a disk that is full. So chunks get numbers for names
here, and the caller writes the bytes. The file has no directory (`rerun rrd optimize` adds one).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from uuid import UUID

import pyarrow as pa

from fsi.extras import require
from fsi.record.rrd_bytes import DATA, HEAD, LAYOUT, STORE, messages, packed

rr = require("rerun", "viewer", "output.timeline = true")
rrb = require("rerun.blueprint", "viewer", "output.timeline = true")
from rerun.chunk import Chunk  # noqa: E402

APPLICATION = "spindrift"
ROW = struct.Struct(">QQ")  # name of a row: number of its chunk, number in it
CLOCK = "log_time"
MOMENT = slice(2, 20)  # of a message on a store: when it was made
RANDOM = re.compile(rb"rec_[0-9a-f]{32}")  # name of the store that holds a layout


class Encoder:
    """Turns what is logged into messages of a recording, whose chunks are numbered from `number` on."""

    def __init__(self, recording: str, number: int = 1):
        self.number = number
        self._stream = rr.RecordingStream(APPLICATION, recording_id=recording, send_properties=False)
        self._bytes = self._stream.binary_stream()
        whole = self._bytes.read() or b""
        self._head = whole[:HEAD]
        self._store = _timeless(next(body for kind, body in messages(whole) if kind == STORE))

    def head(self) -> bytes:
        """What every file of this recording begins with."""
        return self._head + packed(STORE, self._store)

    def data(self, chunks: list[Chunk]) -> bytes:
        """Messages of chunks of data, in their order."""
        for chunk in chunks:
            self._stream.send_chunks(self._named(chunk))
        return b"".join(packed(DATA, body) for kind, body in messages(self._bytes.read() or b"") if kind == DATA)

    def layout(self, layout: rrb.Blueprint, scratch: Path) -> bytes:
        """Messages of a layout; `scratch` is a file that may be written."""
        for number, part in enumerate(_parts(layout.root_container), 1):
            part.id = UUID(int=number)
        stream = rr.RecordingStream(APPLICATION, send_properties=False)
        sent = stream.binary_stream()
        rr.send_blueprint(layout, make_active=False, make_default=True, recording=stream)
        scratch.write_bytes(whole := sent.read() or b"")
        try:
            reader = rr.chunk.RrdReader(scratch)
            chunks = list(reader.stream(store=reader.blueprints()[0]))
        finally:
            scratch.unlink()
        found = list(messages(whole))
        random = RANDOM.search(whole).group()
        name = b"rec_%032x" % 0
        store = next(body for kind, body in found if kind == STORE and random in body)
        last = next(body for kind, body in found if kind == LAYOUT)
        owner = last[: 2 + last[1]]  # the first field of what follows, as of each of its chunks: the store
        chunks.sort(key=lambda chunk: (chunk.entity_path, chunk.is_static))
        bodies = [body for _, body in messages(self._head + self.data(chunks))]
        out = [packed(STORE, _timeless(store))]
        out += [packed(DATA, owner + body[2 + body[1] :]) for body in bodies]
        return b"".join([*out, packed(LAYOUT, last)]).replace(random, name)

    def _named(self, chunk: Chunk) -> Chunk:
        batch = chunk.to_record_batch()
        if CLOCK in batch.schema.names:  # which rerun puts into layouts
            batch = batch.drop_columns([CLOCK])
        number, self.number = self.number, self.number + 1
        rows = pa.array([ROW.pack(number, row) for row in range(batch.num_rows)], pa.binary(ROW.size))
        schema = batch.schema.with_metadata({**batch.schema.metadata, b"rerun:id": b"chunk_%016X%016x" % (number, 0)})
        return Chunk.from_record_batch(pa.RecordBatch.from_arrays([rows, *batch.columns[1:]], schema=schema))[0]


def chunk_of(path: str, what: tuple, times: list) -> Chunk:
    """A chunk of one row that holds rerun's archetypes, at a time (columns of one entry) or for ever."""
    batches = [batch for archetype in what for batch in archetype.as_component_batches()]
    return Chunk.from_columns(path, times, [batch.partition([len(batch.as_arrow_array())]) for batch in batches])


def _timeless(store: bytes) -> bytes:
    """The message on a store, without the time at which it was made."""
    return store[: MOMENT.start] + b"\x09" + bytes(8) + b"\x11" + bytes(8) + store[MOMENT.stop :]


def _parts(container) -> Iterator:
    yield container
    for part in container.contents:
        yield from _parts(part) if isinstance(part, rrb.Container) else (part,)
