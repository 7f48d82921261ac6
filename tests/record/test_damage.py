"""A damaged log: what is left has its own values, what is lost is said, and there is never a traceback."""

import math
import random
from functools import cache

import numpy as np
import pytest
from stand_in import Flap, event, frame

import fsi
import fsi.resuming
from fsi.errors import SceneError
from fsi.record import mcap_writer
from fsi.record.dataset import damage_of
from fsi.record.export import export
from fsi.record.mcap import McapRecorder, rewrite
from fsi.record.mcap_file import MARK
from fsi.record.mcap_reader import log_complete, read_log
from fsi.record.run_folder import RunFolder
from fsi.record.viewer import recording_of

STEPS, TRIES = 24, 400


@pytest.fixture
def whole(scene, tmp_path, monkeypatch):
    """The folder of a run of 24 frames in several chunks."""
    monkeypatch.setattr(mcap_writer, "CHUNK_BYTES", 4096)
    with RunFolder.choose(scene, tmp_path / "run") as folder:
        folder.create(scene)
        recorder = McapRecorder(folder.path / "run.mcap")
        recorder.begin(scene, Flap())
        for step in range(STEPS):
            recorder.series(frame(step))
            if step % 8 == 0:
                recorder.event(event("on the way", step))
        recorder.end()
        folder.write(status="done", simulated_seconds=0.01 * (STEPS - 1))
    return folder.path


def damaged(data: bytes, dice: random.Random) -> bytes:
    """A bit or a few flipped, the end cut off, a piece cut out, a block of zeros or of noise."""
    kind, at, size = dice.randrange(5), dice.randrange(len(data)), dice.choice((1, 8, 64, 512, 4096))
    if kind == 0:
        out = bytearray(data)
        for _ in range(dice.choice((1, 1, 5))):
            out[dice.randrange(len(out))] ^= 1 << dice.randrange(8)
        return bytes(out)
    if kind == 1:
        return data[:at]
    filling = (b"", bytes(size), dice.randbytes(size))[kind - 2]
    return data[:at] + filling + data[at + size :]


@cache
def written() -> dict[str, np.ndarray]:
    frames = [frame(step) for step in range(STEPS)]
    series = {name: np.array([f.series[name] for f in frames]) for name in frames[0].series}
    return series | {"time": np.array([f.time for f in frames])}


def faults_of(log, manifest) -> list[str]:
    """What is wrong with a reading: values that are not those written, or frames that are missing and not said to be."""
    step, series = log.step, written()
    if not (np.isin(step, np.arange(STEPS)).all() and np.array_equal(log.time, series["time"][step])):
        return [f"times of the steps {step}"]
    faults = [
        f"{name} is another"
        for name, values in series.items()
        if len(step) and name != "time"
        if name not in log.variables or not np.array_equal(log.variables[name].values, values[step])
    ]
    spans = [(-math.inf if a is None else a, math.inf if b is None else b) for a, b in log.lost]
    if not log.closed:  # said by `damage_of`, for the run had ended
        spans.append((log.time[-1] if len(log.time) else -math.inf, math.inf))
    missing = sorted(set(range(STEPS)) - set(log.step.tolist()))
    faults += [f"step {step} is lost in silence" for step in missing if not any(a < 0.01 * step < b for a, b in spans)]
    if missing and not damage_of(log, manifest):
        faults.append("nothing is said")
    return faults


def test_damage_costs_what_it_falls_into_and_is_said(whole, tmp_path):
    data, dice, file = (whole / "run.mcap").read_bytes(), random.Random(19), tmp_path / "damaged.mcap"
    read, kept, refused = 0, 0, []
    for n in range(TRIES):
        file.write_bytes(damaged(data, dice))
        try:
            log = read_log(file)
        except SceneError as fault:
            refused.append(str(fault))
            continue
        assert faults_of(log, {"status": "done"}) == [], n
        read, kept = read + 1, kept + len(log.step)
        if len(log.step) < STEPS:
            assert not log_complete(file), n
    assert all("not an MCAP file" in fault or "is empty" in fault for fault in refused)
    assert read > 0.9 * TRIES and kept > 0.6 * read * STEPS


def test_a_piece_that_is_cut_out_between_two_indices_is_missed(whole, tmp_path):
    """The index of a chunk repeats itself every 16 bytes: two halves of different ones may look like one."""
    data, file = (whole / "run.mcap").read_bytes(), tmp_path / "damaged.mcap"
    second = data.index(MARK, data.index(MARK) + 1)
    begin = second - 200  # within the index before it
    for size in range(1600, 3600, 16):
        file.write_bytes(data[:begin] + data[begin + size :])
        assert faults_of(read_log(file), {"status": "done"}) == [], size


def flipped(folder):
    """The log with a bit flipped in its second chunk, and its bytes."""
    file = folder / "run.mcap"
    data = bytearray(file.read_bytes())
    data[data.index(MARK, data.index(MARK) + 1) + 100] ^= 16
    file.write_bytes(data)
    return file, data


