"""The log of record, `run.mcap`: every time series, the body poses and the events, as typed protobuf messages.

Topics: `/series/NAME` (spindrift.Series; units, names and dimensions in the channel's metadata), `/tf`
(foxglove.FrameTransforms, the centres of mass of all moving bodies, wet and dry), `/events` (foxglove.Log), `/particles`
(foxglove.PointCloud) with `output.cloud`. The log time is the simulated time, the sequence number the step. Chunks are
small, and what no chunk holds yet stands in `run.mcap.tail`, so that a killed run loses no more than about a second of wall
time. The file depends on the scene and on what is logged alone, not on when; `fsi.record.clock` has that.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud

from fsi.protocols import BodySet, Event, Frame
from fsi.record.fields import spatial, values
from fsi.record.mcap_file import read_file, tail_of
from fsi.record.mcap_format import POSES, SeriesMessage
from fsi.record.mcap_reader import entries, read_log
from fsi.record.mcap_writer import LogWriter
from fsi.record.series import column_names, describe, labels
from fsi.scene.fields import field_of
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene

WORLD = "world"


class McapRecorder:
    """Writes `run.mcap`; OSError where the file cannot be written, or is taken away while it is.

    With `keep` (a `position`) it goes on from there: the messages up to it are written anew by the same calls as the first
    time, so that the whole log is the one of a run that was never stopped. Where damage has taken some of them, the log
    says so from then on, and `lost` is what it says.
    """

    def __init__(self, path: Path, keep: dict | None = None):
        self._path, self._keep = path, keep

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        self._names = labels(scene, bodies)
        self._rotary = tuple(bodies.joint_is_rotary) if bodies else ()
        self._scene_name, self._cloud = scene.name, scene.output.fields if scene.output.cloud else ()
        facts = {
            "name": scene.name,
            "dimension": str(scene.dimension),
            "spacing": repr(scene.spacing),
            "width": repr(scene.tank.width),
            "rho": repr(scene.fluid.density),
            "g": repr(scene.gravity),
            "joint_kind": json.dumps(["hinge" if rotary else "slide" for rotary in self._rotary]),
            "toml": resolved_toml(scene),
        }
        self._log = LogWriter(self._path if self._keep is None else _beside(self._path), facts)
        if self._keep is not None:
            _copy(self._path, self._log, self._keep)
            self._log.move(self._path)
            self._log.show()

    def position(self) -> dict[str, dict]:
        """Where the log stands; what `LogWriter.position` does not give is on the disk when this returns."""
        return {"messages": self._log.position()}

    def tick(self) -> None:
        """Called several times a second: what has waited goes into the tail."""
        self._log.show()

    idle = tick

    def series(self, frame: Frame) -> None:
        stamp = SeriesMessage(time=frame.time, step=frame.step).SerializeToString()
        for name, value in frame.series.items():
            if any(name in pair for pair in POSES.values()) or np.size(value) == 0:
                continue
            topic = f"/series/{name}"
            if not self._log.opened(topic):
                self._log.open(topic, self._facts(name, np.shape(value)))
            values = SeriesMessage(values=np.ravel(value).tolist()).SerializeToString()
            self._add(topic, stamp + values, frame.time, frame.step)  # protobuf joins the two
        if frame.series.keys() >= set(POSES["body"]):
            if not self._log.opened("/tf"):
                self._log.open("/tf", {kind: json.dumps(self._names[kind]) for kind in POSES})
            self._add("/tf", self._poses(frame).SerializeToString(), frame.time, frame.step)

    def particles(self, frame: Frame) -> None:
        """The particles as a point cloud of x, y, z and the fields of the scene, all float32, where `output.cloud` asks
        for it; else they are on the timeline alone."""
        if not self._cloud:
            return
        names = ("x", "y", "z", *self._cloud)
        if not self._log.opened("/particles"):
            units = {"units": json.dumps({n: field_of(n).units for n in self._cloud} | dict.fromkeys("xyz", "m"))}
            self._log.open("/particles", units)
        columns = [*spatial(frame.position).T, *(values(frame, name) for name in self._cloud)]
        rows = np.ascontiguousarray(np.stack(columns, axis=1), np.float32)
        message = PointCloud(frame_id=WORLD, point_stride=4 * len(names), data=rows.tobytes())
        message.timestamp.FromNanoseconds(_nanoseconds(frame.time))
        message.pose.orientation.w = 1.0
        for n, name in enumerate(names):
            message.fields.add(name=name, offset=4 * n, type=PackedElementField.FLOAT32)
        self._add("/particles", message.SerializeToString(), frame.time, frame.step)

    def event(self, event: Event) -> None:
        if not self._log.opened("/events"):
            self._log.open("/events", {})
        number = LogMessage.DESCRIPTOR.enum_types_by_name["Level"].values_by_name[event.level.upper()].number
        message = LogMessage(level=number, message=event.text, name=self._scene_name)
        message.timestamp.FromNanoseconds(_nanoseconds(event.moment.time))
        self._add("/events", message.SerializeToString(), event.moment.time, event.moment.step)

    def end(self) -> None:
        self._log.finish()

    def _poses(self, frame: Frame) -> FrameTransforms:
        message = FrameTransforms()
        for kind, series in POSES.items():
            for name, position, (w, *xyz) in zip(self._names[kind], *map(frame.series.get, series), strict=True):
                pose = message.transforms.add(parent_frame_id=WORLD, child_frame_id=name)
                pose.timestamp.FromNanoseconds(_nanoseconds(frame.time))
                pose.translation.x, pose.translation.y, pose.translation.z = position
                pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w = *xyz, w
        return message

    def _facts(self, name: str, shape: tuple[int, ...]) -> dict[str, str]:
        series = describe(name, shape, self._rotary)
        along = {dim: self._names[dim] for dim in series.dims if self._names.get(dim)}
        return {
            "units": series.units,
            "long_name": series.long_name,
            "dims": json.dumps(series.dims),
            "shape": json.dumps(shape),
            "labels": json.dumps(along),
            "columns": json.dumps(column_names(series, shape, along)),
        }

    def _add(self, topic: str, data: bytes, time: float, step: int) -> None:
        self._log.add(topic, data, _nanoseconds(time), step)


def _copy(path: Path, log: LogWriter, keep: dict) -> None:
    """Write the messages of a file up to a `position` to a log, and what of them damage has taken. SceneError where the file
    cannot be read."""
    file = read_file(path)
    sizes = np.cumsum([0, *keep["sizes"]])
    contents = [keep["data"][a:b].tobytes() for a, b in pairwise(sizes)]
    waiting = list(zip(keep["topics"], keep["steps"], keep["stamps"], contents, strict=True))
    facts = {channel.topic: channel.metadata for channel in file.channels.values()}
    found = [(channel.topic, step, stamp, data) for channel, step, stamp, data in entries(file)]
    if whole := not (file.unknown or file.lost) and file.before_gaps() >= keep["closed"]:
        found = found[: keep["closed"]]
    else:  # counts are of no use
        last, end = keep["last"][0], keep["last"][1] * 1e-9
        partial = (log_before := read_log(path)).partial
        known = set(waiting)
        found = [entry for entry in found if entry[1] <= last and entry not in known]
        found = [entry for entry in found if entry[1] not in partial or entry[0] == "/events"]
    for topic, step, stamp, data in (*found, *waiting):
        if not log.opened(topic):
            if topic not in facts:  # with its description, the channel
                continue
            log.open(topic, facts[topic])
        log.add(topic, data, stamp, step)
    if not whole:
        spans = [(after, before) for after, before in log_before.lost if after is None or after < end]
        log.lose([(after, end if before is None else min(before, end)) for after, before in spans])


def rewrite(path: Path) -> tuple[int, bool]:
    """Write a log that a kill or damage has left incomplete anew, with its summary, from what of it can be trusted; number
    of messages, and whether it was whole before. OSError where that fails, and the file is then as it was."""
    file, found = read_file(path), read_log(path)
    if file.complete and not file.damaged:
        return sum(1 for _ in entries(file)), True
    log = LogWriter(_beside(path), file.scene)
    try:
        for channel in file.channels.values():
            log.open(channel.topic, channel.metadata)
        log.lose(found.lost)
        for channel, step, stamp, data in entries(file):
            if step in found.partial and channel.topic != "/events":
                continue
            if not log.opened(channel.topic):
                log.open(channel.topic, channel.metadata)
            log.add(channel.topic, data, stamp, step)
        log.finish()
    except OSError:
        _beside(path).unlink(missing_ok=True)
        raise
    log.move(path)
    tail_of(path).unlink(missing_ok=True)
    return log.count, False


def _beside(path: Path) -> Path:
    return path.with_suffix(".mcap.new")


def _nanoseconds(time: float) -> int:
    return round(time * 1e9)
