"""The command line and `fsi.run`, with a stand-in for the solver: results, exit codes, messages, the run folder."""

import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import fsi
from fsi.command import app
from fsi.errors import RunError, SceneError
from fsi.scene.file import load_scene, resolved_toml


@pytest.fixture
def here(tmp_path, monkeypatch, scene):
    """An empty working directory with the scene in small.toml."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(resolved_toml(scene))
    return tmp_path


FLUID = 100 * 25  # particles in 2 m by 0.5 m of water


def command(*arguments: str):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def manifest(folder: Path) -> dict:
    return json.loads((folder / "run.json").read_text())


def test_run_leaves_a_whole_folder(here, solver):
    result = command("run", "small.toml", "--set", "gauges.far.x=1.2", "--threads", "2")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("runs/small: done, 1 s in 100 steps, ")
    assert "a warning" in result.stderr
    folder = here / "runs" / "small"
    assert sorted(os.listdir(folder)) == ["run.clock", "run.json", "run.mcap", "scene.toml"]
    facts = manifest(folder)
    assert (facts["status"], facts["steps"], facts["threads"]) == ("done", 100, 2)
    assert facts["particles"] == {"fluid": 50, "wall": 10, "body": 0}
    assert facts["phases"] == {"pressure": 0.5}
    assert facts["audit"] == {"volume_drift": 1e-4}
    assert facts["versions"]["numpy"]
    assert load_scene(folder / "scene.toml") == load_scene("small.toml", ["gauges.far.x=1.2"])
    assert fsi.load_run(folder).sizes["time"] == 100


def test_second_run_takes_a_folder_of_its_own(here, solver):
    first, second = command("run", "small.toml", "--quiet"), command("run", "small.toml")
    assert (first.exit_code, second.exit_code) == (0, 0)
    assert first.stderr == ""
    assert "writing to runs/small-2" in second.stderr
    again = command("run", "small.toml", "--out", "runs/small")
    assert again.exit_code == 2
    assert again.stderr == "--out: runs/small already holds a run; choose another folder or remove it\n"


def test_json_and_until(here, solver):
    result = command("run", "small.toml", "--until", "0.5", "--json", "--quiet", "--out", "there")
    facts = json.loads(result.stdout)
    assert (facts["folder"], facts["status"], facts["simulated_seconds"]) == ("there", "done", 0.5)
    assert tomllib.loads((here / "there/scene.toml").read_text())["duration"] == 0.5


def test_wrong_input_exits_with_2(here, solver):
    result = command("run", "small.toml", "--set", "tank.wals=[]", "--set", "spacing=-1")
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        "small.toml: spacing: -1 should be greater than 0",
        "small.toml: tank.wals: unknown key; did you mean walls?",
    ]
    assert result.stdout == ""
    assert not (here / "runs").exists()


def test_output_that_cannot_be_written_exits_with_2(here, solver):
    result = command("run", "small.toml", "--out", "small.toml/inside")
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1].startswith("--out: small.toml/inside cannot be written: ")


def test_unstable_run_exits_with_1_and_stays_readable(here, solver):
    solver.fails_at = 0.3
    result = command("run", "small.toml")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == "unstable at t = 0.3 s"
    facts = manifest(here / "runs/small")
    assert (facts["status"], facts["reason"], facts["steps"]) == ("failed", "unstable at t = 0.3 s", 30)
    data = fsi.load_run("runs/small")
    assert data.sizes["time"] == 30
    assert data.attrs["log_complete"] == 1


def test_full_disk_exits_with_1(here, solver, monkeypatch):
    """As a limit to the size of files, which the log reaches: run.json still says how the run ended."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, before[1]))
    try:
        result = command("run", "small.toml", "--out", "full", "--quiet")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    message = "the disk is full: the log could not be written; what came before can be read"
    assert (result.exit_code, result.stderr) == (1, message + "\n")
    assert (manifest(here / "full")["status"], manifest(here / "full")["reason"]) == ("failed", message)
    assert all(file.stat().st_size for file in (here / "full").iterdir())
    assert 0 < fsi.load_run("full").sizes["time"] < 100


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_the_run_after_its_step(here, solver, number, monkeypatch):
    series = solver.run

    def run(self, until, on_step):
        def and_signal(sim):
            if sim.step_count == 20:
                os.kill(os.getpid(), number)
            on_step(sim)

        series(self, until, and_signal)

    monkeypatch.setattr(solver, "run", run)
    before = signal.getsignal(number)
    result = command("run", "small.toml")
    assert result.exit_code == (130 if number == signal.SIGINT else 143)
    assert "runs/small: interrupted, 0.2 s in 20 steps" in result.stdout
    assert manifest(here / "runs/small")["status"] == "interrupted"
    assert fsi.load_run("runs/small").sizes["time"] == 20
    assert signal.getsignal(number) == before


