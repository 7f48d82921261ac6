"""Reads `run.mcap` back, also where a killed run left it without its end, and where it is damaged."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage

from fsi.errors import SceneError
from fsi.record.clock import read_clock
from fsi.record.mcap_file import Channel, LogFile, messages, read_file
from fsi.record.mcap_format import POSES, OldSeriesMessage
from fsi.record.series import SERIES


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
    text), facts on the scene (empty where they are damaged), and whether the log was closed (False after a kill). `lost`
    are spans of time [s] (from, to) within which damage has taken frames or events, None for an end that is not known.
    `partial` are the steps of frames that a kill or damage has cut in two, which are left out."""

    time: np.ndarray
    step: np.ndarray
    wall_time: np.ndarray
    variables: dict[str, Variable]
    events: list[tuple[float, str, str]]
    scene: dict[str, str]
    complete: bool
    closed: bool
    lost: list[tuple[float | None, float | None]]
    damaged: bool = False
    partial: frozenset[int] = frozenset()


@dataclass
class _Rows:
    """Values of one series: a row for each of `steps`; `metadata` of its channel where that has them."""

    steps: list[int] = field(default_factory=list)
    values: list[bytes] = field(default_factory=list)
    metadata: dict[str, str] | None = None
    labels: list[str] | None = None  # of the bodies of a pose

    def add(self, step: int, row: bytes) -> None:
        self.steps.append(step)
        self.values.append(row)

    def has(self, step: int) -> bool:
        at = int(np.searchsorted(self.steps, step)) if self.steps == sorted(self.steps) else -1
        return step in self.steps if at < 0 else at < len(self.steps) and self.steps[at] == step


class _Reading:
    """Messages sorted by what they hold, as they come."""

    def __init__(self, file: LogFile):
        self.rows: dict[str, _Rows] = {}
        self.times: dict[int, tuple[float, float]] = {}  # step -> time, wall time
        self.events: list[tuple[float, str, str]] = []
        self.ends: dict[int, list[int]] = {}  # chunk -> its first and its last step
        self.strange = 0  # messages whose channel is lost
        takers: dict[int, object] = {}
        for chunk, number, step, _, data, start, end in messages(file):
            take = takers.get(number)
            if take is None:
                if number not in file.channels:
                    self.strange += 1
                    continue
                take = takers[number] = self._taker(file.channels[number])
            if take(step, data, start, end):
                self.ends.setdefault(chunk, [step, step])[1] = step

    def _taker(self, channel: Channel):
        """A function that takes a message of this channel; it is true for those of a frame."""
        if channel.topic.startswith("/series/"):
            name = channel.topic.removeprefix("/series/")
            rows = self.rows.setdefault(name, _Rows(metadata=channel.metadata))
            return self._series(rows, int(np.prod(json.loads(channel.metadata["shape"]), dtype=int)))
        if channel.topic == "/tf":
            return self._poses({kind: json.loads(channel.metadata[kind]) for kind in POSES})
        return self._event if channel.topic == "/events" else lambda *_: False

    def _series(self, rows: _Rows, size: int):
        """Series messages: a stamp, which all of a step share, then the packed values, as the writer puts them."""
        size *= 8
        tag = b"\x22" + _varint(size)
        rest = len(tag) + size

        def take(step: int, data: bytes, start: int, end: int) -> bool:
            cut = end - size
            stamp = data[start : end - rest]
            if self._stamp != (step, stamp) or data[cut - len(tag) : cut] != tag:
                message = OldSeriesMessage.FromString(data[start:end])
                self.times[step] = message.time, message.wall_time
                self._stamp = step, stamp
                if data[cut - len(tag) : cut] != tag:
                    rows.add(step, np.array(message.values, float).tobytes())
                    return True
            rows.add(step, data[cut:end])
            return True

        return take

    _stamp: tuple[int, bytes] = (-1, b"")

    def _poses(self, names: dict[str, list[str]]):
        for kind, pair in POSES.items():
            for name in pair if names[kind] else ():
                self.rows[name] = _Rows(labels=names[kind])

        def take(step: int, data: bytes, start: int, end: int) -> bool:
            poses = FrameTransforms.FromString(data[start:end]).transforms
            at = 0
            for kind, (position, quaternion) in POSES.items():
                own = poses[at : (at := at + len(names[kind]))]
                if own:
                    places = [(p.translation.x, p.translation.y, p.translation.z) for p in own]
                    turns = [(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z) for p in own]
                    self.rows[position].add(step, np.array(places).tobytes())
                    self.rows[quaternion].add(step, np.array(turns).tobytes())
            return True

        return take

    def _event(self, step: int, data: bytes, start: int, end: int) -> bool:
        event = LogMessage.FromString(data[start:end])
        level = LogMessage.DESCRIPTOR.enum_types_by_name["Level"].values_by_number[event.level].name.lower()
        self.events.append((event.timestamp.ToNanoseconds() / 1e9, level, event.message))
        return False


def _varint(number: int) -> bytes:
    """As protobuf writes a length."""
    out = bytearray()
    while number > 127:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes([*out, number])


