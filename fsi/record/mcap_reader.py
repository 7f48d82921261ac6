"""Reads `run.mcap` back, also where a killed run left it without its end."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from mcap.exceptions import McapError
from mcap.records import Channel, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from fsi.errors import SceneError
from fsi.record.mcap_format import CHUNK_BYTES, POSES, SeriesMessage
from fsi.record.series import SERIES

MAGIC = b"\x89MCAP0\r\n"


@dataclass
class Variable:
    """One series: `dims` beside time, `values` (times, ...) with NaN where a step has none."""

    dims: tuple[str, ...]
    units: str
    long_name: str
    labels: dict[str, list[str]]
    values: np.ndarray


@dataclass
class RunLog:
    """All of a log: `time` [s], `step` and `wall_time` [s] (times,), the variables by name, the events (time, level,
    text), facts on the scene, and whether the log was closed (False after a kill). `partial` is the step of a last frame
    that a kill has cut in two, which is left out; None where there is none."""

    time: np.ndarray
    step: np.ndarray
    wall_time: np.ndarray
    variables: dict[str, Variable]
    events: list[tuple[float, str, str]]
    scene: dict[str, str]
    complete: bool
    partial: int | None = None


@dataclass
class _Raw:
    """Messages by topic, before they are put on one time axis: topic -> {step: values}."""

    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    rows: dict[str, dict[int, np.ndarray]] = field(default_factory=dict)
    times: dict[int, tuple[float, float]] = field(default_factory=dict)
    names: dict[str, list[str]] = field(default_factory=dict)
    events: list[tuple[float, str, str]] = field(default_factory=list)
    scene: dict[str, str] = field(default_factory=dict)
    complete: bool = False


def read_log(path: Path) -> RunLog:
    """The whole log. Raises SceneError where the file is missing or no MCAP file."""
    raw = _Raw()
    for record in _records(path):
        if isinstance(record, Metadata) and record.name == "scene":
            raw.scene = record.metadata
        elif isinstance(record, Footer):
            raw.complete = True
        elif isinstance(record, tuple):
            _sort_in(raw, *record)
    partial = _partial(raw)
    raw.times.pop(partial, None)
    steps = np.array(sorted(raw.times), np.int64)
    times = np.array([raw.times[step] for step in steps], float).reshape(-1, 2)
    variables = {name: _variable(name, raw, steps) for name in raw.rows}
    return RunLog(times[:, 0], steps, times[:, 1], variables, raw.events, raw.scene, raw.complete, partial)


def _partial(raw: _Raw) -> int | None:
    """The step of the last frame of a log that was cut off, where it lacks a series that the frame before has."""
    steps = sorted({step for rows in raw.rows.values() for step in rows})[-2:]
    if raw.complete or len(steps) < 2:
        return None
    lacks = any(steps[0] in rows and steps[1] not in rows for rows in raw.rows.values())
    return steps[1] if lacks else None


def messages(path: Path) -> Iterator[tuple[Channel, Message]]:
    """The messages that are whole, in the order of the file, each with its channel."""
    return (record for record in _records(path) if isinstance(record, tuple))


def rewrite(path: Path) -> tuple[int, bool]:
    """Bring a log that was cut off into a whole file, with its end and its summary; its messages, and whether it was whole
    already (then nothing is done). Raises SceneError where it cannot be read."""
    log = read_log(path)
    if log.complete:
        return sum(1 for _ in messages(path)), True
    new, schemas, channels, count = path.with_suffix(".mcap.new"), {}, {}, 0
    with new.open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK_BYTES)
        writer.start(profile="", library="spindrift")
        kinds: dict[int, Schema] = {}
        for record in _records(path):
            if isinstance(record, Schema):
                kinds[record.id] = record
            elif isinstance(record, Metadata):
                writer.add_metadata(record.name, record.metadata)
            elif isinstance(record, tuple):
                channel, message = record
                if message.sequence == log.partial and channel.topic != "/events":
                    continue
                if channel.id not in channels:
                    schema = kinds[channel.schema_id]
                    if schema.id not in schemas:
                        schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[channel.id] = writer.register_channel(
                        channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata
                    )
                times = message.log_time, message.data, message.publish_time, message.sequence
                writer.add_message(channels[channel.id], *times)
                count += 1
        writer.finish()
    os.replace(new, path)
    return count, False


def log_complete(path: Path) -> bool:
    """Whether a log is there and whole: every record read, its checksums right, and the file closed."""
    try:
        with open(path, "rb") as file:
            return any(isinstance(record, Footer) for record in StreamReader(file, validate_crcs=True).records)
    except Exception:  # of any kind: a damaged file fails wherever the damage is
        return False


def _records(path: Path) -> Iterator:
    """The file's records in order; a message as the pair of its channel and itself."""
    try:
        data = path.read_bytes()
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=path, fix="give the folder of a run") from None
    if not data.startswith(MAGIC):
        raise SceneError("not an MCAP file", file=path, fix="give the folder of a run")
    channels: dict[int, Channel] = {}
    try:
        for record in StreamReader(BytesIO(data[: _whole(data)])).records:
            if isinstance(record, Channel):
                channels[record.id] = record
            yield (channels[record.channel_id], record) if isinstance(record, Message) else record
    except McapError:  # the end of a killed run: all whole records were read
        return


