"""Error over run time of the pressure solvers: what is run, what is given up, and what is told of it."""

import pytest

from cases.bench import solver_times
from cases.validation.engine.registry import load


@pytest.fixture(scope="module")
def row():
    return solver_times.run(load("still_water"), 0.05, "chebyshev6")


def test_a_row_has_the_errors_of_the_case_and_the_time_of_its_steps(row):
    assert row["why"] == "" and row["steps"] > 100 and 0 < row["processor_s"] < 100
    assert solver_times.TRIALS["still_water"].error(row) == pytest.approx(row["error"]["pressure_l2"])


def test_what_is_there_is_not_run_again_and_coarse_spacings_come_first(row):
    left = list(solver_times.missing([row], ["still_water", "dam_front"]))
    assert ("still_water", 0.05, "chebyshev6") not in left and len(left) == 17
    assert [name for name, _, _ in left[:6]] == ["still_water"] * 2 + ["dam_front"] * 3 + ["still_water"]


def test_a_run_over_the_limit_is_given_up_and_its_time_foretold(monkeypatch, row):
    monkeypatch.setattr(solver_times, "TRIED", 0.01)
    late = solver_times.run(load("still_water"), 0.05, "chebyshev6", limit=0.0)
    assert late["why"] == "given up" and late["steps"] < row["steps"] and late["processor_s"] > 0
    lines = list(solver_times.table([row, late | {"spacing": 0.025, "processor_s": 700.0}]))
    assert "not run, 12 min" in lines[3] and f"{100 * row['error']['pressure_l2']:.2g} %" in lines[2]


def test_the_figure_leaves_out_what_was_not_measured(row):
    drawn = solver_times.figure([row, row | {"solver": "iisph", "error": {}, "why": "given up"}])
    assert [len(panel.lines) for panel in drawn.axes] == [1, 0, 0, 0, 0, 0]