def read_log(path: Path) -> RunLog:
    """What of a log can be trusted. Raises SceneError where the file is missing or no MCAP file."""
    file = read_file(path)
    reading = _Reading(file)
    every = sorted(reading.times)
    holes = _holes(reading, every) if file.damaged or not file.complete else set()
    partial = frozenset(holes | _cut(file, reading, every))
    steps = np.array(sorted(set(every) - partial), np.int64)
    times = np.array([reading.times[step] for step in steps.tolist()], float).reshape(-1, 2)
    if (clock := read_clock(path)) is not None:
        times[:, 1] = [clock.get(step, np.nan) for step in steps.tolist()]
    variables = {name: _variable(name, rows, steps) for name, rows in reading.rows.items()}
    lost = file.lost + _lost(
        [(step, step) for step in holes] + [_beside(file, reading, gap) for gap in file.gaps], steps, times[:, 0]
    )
    if reading.strange or (file.unknown and not lost):
        lost = [*file.lost, (None, None)]
    ended = {"complete": file.complete, "closed": file.closed, "damaged": file.damaged}
    return RunLog(
        times[:, 0], steps, times[:, 1], variables, reading.events, file.scene, lost=lost, partial=partial, **ended
    )


def _beside(file: LogFile, reading: _Reading, cut: int) -> tuple[int | None, int | None]:
    """The last step before a chunk, and the first one from it on; None where there is none."""
    before = [reading.ends[n][1] for n in range(cut) if n in reading.ends][-1:]
    after = [reading.ends[n][0] for n in range(cut, len(file.chunks)) if n in reading.ends][:1]
    return before[0] if before else None, after[0] if after else None


def _cut(file: LogFile, reading: _Reading, every: list[int]) -> set[int]:
    """Steps at the edges of what is lost, and at the end of a log that was cut off, which lack a series that the frame on
    their other side has."""
    beyond: dict[int, int | None] = {}  # step -> the one to compare with
    for cut in {*file.gaps, *([] if file.closed else [len(file.chunks)])}:
        for step, side in zip(_beside(file, reading, cut), (-1, 1), strict=True):
            if step is not None:
                at = int(np.searchsorted(every, step)) + side
                beyond[step] = every[at] if 0 <= at < len(every) else None
    rows = reading.rows.values()
    return {
        step
        for step, other in beyond.items()
        if step not in reading.times or any(not r.has(step) and (other is None or r.has(other)) for r in rows)
    }


def _holes(reading: _Reading, every: list[int]) -> set[int]:
    """Steps that lack a series which the frames before and after have: what is lost there may have left no other trace."""
    found: set[int] = set()
    for rows in reading.rows.values():
        if len(rows.steps) < len(every):
            there = np.isin(every, rows.steps)
            found |= {every[n + 1] for n in np.flatnonzero(~there[1:-1] & there[:-2] & there[2:])}
    return found


def _lost(sides: list[tuple], steps: np.ndarray, times: np.ndarray) -> list[tuple[float | None, float | None]]:
    """Spans of time, from the last frame up to one step to the first frame from another one on, without doubles."""
    spans = []
    for before, after in sides:
        last = -1 if before is None else int(np.searchsorted(steps, before, "right")) - 1
        first = len(steps) if after is None else int(np.searchsorted(steps, after))
        spans.append((float(times[last]) if last >= 0 else None, float(times[first]) if first < len(steps) else None))
    return sorted(set(spans), key=lambda span: -np.inf if span[0] is None else span[0])


def _variable(name: str, rows: _Rows, steps: np.ndarray) -> Variable:
    if rows.metadata is not None:
        facts = rows.metadata
        shape, dims = tuple(json.loads(facts["shape"])), tuple(json.loads(facts["dims"]))
        units, long_name, labels = facts["units"], facts["long_name"], json.loads(facts["labels"])
    else:  # from the poses
        known = SERIES[name]
        dims, units, long_name = known.dims, known.units, known.long_name
        labels = {dims[0]: rows.labels, dims[1]: list("xyz" if dims[1] == "axis" else "wxyz")}
        shape = tuple(len(labels[dim]) for dim in dims)
    found = np.frombuffer(b"".join(rows.values), "<f8").reshape(len(rows.steps), *shape)
    own = np.array(rows.steps, np.int64)
    if np.array_equal(own, steps):
        return Variable(dims, units, long_name, labels, found.copy())
    values = np.full((len(steps), *shape), np.nan)
    at = np.searchsorted(steps, own)
    there = (
        (at < len(steps)) & (steps[np.minimum(at, len(steps) - 1)] == own) if len(steps) else np.zeros(len(own), bool)
    )
    values[at[there]] = found[there]
    return Variable(dims, units, long_name, labels, values)


def entries(file: LogFile) -> Iterator[tuple[Channel, int, int, bytes]]:
    """Channel, sequence number, log time [ns] and content of every message that can be trusted."""
    for _, number, step, stamp, data, start, end in messages(file):
        if number in file.channels:
            yield file.channels[number], step, stamp, data[start:end]


def has_frames(path: Path) -> bool:
    """Whether a log holds a frame. False where it cannot be read."""
    try:
        return len(read_log(path).time) > 0
    except SceneError:
        return False


def log_complete(path: Path) -> bool:
    """Whether a log is there and whole: its checksums right, nothing missing, and the file closed."""
    try:
        file = read_file(path)
    except SceneError:
        return False
    return file.complete and not file.damaged