def test_run_from_python(here, solver, scene):
    run = fsi.run(scene, out="made", overrides=["output.series=0.02"], quiet=True)
    assert (run.folder, run.status, run.steps) == (Path("made"), "done", 100)
    assert run.load().attrs["scene"] == "small"
    solver.fails_at = 0.1
    with pytest.raises(RunError, match="unstable"):
        fsi.run(scene, quiet=True)
    with pytest.raises(SceneError, match="small: duration: -1 should be greater than 0"):
        fsi.run(scene, until=-1, quiet=True)


def test_export_and_missing_runs(here, solver):
    command("run", "small.toml", "--quiet")
    result = command("export", "runs/small", "--to", "csv")
    assert (result.exit_code, result.stdout) == (0, "runs/small/run.csv\n")
    assert (here / "runs/small/run.csv").read_text().count("\n") == 101
    assert command("export", "runs/none").exit_code == 2
    view = command("view", "runs/small")
    assert (view.exit_code, view.stderr) == (
        2,
        "runs/small has no timeline; run the scene with output.timeline = true, and with rerun installed: "
        "pip install 'spindrift[viewer]'\n",
    )


def test_cases_are_listed():
    listed = command("cases").stdout.splitlines()
    assert any(line.startswith("dam_break ") and "column of water" in line for line in listed)
    assert set(json.loads(command("cases", "--json").stdout)) == {line.split()[0] for line in listed}


SLIM = """
import sys
sys.path.insert(0, {folder!r})
import stand_in
sys.modules["fsi.simulation.loop"] = stand_in
import fsi
fsi.run({scene!r}, out={out!r}, quiet=True)
heavy = {{"mujoco", "trimesh", "rerun", "typer", "rich", "xarray", "matplotlib", "bodies", "couplers", "cases", "mcap"}}
print(sorted(heavy & set(sys.modules)))
"""


@pytest.mark.parametrize("logged, imported", [("false", "[]"), ("true", "['mcap']")])
def test_what_a_scene_does_not_need_is_not_imported(here, logged, imported):
    path = here / "small.toml"
    path.write_text(path.read_text().replace("mcap = true", f"mcap = {logged}"))
    code = SLIM.format(folder=str(Path(__file__).parent), scene=str(path), out=str(here / "out"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == imported


def test_check_prints_a_scene_that_runs(here):
    result = command("check", "small.toml", "--set", "waves={wave_height=0.05, period=1.5}")
    assert result.exit_code == 0, result.output
    (here / "printed.toml").write_text(result.stdout)
    assert load_scene(here / "printed.toml") == load_scene("small.toml", ["waves={wave_height=0.05, period=1.5}"])
    facts = json.loads(command("check", "small.toml", "--json").stdout)
    counts = facts["estimate"]
    assert counts["fluid"] == FLUID and counts["wall"] > 0 and counts["body"] == 0
    assert counts["steps"] * counts["time_step"] >= facts["scene"]["duration"]
    assert f"({FLUID} fluid," in result.stdout and "# run time: about" in result.stdout
    assert "particles over the wave height" in result.stderr
    assert (facts["scene"]["spacing"], facts["warnings"]) == (0.02, [])
