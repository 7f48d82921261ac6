"""Checkpoints: whole or not there, and a resumed run that is the same as one that was never stopped."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import fsi
from fsi.errors import SceneError
from fsi.record.manifest import liveness, process
from fsi.record.run_folder import RunFolder
from fsi.resuming import differences, recover
from fsi.simulation import checkpoint

sys.path.insert(0, str(Path(__file__).parent))
from small_scenes import load

STATE = {
    "a": np.arange(6, dtype=np.float32).reshape(2, 3),
    "empty": np.zeros((0, 2)),
    "deep": {"numbers": [1, 2.5, float("inf"), float("nan"), np.float64(-0.0)], "text": "x", "none": None, "yes": True},
}
FACTS = {"scene": "spacing = 1\n", "versions": {"numpy": "1"}, "time": 0.1, "step": 3, "log": {}}


def test_a_state_comes_back_bit_for_bit(tmp_path):
    file = tmp_path / "1.checkpoint"
    size = checkpoint.write(file, FACTS, STATE)
    facts, state = checkpoint.read(file)
    assert facts == FACTS and size == file.stat().st_size and list(tmp_path.iterdir()) == [file]
    assert state["a"].dtype == np.float32 and (state["a"] == STATE["a"]).all() and state["empty"].shape == (0, 2)
    numbers = state["deep"].pop("numbers")
    assert state["deep"] == {"text": "x", "none": None, "yes": True}
    assert numbers[:3] == [1, 2.5, float("inf")] and numbers[3] != numbers[3]
    assert isinstance(numbers[4], np.float64) and np.signbit(numbers[4])


def test_a_damaged_checkpoint_is_refused(tmp_path):
    file = tmp_path / "1.checkpoint"
    checkpoint.write(file, FACTS, STATE)
    whole = file.read_bytes()
    for place in range(0, len(whole), 7):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(SceneError):
            checkpoint.read(file)
        file.write_bytes(whole[:place])
        with pytest.raises(SceneError):
            checkpoint.read(file)


def test_objects_are_no_state(tmp_path):
    with pytest.raises(TypeError):
        checkpoint.write(tmp_path / "1.checkpoint", FACTS, {"a": np.array([object()])})


def test_another_scene_or_version_is_refused_with_the_difference():
    here = {"scene": "spacing = 2\n", "versions": {"numpy": "2"}}
    assert differences(FACTS, here) == ["numpy was 1, is 2", "scene.toml: -spacing = 1", "scene.toml: +spacing = 2"]


def test_a_dead_run_is_told_from_a_running_one():
    facts = {"status": "running", **process()}
    assert liveness(facts) == "running"
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert liveness(facts | {"pid": child.pid}) == "killed"
    assert liveness(facts | {"host": "elsewhere", "heartbeat": "2020-01-01T00:00:00+00:00"}) == "killed"


def stop_at(monkeypatch, step):
    """Send this process SIGTERM once a run has taken so many steps."""
    from fsi.simulation.loop import Simulation

    real = Simulation.step

    def stepped(self, *until):
        real(self, *until)
        if self.step_count == step:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.1)

    monkeypatch.setattr(Simulation, "step", stepped)


@pytest.mark.parametrize("name", ["sea", "flap_latching", "layers"])
def test_a_resumed_run_is_the_one_that_was_never_stopped(name, tmp_path, monkeypatch):
    scene = load(name, tmp_path, "output.series=0.01", "output.particles=0.05", "output.timeline=false", "duration=0.4")
    whole = fsi.run(scene, out=tmp_path / "whole", threads=1, quiet=True).load()
    with monkeypatch.context() as patch:
        stop_at(patch, 12)
        stopped = fsi.run(scene, out=tmp_path / "cut", threads=1, quiet=True)
    assert (stopped.status, stopped.steps, stopped.exit_code) == ("interrupted", 12, 143)
    assert stopped.load().attrs["log_complete"]
    with pytest.raises(SceneError, match="fsi resume"):
        RunFolder.choose(scene, tmp_path / "cut")
    done = fsi.resume(tmp_path / "cut", threads=2, quiet=True)
    assert done.status == "done"
    resumed = done.load()
    for variable in set(whole.variables) - {"wall_time"}:
        assert np.array_equal(whole[variable], resumed[variable], equal_nan=whole[variable].dtype.kind == "f"), variable
    facts = json.loads((tmp_path / "cut/run.json").read_text())
    assert (
        facts["resumed"][0]["step"] == 12
        and facts["audit"] == json.loads((tmp_path / "whole/run.json").read_text())["audit"]
    )
    with pytest.raises(SceneError, match="done"):
        fsi.resume(tmp_path / "cut")


def test_what_cannot_be_resumed_says_why(tmp_path):
    with pytest.raises(SceneError, match="holds no run"):
        fsi.resume(tmp_path)
    scene = load("layers", tmp_path, "output.checkpoint=0", "duration=0.02", "output.timeline=false")
    folder = fsi.run(scene, out=tmp_path / "run", threads=1, quiet=True).folder
    facts = json.loads((folder / "run.json").read_text())
    elsewhere = {"status": "running", **process(), "host": "elsewhere"}
    for change, said in ((elsewhere, "going on"), ({"status": "failed"}, "no checkpoint")):
        (folder / "run.json").write_text(json.dumps(facts | change))
        with pytest.raises(SceneError, match=said):
            fsi.resume(folder)
    with RunFolder.open(folder), pytest.raises(SceneError, match="in use by another process"):
        fsi.resume(folder)


def test_recover_completes_a_log_that_was_cut_off(tmp_path):
    scene = load("layers", tmp_path, "output.series=0.005", "duration=0.1", "output.timeline=false")
    folder = fsi.run(scene, out=tmp_path / "run", threads=1, quiet=True).folder
    log = folder / "run.mcap"
    log.write_bytes(log.read_bytes()[:-300])
    before = fsi.load_run(folder)
    assert not before.attrs["log_complete"] and "now complete" in recover(folder)
    after = fsi.load_run(folder)
    assert after.attrs["log_complete"] and after.sizes["time"] == before.sizes["time"]
    from mcap.reader import make_reader

    with log.open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count > 0
    assert "was complete" in recover(folder)


STUCK = """
import time, fsi
from fsi.simulation.loop import Simulation
real = Simulation.step
def step(self, *until):
    real(self, *until)
    if self.step_count == 5:
        print("stuck", flush=True)
        time.sleep(1e-3)
        while True:  # a step that takes for ever; Python's own handlers do not run in the midst of it
            sum(range(10**6))
Simulation.step = step
fsi.run("dam_break", overrides=["spacing=0.1", "output.timeline=false"], out="stuck", threads=1, quiet=True)
"""


def test_a_signal_ends_a_run_within_two_seconds_also_within_a_step(tmp_path):
    child = subprocess.Popen([sys.executable, "-c", STUCK], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "stuck\n"
    child.send_signal(signal.SIGTERM)
    assert child.wait(timeout=20) == 143
    data = fsi.load_run(tmp_path / "stuck")
    assert data.attrs["status"] == "interrupted" and data.attrs["log_complete"] and data.sizes["time"] >= 3
