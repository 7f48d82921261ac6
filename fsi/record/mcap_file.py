"""The parts of an MCAP file that can be trusted: every chunk is found by its own mark and taken only if its checksum holds.

Damage therefore costs the chunks that it falls into and no others, and never gives other values. The format is that of
mcap.dev/spec: records of an opcode, a length and as many bytes; chunks of compressed messages, each followed by an index.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.records import Channel, Metadata

from fsi.errors import SceneError
from fsi.trust import check_bytes

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, CHANNEL, MESSAGE, CHUNK, INDEX, STATISTICS, METADATA = 1, 2, 4, 5, 6, 7, 11, 12  # opcodes
DATA_END = b"\x0f\x04\0\0\0\0\0\0\0"  # opcode and length of the record after the last chunk
MARK = b"\x04\0\0\0zstd"  # in the head of every chunk: the name of its compression
CHUNK_HEAD = struct.Struct(
    "<BQQQQI"
)  # before it: opcode, length, first and last time, size and checksum of the records
MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence number, log time, publish time
FOOTER_END = struct.Struct("<BQQQI")  # opcode, length, start of the summary, start of its offsets, checksum
ENTRY = struct.Struct(
    "<IIQ"
)  # before each entry of a tail: length and checksum of its records, number of the first message
LOST = "lost"  # metadata on what damage has taken before the log was written anew
LIMIT = 2**31  # bytes of the records of a chunk
MOST_BYTES = 2**36  # of a log that is read, as it is on the disk and unpacked
SEAL = "crc"  # key of metadata whose value is the checksum of the others
FACTS = {
    "name",
    "dimension",
    "spacing",
    "width",
    "rho",
    "g",
    "joint_kind",
    "toml",
}  # of logs without a checksum of them


@dataclass
class LogFile:
    """What of a log can be trusted: the records of each chunk, the channels by number, facts on the scene (empty where they
    are damaged). `closed`: all chunks were written; `complete`: and the summary after them. `gaps` are the numbers of the
    chunks before which others are lost (their count: at the end), `unknown` says that some are lost without a trace;
    `damaged` where anything is not as it was written, were it an index that nothing is read from."""

    chunks: list[bytes] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    scene: dict[str, str] = field(default_factory=dict)
    closed: bool = False
    complete: bool = False
    gaps: list[int] = field(default_factory=list)
    unknown: bool = False
    damaged: bool = False
    lost: list[tuple[float | None, float | None]] = field(default_factory=list)  # as an earlier log has told, times [s]

    def before_gaps(self) -> int:
        """Messages up to the first chunk before which others are lost."""
        return sum(_counts(records).total() for records in self.chunks[: min(self.gaps, default=None)])


def sealed(facts: dict[str, str]) -> dict[str, str]:
    """Metadata with a checksum of their own, which MCAP does not have."""
    rest = sorted((key, value) for key, value in facts.items() if key != SEAL)
    return facts | {SEAL: str(zlib.crc32(json.dumps(rest).encode()))}


def read_file(path: Path) -> LogFile:
    """What can be trusted of a file and of its tail. Raises SceneError where it cannot be read or holds nothing of a log."""
    check_bytes(path, MOST_BYTES, "log less often, or without output.cloud")
    try:
        tail = tail_of(path).read_bytes() if tail_of(path).is_file() else b""  # first: its messages may move to the log
        data = Path(path).read_bytes()
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=path, fix="give the folder of a run") from None
    if not data:
        raise SceneError("is empty: the run ended before it wrote anything", file=path, fix="see run.json for why")
    log, places = LogFile(), []
    unpacked = 0
    for start, end, records in _chunks(data):
        if (unpacked := unpacked + len(records)) > MOST_BYTES:
            fault = f"unpacks to more than the {MOST_BYTES / 1e6:.0f} MB that are read"
            raise SceneError(fault, file=path, fix="log less often, or without output.cloud")
        places.append((start, end))
        log.chunks.append(records)
    if not log.chunks and not data.startswith(MAGIC):
        raise SceneError("not an MCAP file", file=path, fix="give the folder of a run")
    log.damaged = not data.startswith(MAGIC)
    end, count = _find_gaps(log, data, places)
    summary = _take_summary(log, data, end, count)
    copies = list(_metadata(data, b"scene"))  # at the beginning, and where the log was closed at its end
    log.scene = dict(copies[0]) if copies else {}
    log.damaged |= len(copies) < (2 if log.complete and log.scene.pop(SEAL, None) else 1)
    log.channels = dict(_known_channels(data, summary))
    for facts in _metadata(data, LOST.encode()):
        log.lost += [tuple(json.loads(text)) for key, text in facts.items() if key != SEAL]
    if not log.closed:
        _take_tail(log, tail, count)
    return log


def tail_of(path: Path) -> Path:
    """The file of the messages of a log whose chunk is open."""
    return Path(path).with_name(f"{Path(path).name}.tail")


def _take_tail(log: LogFile, data: bytes, count: int) -> None:
    """Put what the tail of a log holds beyond its `count` messages to its chunks."""
    at = 0
    while at + ENTRY.size <= len(data):
        length, checksum, first = ENTRY.unpack_from(data, at)
        records = data[at + ENTRY.size : (at := at + ENTRY.size + length)]
        if len(records) < length or zlib.crc32(records) != checksum:
            return
        skip = 0
        for _ in range(min(count - first, length)):  # they were put into a chunk just before the kill
            if skip >= length:
                break
            skip += 9 + _length(records, skip)
        if skip < length:
            if first > count and not log.gaps:
                log.gaps.append(len(log.chunks))
                log.damaged = True
            log.chunks.append(records[skip:])
            count = first + _counts(records).total()


def messages(log: LogFile) -> Iterator[tuple[int, int, int, int, bytes, int, int]]:
    """Number of the chunk, channel, sequence number and log time [ns] of each message, and where it is: data[start:end].
    The channels of a chunk are taken over as they come."""
    head, unpack = MESSAGE_HEAD.size, MESSAGE_HEAD.unpack_from
    for number, data in enumerate(log.chunks):
        at, last = 0, len(data)
        while at < last:
            if data[at] == MESSAGE:
                _, length, channel, sequence, stamp, _ = unpack(data, at)
                yield number, channel, sequence, stamp, data, at + head, at + 9 + length
            else:
                length = _length(data, at)
                if data[at] == CHANNEL:
                    found = _channel(data[at + 9 : at + 9 + length])
                    log.channels[found.id] = found
            at += 9 + length


def _chunks(data: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Start, end and records of the chunks whose checksum is right."""
    unpacker, at = zstandard.ZstdDecompressor(), 0
    while (mark := data.find(MARK, at)) >= 0:
        at, start, content = mark + 1, mark - CHUNK_HEAD.size, mark + len(MARK) + 8
        if start < 0 or content > len(data):
            continue
        *_, size, checksum = CHUNK_HEAD.unpack_from(data, start)
        end = content + struct.unpack_from("<Q", data, content - 8)[0]
        if end > len(data):
            continue
        try:
            packed = memoryview(data)[content:end]
            if zstandard.get_frame_parameters(packed).content_size != size or not 0 < size <= LIMIT:
                continue
            records = unpacker.decompress(packed)
        except (zstandard.ZstdError, MemoryError):
            continue
        if len(records) == size and zlib.crc32(records) == checksum:
            yield start, end, records
            at = end


