"""The log of record, `run.mcap`: every time series, the body poses and the events, as typed protobuf messages.

Topics: `/series/NAME` (spindrift.Series; units, names and dimensions in the channel's metadata), `/tf`
(foxglove.FrameTransforms, the centres of mass of all moving bodies, wet and dry), `/events` (foxglove.Log), `/particles`
(foxglove.PointCloud) with `output.cloud`. The log time is the simulated time, the sequence number the step. Chunks are
small, and closed after a second of wall time at the latest, so that a killed run loses no more than that.
"""

from __future__ import annotations

import json
import os
import time as clock
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from mcap.well_known import MessageEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from fsi.protocols import BodySet, Event, Frame
from fsi.record.fields import spatial, values
from fsi.record.mcap_format import CHUNK_BYTES, POSES, SeriesMessage
from fsi.record.mcap_reader import messages
from fsi.record.series import column_names, describe, labels
from fsi.scene.fields import field_of
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene

WAIT = 1.0  # wall time [s] after which a chunk is closed though it is small, so that a kill costs no more
WORLD = "world"


class McapRecorder:
    """Writes `run.mcap`; OSError where the file cannot be written.

    With `keep` it goes on after so many messages of the file that is there: they are written anew by the same calls as the
    first time, so that the whole log is the one of a run that was never stopped.
    """

    def __init__(self, path: Path, keep: int | None = None):
        self._path, self._keep, self._count = path, keep, 0
        self._open_since: float | None = None  # wall time of the oldest message that is not in the file yet

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        self._names = labels(scene, bodies)
        self._rotary = tuple(bodies.joint_is_rotary) if bodies else ()
        self._scene_name, self._cloud = scene.name, scene.output.fields if scene.output.cloud else ()
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        new = self._path if self._keep is None else self._path.with_suffix(".mcap.new")
        self._file = new.open("wb")
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES)
        self._writer.start(profile="", library="spindrift")
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
        self._writer.add_metadata("scene", facts)
        if self._keep is not None:
            self._repeat()
            self._settle()
            os.replace(new, self._path)
        self._file.flush()

    def _repeat(self) -> None:
        """Write the messages anew that the file holds."""
        kinds = {"/tf": FrameTransforms, "/events": LogMessage, "/particles": PointCloud}
        for channel, message in messages(self._path):
            if self._count == self._keep:
                break
            if channel.topic not in self._channels:
                self._open(channel.topic, kinds.get(channel.topic, SeriesMessage), channel.metadata)
            self._put(self._channels[channel.topic], message.log_time, message.data, message.sequence)
        if self._count < self._keep:
            raise OSError(f"{self._path} holds {self._count} messages where the checkpoint has {self._keep}")

    def position(self) -> dict[str, int]:
        """Messages so far, all of which are on the disk when this returns."""
        self._settle()
        os.fsync(self._file.fileno())
        return {"messages": self._count}

    def tick(self) -> None:
        """Called about every second: what has waited for so long goes into the file."""
        if self._open_since is not None and clock.monotonic() - self._open_since > WAIT:
            self._settle()

    def _settle(self) -> None:
        self._writer.flush()  # closes the chunk
        self._file.flush()
        self._open_since = None

    def series(self, frame: Frame) -> None:
        stamp = SeriesMessage(time=frame.time, step=frame.step, wall_time=frame.wall_time).SerializeToString()
        for name, value in frame.series.items():
            if any(name in pair for pair in POSES.values()) or np.size(value) == 0:
                continue
            topic = f"/series/{name}"
            if topic not in self._channels:
                self._open(topic, SeriesMessage, self._facts(name, np.shape(value)))
            values = SeriesMessage(values=np.ravel(value).tolist()).SerializeToString()
            self._add(topic, stamp + values, frame.time, frame.step)  # protobuf joins the two
        if frame.series.keys() >= set(POSES["body"]):
            if "/tf" not in self._channels:
                self._open("/tf", FrameTransforms, {kind: json.dumps(self._names[kind]) for kind in POSES})
            self._add("/tf", self._poses(frame).SerializeToString(), frame.time, frame.step)
        self._file.flush()

    def particles(self, frame: Frame) -> None:
        """The particles as a point cloud of x, y, z and the fields of the scene, all float32, where `output.cloud` asks
        for it; else they are on the timeline alone."""
        if not self._cloud:
            return
        names = ("x", "y", "z", *self._cloud)
        if "/particles" not in self._channels:
            units = {"units": json.dumps({n: field_of(n).units for n in self._cloud} | dict.fromkeys("xyz", "m"))}
            self._open("/particles", PointCloud, units)
        columns = [*spatial(frame.position).T, *(values(frame, name) for name in self._cloud)]
        rows = np.ascontiguousarray(np.stack(columns, axis=1), np.float32)
        message = PointCloud(frame_id=WORLD, point_stride=4 * len(names), data=rows.tobytes())
        message.timestamp.FromNanoseconds(_nanoseconds(frame.time))
        message.pose.orientation.w = 1.0
        for n, name in enumerate(names):
            message.fields.add(name=name, offset=4 * n, type=PackedElementField.FLOAT32)
        self._add("/particles", message.SerializeToString(), frame.time, frame.step)
        self._file.flush()

    def event(self, event: Event) -> None:
        if "/events" not in self._channels:
            self._open("/events", LogMessage, {})
        number = LogMessage.DESCRIPTOR.enum_types_by_name["Level"].values_by_name[event.level.upper()].number
        message = LogMessage(level=number, message=event.text, name=self._scene_name)
        message.timestamp.FromNanoseconds(_nanoseconds(event.moment.time))
        self._add("/events", message.SerializeToString(), event.moment.time, event.moment.step)
        self._file.flush()

    def end(self) -> None:
        try:
            self._writer.finish()
        finally:
            self._file.close()

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

    def _open(self, topic: str, kind: type, facts: dict[str, str]) -> None:
        name = kind.DESCRIPTOR.full_name
        if name not in self._schemas:
            self._schemas[name] = register_schema(self._writer, kind)
        schema = self._schemas[name]
        self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.Protobuf, schema, facts)

    def _add(self, topic: str, data: bytes, time: float, step: int) -> None:
        self._put(self._channels[topic], _nanoseconds(time), data, step)

    def _put(self, channel: int, stamp: int, data: bytes, step: int) -> None:
        self._writer.add_message(channel, stamp, data, stamp, sequence=step)
        self._count += 1
        self._open_since = self._open_since or clock.monotonic()


def _nanoseconds(time: float) -> int:
    return round(time * 1e9)
