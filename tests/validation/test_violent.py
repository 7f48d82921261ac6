"""Violent flows run to their end with their books closed, or stop with a word and a log."""

import numpy as np
import pytest

import fsi
from cases.validation.engine.registry import load
from cases.validation.engine.runner import run_case
from fsi import runner
from fsi.errors import RunError
from fsi.record.manifest import read_manifest

# of the energy at the start; the rows of these two miss their target, 0.001, by more than the others do
RISE = {"long_run": 0.06, "violent_columns": 0.008}
SLOW = ["violent_jet", "violent_corner", "violent_droplet", "long_run"]


@pytest.mark.parametrize(
    "name", ["violent_fill", "violent_columns", *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)]
)
def test_a_violent_flow_keeps_its_books(name):
    found, reason = run_case(load(name), "coarse", "chebyshev6", threads=1)
    assert reason == ""
    assert found.error["leaks"] == 0 and found.error["not_finite"] == 0
    assert found.error["momentum"] < 1e-6
    assert found.error["energy_rise"] < RISE.get(name, 0.005)
    assert name != "long_run" or found.steps >= 100_000


def test_a_run_that_breaks_says_so_and_leaves_a_readable_log(tmp_path):
    case = load("violent_columns")
    scene = case.scene(0.04, tmp_path) | {"name": "broken", "spacing": 0.04, "numerics": {"fixed_time_step": 0.15}}
    with pytest.raises(RunError, match="unstable at t = "):
        runner.run(fsi.Scene.model_validate(scene), out=tmp_path / "broken", quiet=True, threads=1)
    manifest = read_manifest(tmp_path / "broken")
    assert manifest["status"] == "failed" and "unstable" in manifest["reason"]
    series = fsi.load_run(tmp_path / "broken")
    assert len(series.time) >= 2 and np.isfinite(series.kinetic_energy.values[0])
    assert series.time.values[-1] <= manifest["simulated_seconds"] + 1e-9
