"""Recording beside the run: in order, from copies, within bounded memory, and with its faults told."""

import threading

import numpy as np
import pytest
from stand_in import event, frame

from fsi.errors import RunError
from fsi.record import background
from fsi.record.background import QUEUE_LENGTH, Background
from fsi.scene import check_effect


class Memory:
    """Keeps what it is given; waits for `go` before each series frame."""

    def __init__(self):
        self.calls, self.go = [], threading.Semaphore(0)

    def begin(self, scene, bodies):
        self.calls.append("begin")

    def series(self, given):
        self.go.acquire()
        self.calls.append(given)

    def particles(self, given):
        self.calls.append(given)

    def event(self, given):
        self.calls.append(given.text)

    def end(self):
        self.calls.append("end")


def test_frames_are_copies_in_order(scene):
    memory = Memory()
    recorder = Background([memory])
    recorder.begin(scene, None)
    given = frame(3)
    recorder.series(given)
    recorder.particles(given)
    recorder.event(event("hello"))
    given.series["elevation"][:] = -9
    given.position[:] = -9
    memory.go.release()
    recorder.end()
    recorder.end()
    first, series, particles, *rest = memory.calls
    assert [first, *rest] == ["begin", "hello", "end"]
    np.testing.assert_array_equal(series.series["elevation"], frame(3).series["elevation"])
    assert series.position is None
    assert particles.position.dtype == np.float32
    np.testing.assert_array_equal(particles.position, frame(3).position.astype(np.float32))


def test_run_waits_for_a_slow_writer(scene, monkeypatch):
    monkeypatch.setattr(background, "BATCH", 1)
    memory = Memory()
    recorder = Background([memory])
    recorder.begin(scene, None)
    handed = []

    def work():
        for step in range(3 * QUEUE_LENGTH):
            recorder.series(frame(step))
            handed.append(step)

    worker = threading.Thread(target=work)
    worker.start()
    worker.join(0.3)
    assert len(handed) == QUEUE_LENGTH + 1  # and one that the writer holds
    memory.go.release(3 * QUEUE_LENGTH)
    worker.join()
    recorder.end()
    assert len(memory.calls) == 3 * QUEUE_LENGTH + 2


def test_fault_of_the_writer_is_raised_in_the_run(scene):
    memory = Memory()
    memory.particles = None  # calling it fails
    recorder = Background([memory])
    recorder.begin(scene, None)
    recorder.particles(frame(0))
    with pytest.raises(RunError, match="the log could not be written"):
        for step in range(1000):
            recorder.event(event("on", step))
        recorder.end()
    assert "end" not in memory.calls or memory.calls[-1] == "end"


def test_a_run_goes_on_without_the_viewer_and_says_so(scene, tmp_path, monkeypatch):
    for module in (background, check_effect):
        monkeypatch.setattr(module, "installed", lambda name: False)
    silent, output = scene, scene.output.model_copy(update={"timeline": True})
    scene = scene.model_copy(update={"output": output})
    [told] = check_effect.no_timeline(scene)
    assert "no timeline" in told and "pip install 'spindrift[viewer]'" in told
    [recorder] = background.open_recorders(scene, tmp_path)
    names = [type(one).__name__ for one in recorder._recorders]
    assert "McapRecorder" in names and "TimelineRecorder" not in names
    assert check_effect.no_timeline(silent) == []