def _length(data: bytes, at: int) -> int:
    return struct.unpack_from("<Q", data, at + 1)[0]


def _footer(data: bytes) -> tuple[int, int, int] | None:
    """Of a file that was closed: where its footer is, where the summary was written to, and the checksum of both."""
    at = len(data) - len(MAGIC) - FOOTER_END.size
    if at < 0 or not data.endswith(MAGIC):
        return None
    opcode, length, start, _, checksum = FOOTER_END.unpack_from(data, at)
    return (at, start, checksum) if (opcode, length) == (FOOTER, FOOTER_END.size - 9) else None


def _take_summary(log: LogFile, data: bytes, end: int, count: int) -> bytes:
    """The summary of a file whose data end there, and of which so many messages were found; empty where there is none or its
    checksum is wrong. What it says of the length of the data and of the number of messages tells of chunks that are lost
    without a trace."""
    footer = _footer(data)
    log.complete = footer is not None
    if footer is None:
        return b""
    (at, start, checksum), own = footer, end + len(DATA_END) + 4
    whole = data[own - 4 : own]  # the checksum of all data, zero where none was taken
    log.damaged |= whole != bytes(4) and whole != struct.pack("<I", zlib.crc32(memoryview(data)[:end]))
    right = log.closed and zlib.crc32(memoryview(data)[own : at + FOOTER_END.size - 4]) == checksum
    summary = data[own:at] if right else b""
    log.damaged |= not right
    if right and not log.gaps and (start != own or count != _stated(summary, count)):
        log.damaged = log.unknown = True
    return summary


