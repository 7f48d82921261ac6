"""Whole studies of a tiny tank: rows, reuse, failures, what a kill leaves, the table on disk."""

import fcntl
import json
import os
import signal
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime

import numpy as np
import pandas
import pyarrow.parquet
import pytest
from typer.testing import CliRunner

import fsi
from cases.study.engine import sweep
from cases.study.results import export, load_results, table
from cases.study.worker import read_facts
from fsi.command import app
from fsi.errors import SceneError


def stamps(folder):
    """When each run of a study was started."""
    return {run.name: read_facts(run).get("started") for run in folder.glob("runs/*") if run.is_dir()}


def test_a_study_is_a_dataset_and_is_not_run_twice(here):
    data = sweep("study.toml", workers=0, quiet=True)
    assert data["gauge_Hm0"].dims == ("width", "gauge") and data.width.values.tolist() == [1.0, 1.2, 1.4]
    assert data.width.attrs["units"] == "m" and data.gauge_Hm0.attrs == {
        "units": "m",
        "long_name": "significant height",
    }
    assert (data.status == "done").all() and np.isfinite(data.crest_max).all()
    folder = here / "studies/study"
    before = stamps(folder)
    assert set(before) == set(data.run_hash.values) and all(before.values())
    text = (here / "study.toml").read_text().replace("1.4]", "1.4, 1.6]")
    (here / "study.toml").write_text(text)
    more = fsi.sweep("study.toml", workers=0, quiet=True)
    after = stamps(folder)
    assert len(after) == 4 and before.items() <= after.items()
    assert more.sizes["width"] == 4 and load_results(folder).equals(more)
    assert fsi.load_scene(folder / "runs" / more.run_hash.values[3] / "scene.toml").tank.max[0] == 1.6


def test_a_failed_run_is_a_row_with_its_reason(here):
    (here / "study.toml").write_text(
        'scene = "tank.toml"\n[parameters.step]\nkey = "numerics.fixed_time_step"\nvalues = [0.01, 30.0, -1.0]\nunits = "s"\n'
        '[set]\nduration = 60.0\ntank.max = [0.5, 0.5]\nspacing = 0.12\n[parameters.end]\nkey="duration"\nvalues=[0.1, 60.0]\n'
        '[sampling]\nmethod = "list"\npoints = [{step=0.01, end=0.1}, {step=30.0, end=60.0}, {step=-1.0, end=0.1}]\n'
    )  # the second loses its fluid in one step, the third is no scene
    data = sweep("study.toml", workers=0, quiet=True)
    assert data.status.values.tolist() == ["done", "failed", "invalid"]
    assert "unstable" in data.reason.values[1] and "numerics.fixed_time_step: -1" in data.reason.values[2]
    assert np.isfinite(data.crest_max.values[0]).all() and np.isnan(data.crest_max.values[1:]).all()
    folder = here / "studies/study"
    before = stamps(folder)
    sweep("study.toml", workers=0, quiet=True)
    assert stamps(folder) == before
    sweep("study.toml", workers=0, quiet=True, retry=True)
    assert sum(stamps(folder)[run] != before[run] for run in before) == 1
    result = CliRunner().invoke(app, ["sweep", "study.toml", "--workers", "0", "--json"])
    facts = json.loads(result.stdout)
    assert (facts["runs"], facts["done"], len(facts["reasons"])) == (3, 1, 2)
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (1, "2 of 3 runs failed")


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flip(data: bytes) -> bytes:
    middle = len(data) // 2  # of a chunk; what stands at both ends of a log may be lost at one of them
    return data[:middle] + bytes([data[middle] ^ 0xFF]) + data[middle + 1 :]


