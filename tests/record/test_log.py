"""The log of record: everything that goes in comes back, also after a kill; the dataset states its units."""

import contextlib
import errno
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from stand_in import event, frame

from fsi import load_run
from fsi.errors import RunError, SceneError
from fsi.record import mcap_writer
from fsi.record.background import Background, open_recorders
from fsi.record.clock import ClockRecorder
from fsi.record.export import export
from fsi.record.mcap import POSES, McapRecorder
from fsi.record.mcap_file import messages, read_file
from fsi.record.mcap_reader import read_log
from fsi.record.mcap_writer import LogWriter
from fsi.record.run_folder import RunFolder
from fsi.record.series import SERIES
from fsi.scene.file import load_scene

STEPS = 300


@pytest.fixture
def run(scene, flap, tmp_path):
    """A folder with a finished log of 300 steps."""
    folder = RunFolder.choose(scene, tmp_path / "run")
    folder.create(scene)
    recorders = McapRecorder(folder.path / "run.mcap"), ClockRecorder(folder.path / "run.clock")
    for recorder in recorders:
        recorder.begin(scene, flap)
        recorder.event(event("a shallow start", level="warning"))
        for step in range(STEPS):
            recorder.series(frame(step))
        recorder.end()
    folder.write(status="done")
    return folder.path


def test_every_channel_comes_back(run):
    log = read_log(run / "run.mcap")
    t = 0.01 * np.arange(STEPS)
    assert log.complete
    assert log.events == [(0.0, "warning", "a shallow start")]
    np.testing.assert_array_equal(log.time, t)
    np.testing.assert_array_equal(log.step, np.arange(STEPS))
    np.testing.assert_array_equal(log.wall_time, 10 * t)
    first = frame(0)
    assert set(log.variables) == set(first.series)
    for step in range(STEPS):
        given = frame(step)
        for name, value in given.series.items():
            np.testing.assert_array_equal(log.variables[name].values[step], value)


