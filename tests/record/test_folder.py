"""One run, one folder: nothing is written over, nobody shares it, and what happens to it while a run goes on is told."""

import errno
import json
import math
import os
import shutil
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import pytest
from stand_in import frame
from test_command import command, here, manifest  # noqa: F401 fixture

import fsi
from fsi.compute import jit
from fsi.errors import RunError, SceneError
from fsi.record import background
from fsi.record.background import Background
from fsi.record.files import Claim, new_file
from fsi.record.manifest import liveness, process, read_manifest
from fsi.record.mcap import McapRecorder
from fsi.record.mcap_reader import read_log
from fsi.record.run_folder import RunFolder
from fsi.simulation import logged

HOLDS = """
import sys, time
from fsi.record.run_folder import RunFolder
from fsi.scene.file import load_scene
with RunFolder.choose(load_scene("small.toml"), sys.argv[1]) as folder:
    print("held", flush=True)
    sys.stdin.readline()
"""


def test_two_processes_do_not_share_a_folder(here, solver, scene):  # noqa: F811
    other = subprocess.Popen(
        [sys.executable, "-c", HOLDS, "mine"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout.readline() == "held\n"
    result = command("run", "small.toml", "--out", "mine", "--quiet")
    assert (result.exit_code, result.stderr) == (
        2,
        "--out: another process is at work in mine; wait for it, or choose another folder\n",
    )
    other.communicate("\n")
    assert not (here / "mine").exists()  # it was made for nothing
    assert command("run", "small.toml", "--out", "mine", "--quiet").exit_code == 0
    with RunFolder.open("mine"), pytest.raises(SceneError, match="mine is in use by another process"):
        RunFolder.open("mine")
    assert not (here / "mine" / "run.lock").exists()


def test_two_runs_that_start_together_take_two_folders(here, scene):  # noqa: F811
    with RunFolder.choose(scene) as first, RunFolder.choose(scene) as second:
        assert [first.path.name, second.path.name] == ["small", "small-2"]
    assert not (here / "runs").exists()


@pytest.mark.parametrize("out", [".", "..", "/dev/full", "small.toml", "notes", "x" * 5000, "~no_such_user/x"])
def test_what_is_not_ours_is_left_alone(here, solver, out):  # noqa: F811
    (here / "notes").mkdir()
    (here / "notes" / "notes.txt").write_text("mine")
    before = {path: path.stat().st_mtime_ns for path in here.rglob("*")}
    result = command("run", "small.toml", "--out", out, "--quiet")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and len(result.stderr) < 500, result.output
    assert result.stderr.startswith("--out: ") and "choose another folder" in result.stderr
    assert before == {path: path.stat().st_mtime_ns for path in here.rglob("*")}


def test_an_empty_folder_and_the_inputs_of_a_study_are_no_hindrance(here, solver):  # noqa: F811
    (here / "empty" / "inputs").mkdir(parents=True)
    assert command("run", "small.toml", "--out", "empty", "--quiet").exit_code == 0


def test_names_of_dots_are_refused(here, solver):  # noqa: F811
    result = command("run", "small.toml", "--set", "name=..", "--quiet")
    assert (result.exit_code, "is no name of a folder" in result.stderr) == (2, True)


def test_a_failed_run_with_a_checkpoint_names_resume(here, solver):  # noqa: F811
    solver.fails_at = 0.3
    command("run", "small.toml", "--quiet")
    (here / "runs/small/checkpoints").mkdir()
    (here / "runs/small/checkpoints/1.checkpoint").touch()
    again = command("run", "small.toml", "--out", "runs/small")
    assert "which failed; go on with `fsi resume runs/small`" in again.stderr


def remove(folder):
    while folder.exists():  # the recorder may put a file there meanwhile
        shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.parametrize("harm", ["log", "replaced", "folder"])
def test_log_that_vanishes_ends_the_run(here, solver, monkeypatch, harm):  # noqa: F811
    monkeypatch.setattr(background, "TICK", 0.01)
    run, path = solver.run, here / "runs" / "small"

    def and_harm(self, until, on_step):
        def step(sim):
            if sim.step_count == 50:
                shutil.rmtree(path) if harm == "folder" else (path / "run.mcap").unlink()
                if harm == "replaced":
                    (path / "run.mcap").write_text("something else")
            on_step(sim)

        run(self, until, step)

    monkeypatch.setattr(solver, "run", and_harm)
    result = command("run", "small.toml", "--quiet")
    assert result.exit_code == 1, result.stderr
    what = "replaced" if harm == "replaced" else "removed"
    assert f"run.mcap: the file was {what} while the run went on" in result.stderr
    if harm != "folder":
        assert manifest(path)["status"] == "failed" and what in manifest(path)["reason"]


def test_folder_that_becomes_read_only_ends_the_run(here, solver, monkeypatch):  # noqa: F811
    monkeypatch.setattr(logged, "BEAT", 0.001)
    run, replace = solver.run, os.replace

    def refused(source, target):
        if Path(target).name == "run.json":
            raise OSError(errno.EROFS, "Read-only file system")
        replace(source, target)

    def and_harm(self, until, on_step):
        def step(sim):
            if sim.step_count == 2:
                monkeypatch.setattr(os, "replace", refused)
            time.sleep(0.002)
            on_step(sim)

        run(self, until, step)

    monkeypatch.setattr(solver, "run", and_harm)
    with pytest.raises(RunError, match="can no longer be written: Read-only file system"):
        fsi.run("small.toml", quiet=True)
    assert not list((here / "runs/small").glob("*.new"))


def test_no_file_is_left_half_written(tmp_path):
    (tmp_path / "a.txt").write_text("before")
    with pytest.raises(OSError), new_file(tmp_path / "a.txt") as new:
        new.write_text("half")
        raise OSError
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"a.txt": "before"}


def test_manifest_is_strict_and_reads_back(here, scene):  # noqa: F811
    def refused(name):
        raise AssertionError(name)

    with RunFolder.choose(scene, "run") as folder:
        folder.create(scene)
        folder.write(audit={"a": math.nan, "b": [1.5, -math.inf]}, reason="NaN", status="failed")
    json.loads((here / "run/run.json").read_text(), parse_constant=refused)
    facts = read_manifest("run")
    assert math.isnan(facts["audit"]["a"]) and facts["audit"]["b"] == [1.5, -math.inf] and facts["reason"] == "NaN"


def test_a_lock_tells_a_dead_run_from_one_whose_number_another_process_has():
    facts = {"status": "running"} | process()
    assert (liveness(facts), liveness(facts, claimed=True)) == ("running", "killed")


def test_a_lock_is_waited_for(tmp_path):
    first, second, got = Claim(tmp_path / "lock"), Claim(tmp_path / "lock"), []
    assert first.take() and not second.take()
    waiter = threading.Thread(target=lambda: got.append(second.take(wait=True)))
    waiter.start()
    first.drop()
    waiter.join(10)
    assert got == [True]
    second.drop()
    assert list(tmp_path.iterdir()) == []


def test_frames_reach_the_file_also_while_news_keep_coming(scene, tmp_path, monkeypatch):
    """What waits is brought there though the writer is never idle."""
    monkeypatch.setattr(background, "TICK", 0.0)
    monkeypatch.setattr(background, "BATCH", 1)
    recorder = Background([McapRecorder(tmp_path / "run.mcap")])
    recorder.begin(scene, None)
    for step in range(5):
        recorder.series(frame(step, bodies=False))
    recorder._queue.put([])  # news without content: what came before has been dealt with when the next is taken
    while not recorder._queue.empty():
        time.sleep(0.01)
    assert len(read_log(tmp_path / "run.mcap").step) >= 4
    recorder.end()


def test_warnings_of_libraries_go_into_the_log(here, solver, monkeypatch):  # noqa: F811
    run = solver.run

    def and_warn(self, until, on_step):
        def step(sim):
            if sim.step_count == 7:
                warnings.warn("an odd\nmatrix", RuntimeWarning, stacklevel=1)
            on_step(sim)

        run(self, until, step)

    monkeypatch.setattr(solver, "run", and_warn)
    with pytest.warns(RuntimeWarning, match="odd"):
        fsi.run("small.toml", quiet=True)
    assert "RuntimeWarning: an odd matrix" in list(fsi.load_run("runs/small").event_text.values)


@pytest.mark.parametrize(
    "arguments", [("run",), ("check",), ("view",), ("export",), ("report",), ("resume",), ("sweep",)]
)
@pytest.mark.parametrize("path", ["x" * 5000, "x/" * 2500, "~no_such_user/x"])
def test_paths_that_no_system_has_are_one_line(here, arguments, path):  # noqa: F811
    result = command(*arguments, path)
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and len(result.stderr) < 700, result.output


def test_threads_that_are_refused_are_one_line(here, monkeypatch):  # noqa: F811
    def refused(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refused)
    result = command("run", "small.toml", "--threads", "4", "--quiet")
    fix = "use fewer, or raise the limit of processes (ulimit -u)"
    text = f"--threads: the system refuses 4 threads: can't start new thread; {fix}\n"
    assert (result.exit_code, result.stderr) == (2, text)
    assert not (here / "runs").exists()


def test_compiled_code_has_a_place_of_its_own_where_nothing_can_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(jit.config, "CACHE_DIR", "")
    assert jit.place_cache(tmp_path) == ""
    monkeypatch.setattr(jit, "_can_write", lambda folder: False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    note, place = jit.place_cache(tmp_path), Path(jit.config.CACHE_DIR)
    assert place.parent == tmp_path and str(place) in note
    place.chmod(0o777)  # somebody else could put code there
    jit.config.CACHE_DIR = ""
    jit.place_cache(tmp_path)
    assert Path(jit.config.CACHE_DIR).parent == tmp_path and Path(jit.config.CACHE_DIR) != place