@pytest.mark.parametrize("damage", [cut, flip, lambda data: b""], ids=["cut", "flipped", "empty"])
def test_a_damaged_log_is_not_counted_and_retry_heals_it(here, damage):
    data = sweep("study.toml", workers=0, quiet=True)
    run = here / "studies/study/runs" / data.run_hash.values[1]
    (run / "run.mcap").write_bytes(damage((run / "run.mcap").read_bytes()))
    before = stamps(here / "studies/study")
    again = CliRunner().invoke(app, ["sweep", "study.toml", "--workers", "0", "--quiet"])
    assert again.exit_code == 1 and "is damaged or incomplete; run it again with --retry" in again.stdout
    assert load_results("studies/study").status.values.tolist() == ["done", "failed", "done"]
    assert stamps(here / "studies/study") == before
    assert CliRunner().invoke(app, ["sweep", "study.toml", "--workers", "0", "--quiet", "--retry"]).exit_code == 0
    assert load_results("studies/study").drop_vars("wall_seconds").equals(data.drop_vars("wall_seconds"))
    assert sum(stamps(here / "studies/study")[name] != before[name] for name in before) == 1


def test_leftovers_of_a_killed_worker_are_run_again(here):
    data = sweep("study.toml", workers=0, quiet=True)
    run = here / "studies/study/runs" / data.run_hash.values[1]
    (run / "run.json").write_text(json.dumps(read_facts(run) | {"status": "running"}))
    (run / "run.mcap").write_bytes((run / "run.mcap").read_bytes()[:1000])
    (run / "litter").mkdir()
    again = sweep("study.toml", workers=0, quiet=True)
    assert again.drop_vars("wall_seconds").equals(data.drop_vars("wall_seconds"))
    assert read_facts(run)["status"] == "done" and not (run / "litter").exists()


@pytest.mark.parametrize("left", ["interrupted", "running"])
def test_an_interrupted_run_goes_on_from_its_checkpoint(here, monkeypatch, left):
    whole = sweep("study.toml", workers=0, quiet=True, out="whole")
    from fsi.simulation.loop import Simulation

    real, count = Simulation.step, [0]

    def step(self, *until):
        real(self, *until)
        count[0] += 1
        if count[0] == 4:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.1)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(Simulation, "step", step)
        sweep("study.toml", workers=0, quiet=True)
    run = here / "studies/study/runs" / whole.run_hash.values[0]
    facts = read_facts(run)
    assert (facts["status"], facts["steps"]) == ("interrupted", 4) and list(run.glob("checkpoints/*"))
    if left == "running":  # as a kill leaves it; of a process on another machine, silent for less than a minute
        now = datetime.now(UTC).isoformat()
        facts |= {"status": "running", "host": "elsewhere", "heartbeat": now}
        (run / "run.json").write_text(json.dumps(facts))
    data = sweep("study.toml", workers=0, quiet=True)
    assert data.drop_vars("wall_seconds").equals(whole.drop_vars("wall_seconds"))
    assert [bool(read_facts(r).get("resumed")) for r in (run, *sorted(set(run.parent.glob("*[!k]")) - {run}))] == [
        1,
        0,
        0,
    ]


def test_a_run_whose_checkpoint_is_damaged_starts_again(here, monkeypatch):
    whole = sweep("study.toml", workers=0, quiet=True)
    run = here / "studies/study/runs" / whole.run_hash.values[0]
    (run / "checkpoints").mkdir()
    (run / "checkpoints/000000000004.checkpoint").write_bytes(b"spindrift-ckpt-1 and noise")
    (run / "run.json").write_text(json.dumps(read_facts(run) | {"status": "interrupted"}))
    again = sweep("study.toml", workers=0, quiet=True)
    assert again.drop_vars("wall_seconds").equals(whole.drop_vars("wall_seconds"))
    assert not (run / "checkpoints").exists() and not read_facts(run).get("resumed")