def _whole(data: bytes) -> int:
    """Length [bytes] up to the end of the last record that is whole; each is an opcode, a length and as many bytes."""
    end = len(MAGIC)
    while end + 9 <= len(data):
        after = end + 9 + struct.unpack_from("<Q", data, end + 1)[0]
        if after > len(data):
            break
        end = after
    return len(data) if data[end:] == MAGIC else end


def _sort_in(raw: _Raw, channel: Channel, message: Message) -> None:
    if channel.topic.startswith("/series/"):
        name, row = channel.topic.removeprefix("/series/"), SeriesMessage.FromString(message.data)
        raw.metadata[name] = channel.metadata
        raw.rows.setdefault(name, {})[row.step] = np.array(row.values)
        raw.times[row.step] = row.time, row.wall_time
    elif channel.topic == "/tf":
        poses = FrameTransforms.FromString(message.data).transforms
        xyz = np.array([(p.translation.x, p.translation.y, p.translation.z) for p in poses])
        wxyz = np.array([(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z) for p in poses])
        start = 0
        for kind, (position, quaternion) in POSES.items():
            raw.names[kind] = json.loads(channel.metadata[kind])
            own = slice(start, start := start + len(raw.names[kind]))
            if raw.names[kind]:
                raw.rows.setdefault(position, {})[message.sequence] = xyz[own]
                raw.rows.setdefault(quaternion, {})[message.sequence] = wxyz[own]
    elif channel.topic == "/events":
        event = LogMessage.FromString(message.data)
        level = LogMessage.DESCRIPTOR.enum_types_by_name["Level"].values_by_number[event.level].name.lower()
        raw.events.append((event.timestamp.ToNanoseconds() / 1e9, level, event.message))


def _variable(name: str, raw: _Raw, steps: np.ndarray) -> Variable:
    rows = raw.rows[name]
    if name in raw.metadata:
        facts = raw.metadata[name]
        shape, dims = tuple(json.loads(facts["shape"])), tuple(json.loads(facts["dims"]))
        units, long_name, labels = facts["units"], facts["long_name"], json.loads(facts["labels"])
    else:  # from the poses
        known = SERIES[name]
        dims, units, long_name = known.dims, known.units, known.long_name
        labels = {dims[0]: raw.names[dims[0]], dims[1]: list("xyz" if dims[1] == "axis" else "wxyz")}
        shape = tuple(len(labels[dim]) for dim in dims)
    nothing = np.full(shape, np.nan)
    values = (
        np.stack([rows[s].reshape(shape) if s in rows else nothing for s in steps]) if len(steps) else nothing[None][:0]
    )
    return Variable(dims, units, long_name, labels, values)
