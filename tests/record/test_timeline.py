"""The timeline: what is in the recording, by name, and that its colours mean the same in every frame."""

import numpy as np
import pytest
from stand_in import event, frame

rerun = pytest.importorskip("rerun")

from fsi.record import timeline  # noqa: E402
from fsi.record.colours import colour_map, packed  # noqa: E402
from fsi.record.fields import levels, top  # noqa: E402
from fsi.record.rrd_bytes import whole_bytes  # noqa: E402
from fsi.record.timeline import TimelineRecorder  # noqa: E402


@pytest.fixture
def chunks(scene, flap, tmp_path):
    """Entity path -> chunks of a recording of 120 series frames and 12 frames of particles."""
    recorder = TimelineRecorder(tmp_path / "run.rrd")
    recorder.begin(scene, flap)
    recorder.event(event("start"))
    for step in range(120):
        recorder.series(frame(step))
        if step % 10 == 0:
            recorder.particles(frame(step))
    recorder.end()
    found = {}
    for chunk in rerun.chunk.RrdReader(tmp_path / "run.rrd").stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk)
    return found


def rows(chunks, entity: str) -> int:
    return sum(chunk.num_rows for chunk in chunks[entity])


def test_everything_is_on_the_timeline(chunks):
    fixed = ["/world/tank", "/world/gauges", "/world/probes", "/world/bodies/flap/plate", "/world/fixed/ramp"]
    assert set(fixed) | {"/world/bodies/crank/arm", "/legend/pressure/bar", "/legend/pressure/labels"} <= set(chunks)
    assert rows(chunks, "/world/fluid") == 12 + 1  # and the colours
    assert rows(chunks, "/world/bodies/float") == 120
    assert rows(chunks, "/world/bodies/crank") == 120
    assert rows(chunks, "/world/loads/float/force") == 120 + 1  # and its colour
    assert rows(chunks, "/events") == 1
    for name in frame(0).series:
        assert rows(chunks, f"/series/{name}") == 120 + 1  # and the names of its lines


def test_timelines_are_ours_alone(chunks):
    names = {name for chunk in chunks["/world/fluid"] for name in chunk.timeline_names}
    assert names == {"sim_time", "step"}


def test_full_disk_is_told(scene, tmp_path):
    """At once, at the start and within the run; what is in the file then is whole."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for limit in (1000, 300_000):
        recorder = TimelineRecorder(tmp_path / f"{limit}.rrd")
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
        try:
            with pytest.raises(OSError, match="File too large"):
                recorder.begin(scene, None)
                for step in range(1000):
                    recorder.particles(frame(step, bodies=False))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert whole_bytes(tmp_path / f"{limit}.rrd") == (tmp_path / f"{limit}.rrd").stat().st_size


def test_a_timeline_that_goes_on_has_the_bytes_of_one_that_was_never_stopped(scene, flap, tmp_path, monkeypatch):
    """With frames that wait for their batch, and with a file that a kill has left longer than the checkpoint knows."""
    monkeypatch.setattr(timeline, "BUFFERED_FRAMES", 8)

    def log(recorder, first: int, last: int) -> None:
        for step in range(first, last):
            recorder.series(frame(step))
            if step % 5 == 0:
                recorder.event(event("on the way", step))
                recorder.particles(frame(step))

    one, two = (TimelineRecorder(tmp_path / name) for name in ("one.rrd", "two.rrd"))
    for recorder in (one, two):
        recorder.begin(scene, flap)
    log(one, 0, 30)
    one.end()
    log(two, 0, 13)
    position = two.position()["timeline"]
    log(two, 13, 20)
    again = TimelineRecorder(tmp_path / "two.rrd", keep=position)
    again.begin(scene, flap)
    log(again, 13, 30)
    again.end()
    assert len(position["time"]) == 5
    assert (tmp_path / "two.rrd").read_bytes() == (tmp_path / "one.rrd").read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["one.rrd", "two.rrd"]


def test_colours_have_one_range(scene):
    assert top(scene, "pressure") == pytest.approx(1000 * 9.81 * 0.5)
    assert top(scene, "speed") == pytest.approx(0.5 * (9.81 * 0.5) ** 0.5)
    given = frame(0)
    given.pressure = np.array([-5.0, 0.0, 500 * 9.81 * 0.5, 1e9, np.nan])
    assert list(levels(given, "pressure", scene)) == [0, 0, 127, 255, 0]


def test_colour_map_gets_evenly_lighter():
    colours = colour_map()
    luminance = (colours / 255) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    lightness = np.cbrt(luminance)
    steps = np.diff(lightness[::15])
    assert (steps > 0).all()
    assert steps.max() < 2 * steps.min()
    assert packed(np.array([[1, 2, 3]], np.uint8))[0] == 0x010203FF


def test_recording_that_is_taken_away_is_told(scene, tmp_path):
    recorder = TimelineRecorder(tmp_path / "run.rrd")
    recorder.begin(scene, None)
    recorder.tick()
    (tmp_path / "run.rrd").unlink()
    with pytest.raises(OSError, match="removed while the run went on"):
        recorder.tick()
    with pytest.raises(OSError, match="removed while the run went on"):
        recorder.end()