def test_other_tools_can_read_it(run):
    """By the index at its end and the schemas inside it, as Foxglove does."""
    with (run / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        channels = reader.get_summary().channels.values()
        topics = {channel.topic: reader.get_summary().schemas[channel.schema_id].name for channel in channels}
        messages = [m.decoded_message for m in reader.iter_decoded_messages(topics=["/series/elevation"])]
    assert topics["/series/elevation"] == "spindrift.Series"
    assert topics["/tf"] == "foxglove.FrameTransforms"
    assert topics["/events"] == "foxglove.Log"
    assert len(messages) == STEPS
    assert list(messages[7].values) == [0.07, -0.07]
    [elevation] = [channel for channel in channels if channel.topic == "/series/elevation"]
    assert elevation.metadata["units"] == "m"
    assert json.loads(elevation.metadata["columns"]) == ["near", "far"]


@pytest.mark.parametrize("kept", [0.95, 0.5])
def test_killed_run_keeps_all_but_its_last_chunk(run, kept):
    path = run / "run.mcap"
    data = path.read_bytes()
    body = data.index(b"spindrift.Series")  # where the messages begin
    path.write_bytes(data[: body + int(kept * (len(data) - body))])
    log = read_log(path)
    assert not log.complete
    assert len(log.time) > (kept - 0.25) * STEPS  # the index at the end is a tenth of so short a file
    np.testing.assert_array_equal(log.time, 0.01 * np.arange(len(log.time)))
    elevation = log.variables["elevation"].values
    np.testing.assert_array_equal(elevation[:-1, 0], log.time[:-1])


def test_kill_may_fall_anywhere(run):
    path = run / "run.mcap"
    data = path.read_bytes()
    whole = len(read_log(path).time)
    for cut in [*range(1, 60), *range(60, 1500, 97)]:
        path.write_bytes(data[:-cut])
        assert len(read_log(path).time) == whole  # the index at the end is longer than that


def test_log_is_on_disk_while_the_run_goes_on(scene, tmp_path):
    path = tmp_path / "run.mcap"
    recorder = McapRecorder(path)
    recorder.begin(scene, None)
    for step in range(STEPS):
        recorder.series(frame(step, bodies=False))
        if step == 200:
            recorder.tick()
            assert len(read_log(path).time) == 201
    recorder.end()


def test_dataset_has_names_and_units(run):
    dataset = load_run(run)
    for name, variable in dataset.variables.items():
        if name not in dataset.dims and name != "joint_kind" and not name.startswith("novelty"):
            assert variable.attrs["units"], name
            assert variable.attrs["long_name"], name
    assert dataset["body_force"].dims == ("time", "body", "axis")
    assert dataset["body_quaternion"].dims == ("time", "body", "wxyz")
    assert list(dataset["joint"].values) == ["hinge", "heave"]
    assert list(dataset["joint_kind"].values) == ["hinge", "slide"]
    assert dataset["joint_position"].attrs["units"] == "m or rad"
    assert dataset["elevation"].sel(gauge="far", time=0.05).item() == -0.05
    assert dataset["novelty"].shape == (STEPS, 2, 2)
    assert dataset.attrs["scene"] == "small"
    assert dataset.attrs["status"] == "done"
    assert dataset.attrs["width"] == 1.0
    assert list(dataset["event_text"].values) == ["a shallow start"]
    assert (dataset["event_time"].item(), dataset["event_level"].item()) == (0.0, "warning")


def test_table_of_series_is_the_design():
    assert SERIES["body_torque"].units == "N m"
    assert SERIES["joint_force"].rotary_units == "N m"
    assert all(series.units and series.long_name for series in SERIES.values())


def test_export(run):
    xarray = pytest.importorskip("xarray")
    dataset = load_run(run).drop_vars("wall_time")  # which is of the run, not of its result
    netcdf = xarray.load_dataset(export(run, "nc"), engine="h5netcdf")
    xarray.testing.assert_allclose(netcdf, dataset)
    assert netcdf["event_text"].item() == "a shallow start"
    assert netcdf["pressure"].attrs["units"] == "Pa"
    lines = export(run, "csv").read_text().splitlines()
    heads = lines[0].split(",")
    assert len(lines) == STEPS + 1
    assert heads[0] == "time [s]"
    row = dict(zip(heads, map(float, lines[8].split(",")), strict=True))
    assert row["elevation.far [m]"] == -0.07
    assert row["body_position.float.y [m]"] == 0.07
    assert row["joint_position.heave [m or rad]"] == 0.14


def test_what_is_no_run(tmp_path):
    with pytest.raises(SceneError, match="holds no run; give the folder"):
        load_run(tmp_path)


def test_missing_package_is_named_with_its_install_command(scene, tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("fsi.record.timeline", "fsi.record.rrd"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(SceneError) as caught:
        open_recorders(load_scene(scene, ["output.timeline=true", "output.mcap=false"]), tmp_path)
    assert str(caught.value) == (
        "output.timeline = true needs the package 'rerun', which is not installed; "
        "install it with: pip install 'spindrift[viewer]'"
    )


def test_full_disk_ends_the_run(scene):
    recorder = Background([McapRecorder(Path("/dev/full"))])
    with pytest.raises(RunError, match="the disk is full"):
        recorder.begin(scene, None)
        for step in range(STEPS):
            recorder.series(frame(step, bodies=False))
        recorder.end()


def test_stock_reader_reads_every_channel_with_its_schema(scene, flap, tmp_path):
    """Topic by topic with the schemas in the file alone, point clouds among them."""
    scene = load_scene(scene, ["output.cloud=true", "output.fields=['pressure', 'speed']"])
    recorder = McapRecorder(tmp_path / "run.mcap")
    recorder.begin(scene, flap)
    recorder.event(event("slam", 7, "warning"))
    for step in range(20):
        recorder.series(frame(step))
        recorder.particles(frame(step))
    recorder.end()
    with (tmp_path / "run.mcap").open("rb") as file:
        found = {}
        for schema, channel, message, decoded in make_reader(
            file, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            assert message.log_time == round(message.sequence * 1e7)
            found.setdefault((channel.topic, schema.name), []).append(decoded)
    given = [frame(step) for step in range(20)]
    kinds = dict(found)
    for name in given[0].series:
        if name not in {series for pair in POSES.values() for series in pair}:
            messages = kinds.pop((f"/series/{name}", "spindrift.Series"))
            assert [list(m.values) for m in messages] == [list(np.ravel(g.series[name])) for g in given]
            assert [(m.time, m.step) for m in messages] == [(g.time, g.step) for g in given]
    poses = kinds.pop(("/tf", "foxglove.FrameTransforms"))
    for message, g in zip(poses, given, strict=True):
        names = [pose.child_frame_id for pose in message.transforms]
        where = [[p.translation.x, p.translation.y, p.translation.z] for p in message.transforms]
        assert names == ["flap", "float", "crank"]
        assert where == [*g.series["body_position"].tolist(), *g.series["dry_position"].tolist()]
    for message, g in zip(kinds.pop(("/particles", "foxglove.PointCloud")), given, strict=True):
        assert [f.name for f in message.fields] == ["x", "y", "z", "pressure", "speed"]
        rows = np.frombuffer(message.data, np.float32).reshape(-1, message.point_stride // 4)
        np.testing.assert_array_equal(rows[:, [0, 2]], g.position.astype(np.float32))
        np.testing.assert_array_equal(rows[:, 3], g.pressure.astype(np.float32))
        np.testing.assert_allclose(rows[:, 4], np.linalg.norm(g.velocity, axis=1), rtol=1e-6)
    [log] = kinds.pop(("/events", "foxglove.Log"))
    assert (log.message, log.level, log.timestamp.ToNanoseconds()) == ("slam", 3, 70_000_000)
    assert kinds == {}


@pytest.mark.parametrize("room", [0, 3000, 6000])
def test_what_a_full_disk_refuses_leaves_no_hole_in_the_tail(tmp_path, monkeypatch, room):
    """The disk is full when messages are shown, and has room again when the log is closed: nothing is skipped in between."""
    real, left = mcap_writer.write_all, [10_000]

    def write_all(file, data):
        if len(data) > left[0]:
            raise OSError(errno.ENOSPC, "no space")
        real(file, data)

    monkeypatch.setattr(mcap_writer, "write_all", write_all)
    log = LogWriter(tmp_path / "run.mcap", {})
    log.open("/events", {})
    for step in range(90):
        log.add("/events", bytes(range(100)), step, step)
        if step in (30, 60):
            left[0] = 10_000 if step == 30 else room
            with contextlib.suppress(OSError):
                log.show()
    left[0] = 5000
    log._broken = True  # as after a chunk that the disk had no room for
    with contextlib.suppress(OSError):
        log._show_rest()
    log.finish()
    file = read_file(tmp_path / "run.mcap")
    steps = [sequence for _, _, sequence, *_ in messages(file)]
    assert steps == list(range(len(steps))) and len(steps) >= 31 and not file.gaps