def test_damage_is_told_by_every_door(whole):
    """A bit in the middle of the log: the dataset, the export and `fsi recover` name the times that are missing."""
    file, _ = flipped(whole)
    with pytest.warns(RuntimeWarning, match=r"run.mcap is damaged or cut off.*between t = \S+ and \S+ s"):
        dataset = fsi.load_run(whole)
    assert 0 < dataset.sizes["time"] < STEPS
    with pytest.warns(RuntimeWarning, match="missing"):
        assert export(whole, "csv").is_file()
    assert "between t" in fsi.resuming.recover(whole)
    assert log_complete(file)
    with pytest.warns(
        RuntimeWarning, match=r"missing is what was logged between t"
    ):  # also of the log that is whole again
        np.testing.assert_array_equal(fsi.load_run(whole).time, dataset.time)


def test_a_killed_log_does_without_its_first_chunk_and_its_summary(whole):
    """Where the channels are described; they stand beside the chunks too."""
    file = whole / "run.mcap"
    data = bytearray(file.read_bytes())
    data[data.index(MARK) + 100] ^= 16
    file.write_bytes(data[: 3 * len(data) // 4])
    log = read_log(file)
    assert faults_of(log, {"status": "killed"}) == [] and len(log.step) > 3 and log.lost[0][0] is None
    assert rewrite(file)[1] is False and log_complete(file)
    assert np.array_equal(read_log(file).step, log.step)


def test_facts_on_the_scene_come_from_its_file_where_the_log_has_lost_them(whole):
    file = whole / "run.mcap"
    data = file.read_bytes()
    file.write_bytes(data.replace(b"spacing", b"spacinG"))
    with pytest.warns(RuntimeWarning, match=r"taken from scene.toml"):
        dataset = fsi.load_run(whole)
    assert (dataset.attrs["spacing"], dataset.attrs["width"], dataset.attrs["scene"]) == (0.02, 1.0, "small")
    assert dataset.sizes["time"] == STEPS


def test_a_run_goes_on_from_a_damaged_log_which_says_what_it_lacks(whole, scene, tmp_path):
    """The messages beyond the damage are kept, those that had no chunk yet come from the checkpoint, and the loss is told."""
    recorder = McapRecorder(tmp_path / "run.mcap")
    recorder.begin(scene, Flap())
    for step in range(STEPS - 2):
        recorder.series(frame(step))
    position = recorder.position()["messages"]
    file, _ = flipped(whole)
    lost = read_log(file).lost
    again = McapRecorder(file, keep=position)
    again.begin(scene, Flap())
    for step in range(STEPS - 2, STEPS):
        again.series(frame(step))
    again.end()
    log = read_log(file)
    assert log_complete(file) and log.lost == lost
    assert faults_of(log, {"status": "done"}) == [] and {0, STEPS - 3, STEPS - 1} <= set(log.step.tolist()) < set(
        range(STEPS)
    )


def test_a_log_that_goes_on_has_the_bytes_of_one_that_was_never_stopped(scene, tmp_path, monkeypatch):
    """Stopped with a chunk that is open, in the middle of what a kill leaves, and also after it was completed by `rewrite`."""
    monkeypatch.setattr(mcap_writer, "CHUNK_BYTES", 4096)
    position, whole = None, tmp_path / "whole.mcap"
    recorder = McapRecorder(whole)
    recorder.begin(scene, Flap())
    for step in range(STEPS):
        recorder.series(frame(step))
        recorder.tick()
        if step == STEPS // 2:
            position = recorder.position()["messages"]
        if step == STEPS - 2:
            for suffix in ("", ".tail"):
                (tmp_path / f"cut.mcap{suffix}").write_bytes((tmp_path / f"whole.mcap{suffix}").read_bytes())
    recorder.end()
    assert position["data"].size and not (tmp_path / "whole.mcap.tail").exists()
    assert read_log(tmp_path / "cut.mcap").step.tolist() == list(range(STEPS - 1))
    for complete in (False, True):
        if complete:
            rewrite(tmp_path / "cut.mcap")
        (tmp_path / "again.mcap").write_bytes((tmp_path / "cut.mcap").read_bytes())
        again = McapRecorder(tmp_path / "again.mcap", keep=position)
        again.begin(scene, Flap())
        for step in range(STEPS // 2 + 1, STEPS):
            again.series(frame(step))
        again.end()
        assert (tmp_path / "again.mcap").read_bytes() == whole.read_bytes()


def test_rewriting_leaves_a_whole_log_alone(whole):
    data = (whole / "run.mcap").read_bytes()
    assert rewrite(whole / "run.mcap")[1]
    assert (whole / "run.mcap").read_bytes() == data


def test_run_without_a_frame_says_so(scene, tmp_path):
    with RunFolder.choose(scene, tmp_path / "run") as folder:
        folder.create(scene)
        recorder = McapRecorder(folder.path / "run.mcap")
        recorder.begin(scene, None)
        recorder.end()
        folder.write(status="failed", reason="unstable")
    assert fsi.load_run(folder.path).sizes["time"] == 0
    for to in ("nc", "csv"):
        with pytest.raises(SceneError, match=r"without a single frame \(status failed\)"):
            export(folder.path, to)
    (folder.path / "run.rrd").write_bytes(b"some layout")
    with pytest.raises(SceneError, match="without a single frame"):
        recording_of(folder.path)
    (folder.path / "run.mcap").write_bytes(b"")
    with pytest.raises(SceneError, match="is empty"):
        fsi.load_run(folder.path)