def test_a_run_that_another_process_is_at_is_waited_for(here):
    data = sweep("study.toml", workers=0, quiet=True)
    run = here / "studies/study/runs" / data.run_hash.values[0]
    finished = (run / "run.json").read_text()
    (run / "run.json").write_text(json.dumps(json.loads(finished) | {"status": "running"}))
    with open(f"{run}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)

        ended = threading.Event()

        def end():
            (run / "run.json").write_text(finished)
            ended.set()
            fcntl.flock(lock, fcntl.LOCK_UN)

        before = stamps(here / "studies/study")
        threading.Timer(0.5, end).start()
        sweep("study.toml", workers=0, quiet=True)
        assert ended.is_set() and stamps(here / "studies/study") == before


def test_an_interruption_ends_the_study_not_the_run_alone(here):
    (here / "study.toml").write_text((here / "study.toml").read_text() + "[set]\nduration = 600.0\n")
    interrupt = threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT))
    interrupt.start()
    result = CliRunner().invoke(app, ["sweep", "study.toml", "--workers", "0"])
    interrupt.cancel()
    assert result.exit_code == 130 and result.stderr.splitlines()[-1] == "interrupted"
    assert len([run for run in stamps(here / "studies/study").values() if run]) < 3


def test_tables_hold_every_row_with_units(here):
    data = sweep("study.toml", workers=0, quiet=True)
    folder = here / "studies/study"
    frame = table(data)
    assert frame["width"].tolist() == [1.0, 1.2, 1.4] and "gauge_Hm0.middle" in frame
    csv = pandas.read_csv(export(data, folder, "csv"))
    assert np.allclose(csv["crest_max.middle [m]"], frame["crest_max.middle"])
    parquet = pyarrow.parquet.read_table(export(data, folder, "parquet"))
    assert parquet.schema.field("width").metadata == {b"units": b"m"}
    assert np.allclose(parquet["crest_max.middle"].to_numpy(), frame["crest_max.middle"])


def test_report_of_a_study(here):
    sweep("study.toml", workers=0, quiet=True)
    result = CliRunner().invoke(app, ["report", "studies/study"])
    assert (result.exit_code, result.stdout) == (0, "studies/study/report.html\n"), result.output
    page = (here / "studies/study/report.html").read_text()
    assert "Width [m]" in page and "Significant height, middle [m]" in page and page.count("<img") == 1
    assert (here / "studies/study/report/response.png").stat().st_size > 5000
    assert CliRunner().invoke(app, ["report", "."]).stderr.startswith(". holds no study and no run; give the folder")


def test_mistakes_stop_a_study_before_it_runs(here):
    for change, fault in (
        (('"tank.max[0]"', '"tank.mux[0]"'), "the scene has no tank.mux[0]"),
        (('"tank.toml"', '"tonk.toml"'), "tonk.toml: no such file"),
        (
            ("[parameters.width]", '[objective]\nmaximise = "x"\n[parameters.width]'),
            "objective: no figure 'x'; a run has gauge_Hm0.middle, crest_max.middle",
        ),
        (("[parameters.width]", 'routine = "rao"\n[parameters.width]'), "rao needs a parameter named period or omega"),
    ):
        (here / "bad.toml").write_text((here / "study.toml").read_text().replace(*change))
        result = CliRunner().invoke(app, ["sweep", "bad.toml", "--workers", "0"])
        assert result.exit_code == 2, result.output
        assert fault in result.stderr
    (here / "studies/study").mkdir()
    with open(here / "studies/study/study.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(SceneError, match=r"another process is at work on .*study; wait for it to end"):
            sweep("study.toml", workers=0)


KILL = """
import os, signal, sys
from cases.study import worker
run, left = worker._run, [int(sys.argv[1])]
def and_die(job):
    if left[0] == 0:
        import threading
        threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGKILL)).start()
    left[0] -= 1
    return run(job)
worker._run = and_die
from cases.study.engine import sweep
sweep("study.toml", workers=0, quiet=True)
"""


def test_a_study_killed_at_any_run_goes_on_where_it_was(here):
    (here / "study.toml").write_text((here / "study.toml").read_text() + "[set]\nduration = 3.0\n")
    done = subprocess.run([sys.executable, "-c", KILL, "1"], cwd=here, capture_output=True, timeout=120)
    assert done.returncode == -signal.SIGKILL
    folder = here / "studies/study"
    states = {run.name: read_facts(run).get("status") for run in folder.glob("runs/*") if run.is_dir()}
    assert sorted(map(str, states.values())) in (["done", "running"], ["None", "done"])
    before = stamps(folder)
    data = sweep("study.toml", workers=0, quiet=True)
    assert (data.status == "done").all()
    kept = next(run for run, status in states.items() if status == "done")
    after = stamps(folder)
    assert after[kept] == before[kept] and len(after) == 3


def nobody_left(group: int) -> bool:
    """Whether every process of the group ends within a while; one that is still starting up ends once it has."""
    for _ in range(150):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.2)
    return False


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [4.0, 8.0, 12.0])
def test_workers_die_with_a_killed_study_and_nothing_is_repeated(here, seconds):
    (here / "study.toml").write_text(
        'scene = "tank.toml"\n[set]\nduration = 20.0\n[parameters.width]\nkey = "tank.max[0]"\n'
        "min = 1.0\nmax = 1.7\ncount = 8\n"
    )
    command = [sys.executable, "-m", "fsi", "sweep", "study.toml", "--workers", "2"]
    study = subprocess.Popen(command, start_new_session=True)
    time.sleep(seconds)
    study.kill()
    study.wait()
    assert nobody_left(study.pid)
    folder = here / "studies/study"
    runs = [run for run in folder.glob("runs/*") if run.is_dir()]
    before = {run: read_facts(run)["started"] for run in runs if read_facts(run).get("status") == "done"}
    data = sweep("study.toml", workers=2, quiet=True)
    assert (data.status == "done").all() and data.sizes["width"] == 8
    assert {run: read_facts(run)["started"] for run in before} == before