def _metadata(data: bytes, name: bytes) -> Iterator[dict[str, str]]:
    """Metadata records of that name whose checksum is right."""
    mark, at = struct.pack("<I", len(name)) + name, 0
    while (at := data.find(mark, at)) >= 0:
        start, at = at, at + 1
        if start < 9 or data[start - 9] != METADATA or start + _length(data, start - 9) > len(data):
            continue
        try:
            facts = Metadata.read(ReadDataStream(BytesIO(data[start : start + _length(data, start - 9)]))).metadata
        except Exception:  # of any kind: a damaged record fails wherever the damage is
            continue
        if set(facts) == FACTS or sealed(facts) == facts:
            yield facts


def _known_channels(data: bytes, summary: bytes) -> Iterator[tuple[int, Channel]]:
    """Channels by number, from where they stand beside the chunks: in metadata, and in the summary of a closed file."""
    for facts in _metadata(data, b"channels"):
        for number, text in facts.items() - {(SEAL, facts[SEAL])}:
            topic, metadata = json.loads(text)
            known = {"topic": topic, "metadata": metadata, "message_encoding": "protobuf", "schema_id": 0}
            yield int(number), Channel(id=int(number), **known)
    at = 0
    while at < len(summary):
        if summary[at] == CHANNEL:
            found = _channel(summary[at + 9 : at + 9 + _length(summary, at)])
            yield found.id, found
        at += 9 + _length(summary, at)


def _channel(content: bytes) -> Channel:
    return Channel.read(ReadDataStream(BytesIO(content)))


def _find_gaps(log: LogFile, data: bytes, places: list[tuple[int, int]]) -> tuple[int, int]:
    """Where chunks are lost: between two that were found stands the index of the first, whose length follows from its
    messages, and nothing else but metadata. Gives the place where the data should end, and the
    number of messages."""
    at, found = _skip(data, len(MAGIC), (HEADER, METADATA)), 0
    for n, (start, end) in enumerate(places):
        if at != start:
            log.damaged = True
            log.gaps.append(n)
        counts = _counts(log.chunks[n]).values()
        found += sum(counts)
        index = sum(9 + 2 + 4 + 16 * count for count in counts)
        at = _skip(data, end + index, (METADATA,))
        log.damaged |= _skip(data, end, (INDEX, METADATA)) != at
    log.closed = data[at : at + 9] == DATA_END
    if not log.closed and (_footer(data) or not _torn(data, at)):
        log.damaged = True
        log.gaps.append(len(places))
    return at, found


def _torn(data: bytes, at: int) -> bool:
    """Whether a record begins here that the end of the file cuts off, as where a run was killed."""
    if at + 9 > len(data):
        return True
    return data[at] in (CHUNK, INDEX, METADATA) and len(data) < at + 9 + _length(data, at) < len(data) + LIMIT


def _skip(data: bytes, at: int, opcodes: tuple[int, ...]) -> int:
    """The place after records of these kinds."""
    while at + 9 <= len(data) and data[at] in opcodes:
        at += 9 + _length(data, at)
    return at


def _counts(records: bytes) -> Counter:
    """Channel -> messages in a chunk; the index of each takes a time and a place for every one."""
    counts: Counter = Counter()
    at, last, unpack = 0, len(records), MESSAGE_HEAD.unpack_from
    while at < last:
        if records[at] == MESSAGE:
            _, length, channel, *_ = unpack(records, at)
            counts[channel] += 1
            at += 9 + length
        else:
            at += 9 + _length(records, at)
    return counts


def _stated(summary: bytes, otherwise: int) -> int:
    """Messages of the whole file, as its summary has them."""
    at = 0
    while at < len(summary):
        if summary[at] == STATISTICS:
            return struct.unpack_from("<Q", summary, at + 9)[0]
        at += 9 + _length(summary, at)
    return otherwise
