"""What the writer and the reader of `run.mcap` agree on."""

from __future__ import annotations

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

CHUNK_BYTES = 64 * 1024  # before compression: about forty frames of a scene with one body
POSES = {"body": ("body_position", "body_quaternion"), "dry_body": ("dry_position", "dry_quaternion")}  # are on /tf


def _series_message(clock: bool = False):
    """The message class spindrift.Series: time [s], step and the values in C order; in older logs the wall time [s] too."""
    file = FileDescriptorProto(name="spindrift/Series.proto", package="spindrift", syntax="proto3")
    message = file.message_type.add(name="Series")
    field = FieldDescriptorProto
    fields = [("time", field.TYPE_DOUBLE), ("step", field.TYPE_INT64)] + clock * [("wall_time", field.TYPE_DOUBLE)]
    for number, (name, kind) in enumerate(fields, 1):
        message.field.add(name=name, number=number, type=kind, label=field.LABEL_OPTIONAL)
    message.field.add(name="values", number=4, type=field.TYPE_DOUBLE, label=field.LABEL_REPEATED)
    pool = DescriptorPool()
    pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName("spindrift.Series"))


SeriesMessage = _series_message()
OldSeriesMessage = _series_message(clock=True)