FLAP = """
spacing = 0.1
duration = 0.3
[tank]
min = [0.0, -0.7]
max = [3.0, 0.3]
[bodies.flap]
mjcf = "package://bodies/models/surge_flap.xml"
position = [1.5, 0.0, 0.0]
"""


@pytest.mark.slow
def test_a_run_that_takes_its_worker_down_is_a_row_and_the_others_go_on(here):
    (here / "flap.toml").write_text(FLAP)
    (here / "pto.py").write_text(
        "import os\n\n"
        "def soft(t, x, v):\n    return -v\n\n"
        "def crash(t, x, v):\n    os._exit(9) if t > 0.1 else 0\n    return 0.0\n"
    )
    (here / "study.toml").write_text(
        'scene = "flap.toml"\nset = {bodies.flap.pto.kind = "python"}\n[parameters.pto]\nkey = "bodies.flap.pto.function"\n'
        'values = ["pto.py:crash", "pto.py:soft"]\n[parameters.width]\nkey = "tank.max[0]"\nvalues = [3.0, 3.2]\n'
    )
    data = sweep("study.toml", workers=2, quiet=True, trust=True)
    assert data.status.values.tolist() == [["failed", "failed"], ["done", "done"]]
    assert "its worker process died 2 times" in data.reason.values[0, 0]
    assert (
        sweep("study.toml", workers=0, quiet=True, trust=True).status == data.status
    ).all()  # recorded, not tried again


@pytest.mark.slow
def test_a_scheduler_that_was_started_elsewhere_gives_the_same_table(here):
    here_alone = sweep("study.toml", workers=0, quiet=True, out="alone")
    module = [sys.executable, "-m"]
    options = ["--no-dashboard"]
    scheduler = [*module, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "18786", *options]
    worker = [*module, "distributed.cli.dask_worker", "tcp://127.0.0.1:18786", "--nthreads", "1", *options]
    started = [subprocess.Popen(command, stderr=subprocess.DEVNULL, cwd=here) for command in (scheduler, worker)]
    try:
        for _ in range(30):
            time.sleep(1.0)
            command = ["sweep", "study.toml", "--scheduler", "tcp://127.0.0.1:18786", "--quiet"]
            result = CliRunner().invoke(app, command)
            if result.exit_code == 0:
                break
            assert "18786" in result.stderr
        assert result.exit_code == 0, result.output
    finally:
        for process in started[::-1]:
            process.terminate()
            process.wait()
    there = load_results("studies/study")
    assert there.drop_vars("wall_seconds").equals(here_alone.drop_vars("wall_seconds"))
