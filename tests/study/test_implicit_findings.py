"""What the studies of the implicit scheme are judged by."""

from pathlib import Path

import numpy as np

from cases.study.implicit_findings import FINDINGS, STUDIES, flat, growth, level, optimum


def test_an_optimum_lies_inside_and_failed_runs_are_no_optimum():
    values = np.array([1.0, 2.0, 3.0])
    assert optimum(values, {"wall_seconds": np.array([3.0, 2.0, np.nan])})[0]
    assert not optimum(values, {"wall_seconds": np.array([3.0, 2.0, 1.0])})[0]
    assert not optimum(values, {"wall_seconds": np.array([1.0, 2.0, 3.0])})[0]


def test_growth_is_taken_per_halving():
    values, step = np.array([4.0, 2.0, 1.0]), np.full(3, 0.1)
    assert growth(values, {"pressure_iterations": 10 * 1.78 ** np.arange(3), "time_step_mean": step})[0]
    assert not growth(values, {"pressure_iterations": 10 * 1.3 ** np.arange(3), "time_step_mean": step})[0]


def test_flat_and_level():
    values = np.array([1.0, 2.0])
    assert (
        flat("x")(values, {"x": np.array([10.0, 11.9])})[0] and not flat("x")(values, {"x": np.array([10.0, 13.0])})[0]
    )
    assert not level(values, {"memory_mb": np.array([1.0, 1.3])})[0]


def test_each_finding_has_its_study():
    folder = Path(__file__).parents[2] / STUDIES
    assert all((folder / f"implicit_{finding.study}.toml").is_file() for finding in FINDINGS)
