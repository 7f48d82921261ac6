"""Rows, tables, plots and VALIDATION.md of `fsi validate`."""

import json
import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from typer.testing import CliRunner

from cases.validation.engine import defaults
from cases.validation.engine.case import Case, Measure, Row
from cases.validation.engine.registry import MODULES, NAMES, choose, load, modules
from cases.validation.engine.report import cells, headings, order, orders, plot, seconds, shown, table, words
from cases.validation.engine.runner import run_case, scene_of
from cases.validation.engine.solvers import SOLVERS
from cases.validation.engine.store import Store
from cases.validation.engine.validate import validate
from fsi.command import app
from fsi.errors import SceneError
from fsi.fluid.constants import density_relaxation

KEYS = [
    "case", "level", "solver", "spacing", "dimension", "particles", "steps", "particle_steps", "time_step",
    "wall_seconds", "simulated_seconds", "memory_bytes", "error", "target", "passed",
]  # fmt: skip


class Fall(Measure):
    """Counts its samples and measures the speed of a falling block."""

    interval = 0.01

    def begin(self, sim):
        self.samples = 0

    def sample(self, sim):
        self.samples += 1
        self.speed = -sim.fluid.velocity[:, 1].mean() / (9.81 * sim.time)

    def errors(self):
        return {"fall_speed": self.speed - 1}


def fall(target=1e-3, **numerics) -> Case:
    def scene(spacing, folder):
        return {
            "duration": 0.1,
            "tank": {"min": [0, -1], "max": [1, 1], "walls": ["z-"]},
            "fluid": {"blocks": [{"min": [0.4, 0.5], "max": [0.6, 0.7]}]},
            "numerics": numerics,
        }

    return Case("fall", "A block falls", "g t", {"coarse": 0.02, "medium": 0.01}, scene, Fall, {"fall_speed": target})


def row(**facts) -> Row:
    return Row(
        **{
            "case": "dam_front", "level": "coarse", "solver": "chebyshev6", "spacing": 0.02, "dimension": 2,
            "particles": 100, "steps": 10, "particle_steps": 1000, "time_step": 0.1, "wall_seconds": 2.0,
            "simulated_seconds": 1.0, "memory_bytes": 1000, "error": dict.fromkeys(load("dam_front").target, 0.0),
            "target": dict(load("dam_front").target), "passed": True,
        } | facts
    )  # fmt: skip


def test_a_run_gives_a_row_of_the_contract():
    found, reason = run_case(fall(), "coarse", "chebyshev6", threads=1)
    assert list(found.as_dict()) == KEYS
    assert reason == "" and found.passed
    assert abs(found.error["fall_speed"]) < 1e-3
    assert found.particle_steps == 100 * found.steps
    assert found.particles == 100 and found.spacing == 0.02 and found.dimension == 2
    assert found.simulated_seconds == pytest.approx(0.1)
    assert found.time_step * found.steps == pytest.approx(0.1)
    assert found.wall_seconds > 0 and found.memory_bytes > 100 * 8 * 4
    assert list(found.error) == list(found.target)


def test_the_solver_changes_the_numerics_and_the_case_keeps_the_rest(tmp_path):
    scene = scene_of(fall(sweeps=3, courant=0.1), "medium", "chebyshev8", tmp_path)
    assert scene.numerics.sweeps == 8 and scene.numerics.courant == 0.1
    assert scene.spacing == 0.01


def test_a_missed_target_and_a_failed_run_are_not_passed():
    missed, _ = run_case(fall(target=0.0), "coarse", "chebyshev6", threads=1)
    assert not missed.passed
    failed, reason = run_case(unstable(), "coarse", "chebyshev6", threads=1)
    assert "unstable" in reason
    assert failed.error == {"anything": None} and not failed.passed
    assert cells(failed)[-2:] == ["failed !", "MISSED"]


def test_a_measure_that_cannot_be_read_is_a_failed_row():
    class Still(Fall):
        def errors(self):
            raise ZeroDivisionError("nothing moved")

    failed, reason = run_case(replace(fall(), measure=Still), "coarse", "chebyshev6", threads=1)
    assert "nothing moved" in reason and failed.error == {"fall_speed": None} and not failed.passed


def unstable() -> Case:
    def scene(spacing, folder):
        block = {"min": [0, 0], "max": [0.5, 1]}
        return {
            "duration": 1.0,
            "tank": {"min": [0, 0], "max": [2, 3]},
            "fluid": {"blocks": [block]},
            "numerics": {"fixed_time_step": 0.2},
        }

    return Case("unstable", "Too large a time step", "", {"coarse": 0.02}, scene, Measure, {"anything": 1.0})


def test_a_measure_samples_at_its_interval():
    measures = []

    def watched(sim):
        measures.append(Fall(sim))
        return measures[-1]

    found, _ = run_case(replace(fall(max_time_step=0.003), measure=watched), "coarse", "chebyshev6", threads=1)
    assert found.steps > 30
    assert 8 <= measures[0].samples <= 10


@pytest.mark.parametrize("name", NAMES)
def test_every_case_has_valid_scenes_at_rising_resolution(name, tmp_path):
    case = load(name)
    assert case.name == name and case.title and case.reference and case.target
    levels = ("coarse", "medium", "paper")
    spacings = [case.spacing[v] if case.run else scene_of(case, v, "chebyshev6", tmp_path).spacing for v in levels]
    assert spacings == sorted(spacings, reverse=True) and len(set(spacings)) == 3


def test_cases_are_chosen_by_name_or_pattern():
    assert [case.name for case in choose(["dam_front"])] == ["dam_front"]
    assert {case.name for case in choose(["still_*"])} == {name for name in NAMES if name.startswith("still_")}
    assert len(choose([])) == len(NAMES)
    with pytest.raises(SceneError, match="no validation case 'dam'"):
        choose(["dam"])


def test_a_group_is_chosen_by_the_name_of_its_module():
    assert [case.name for case in choose(["drop"])] == ["elliptical_drop", "oscillating_drop"]


def test_a_solver_may_depend_on_the_scene(tmp_path):
    plain = scene_of(load("still_water"), "coarse", "chebyshev6", tmp_path)
    times_ten = scene_of(load("still_water"), "coarse", "relaxation10", tmp_path)
    assert plain.numerics.density_relaxation is None
    assert times_ten.numerics.density_relaxation == pytest.approx(10 * density_relaxation(plain, 0.5))


def study_row(case, solver, seconds, **worse):
    target = dict(load(case).target)
    error = {name: worse.get(name, 0.5) * value for name, value in target.items()}
    good = all(abs(error[name]) <= value for name, value in target.items())
    facts = {"case": case, "level": defaults.LEVEL, "solver": solver, "wall_seconds": seconds}
    return row(error=error, target=target, passed=good, **facts)


def test_the_defaults_are_the_cheapest_of_those_that_meet_most_targets():
    rows = [
        study_row("still_water", "chebyshev6", 4.0),
        study_row("standing_wave", "chebyshev6", 6.0, energy_loss=2.0),
        study_row("still_water", "fine", 8.0),
        study_row("standing_wave", "fine", 12.0, energy_loss=1.5),
        study_row("still_water", "double_step", 2.0, rms_speed=3.0),
        study_row("standing_wave", "double_step", 3.0, energy_loss=2.0),
        study_row("still_water", "wide", 9.0),  # has not run on the other case
    ]
    found = defaults.scores(rows)
    assert set(found) == {"chebyshev6", "fine", "double_step"}
    assert (found["chebyshev6"].met, found["chebyshev6"].measures, found["chebyshev6"].seconds) == (5, 6, 10.0)
    assert found["double_step"].worst == {"still_water": pytest.approx(3.0), "standing_wave": pytest.approx(2.0)}
    assert defaults.pick(found, tuple(found)) == "chebyshev6"
    line = next(line for line in defaults.verdicts(found) if "Time step" in line)
    assert "fine 5 of 6 at 2.00" in line and line.endswith("Cheapest with the most: the default.")
    assert "| **chebyshev6** |" in "\n".join(defaults.section(rows))
    assert defaults.section(rows[:1]) == []


def test_the_study_of_the_defaults_covers_every_variant():
    jobs = defaults.jobs()
    assert {solver for _, _, solver in jobs} == set(SOLVERS)
    assert {name for names in defaults.CHOICES.values() for name in names} <= set(SOLVERS)
    assert {case for case, _, _ in jobs} == set(defaults.CASES) <= set(NAMES)


def test_reasons_stand_beside_rows_that_miss(tmp_path, monkeypatch):
    case = replace(load("dam_front"), reasons="because")
    monkeypatch.setattr("cases.validation.engine.store.load", lambda name: case)
    store = Store.choose(tmp_path)
    store.add(row(), threads=1)
    (page,) = store.pages(["dam_front"])
    assert "because" not in page.read_text()
    store.add(row(passed=False), threads=1)
    store.pages()
    assert "Why rows miss a target" in page.read_text() and "because" in page.read_text()


@pytest.mark.slow
def test_rows_run_in_processes_of_their_own(tmp_path):
    found = validate(["elliptical_drop", "poiseuille"], out=tmp_path, jobs=2)
    assert [r.case for r in found.rows] == ["elliptical_drop", "poiseuille"] and found.failures == ()


def test_orders_of_convergence():
    spacing = np.array([0.04, 0.02, 0.01])
    assert order(spacing, 3 * spacing**2) == pytest.approx(2)
    case = load("dam_front")
    rows = [
        row(level=level, spacing=dr, error=dict.fromkeys(case.target, 0.0) | {"front_speed": dr, "front_curve": sign})
        for level, dr, sign in (("coarse", 0.02, 0.1), ("medium", 0.01, -0.1))
    ]
    assert orders(case, rows) == {"chebyshev6": {"front_speed": pytest.approx(1)}}
    assert orders(case, rows[:1]) == {}


def test_errors_are_shown_in_their_units():
    assert shown("pressure_l2", 0.00123) == "0.123 %"
    assert shown("peak_time_s", -0.02) == "-0.02 s"
    assert shown("draft_m", 0.5) == "0.5 m"
    assert shown("phase_deg", 12.0) == "12 degrees" and words("damping_kgps") == "damping"
    assert seconds(12.34) == "12.3 s" and seconds(600) == "10.0 min"


def test_the_table_marks_what_misses_its_target():
    case = load("dam_front")
    bad = row(error=dict.fromkeys(case.target, 0.0) | {"energy_loss": 0.5}, passed=False)
    assert len(cells(bad)) == len(headings(case))
    assert "50 % !" in cells(bad) and cells(bad)[-1] == "MISSED"
    assert not any("!" in cell for cell in cells(row())) and cells(row())[-1] == "met"
    assert table(case, [bad, row()]).row_count == 2 * len(case.target)


def test_a_page_draws_the_measures_that_have_data_with_one_legend_beside_them():
    case = load("dam_front")
    error = dict.fromkeys(case.target, 0.0) | {"front_speed": 0.02, "energy_loss": 0.01}
    figure = plot(case, [row(solver=solver, error=error) for solver in SOLVERS])
    assert [panel.get_title(loc="left") for panel in figure.axes] == ["front speed", "energy loss"]
    assert all(panel.get_xlabel() == "run time [s]" and panel.get_ylabel() == "error [%]" for panel in figure.axes)
    assert all(panel.get_legend() is None for panel in figure.axes)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [*SOLVERS, "target"]
    looks = {(line.get_color(), line.get_marker()) for line in figure.axes[0].get_lines()[:-1]}
    assert len(looks) == len(SOLVERS)


def test_the_store_keeps_the_latest_of_each_row(tmp_path):
    store = Store.choose(tmp_path)
    store.add(row(wall_seconds=1.0), threads=1)
    store.add(row(solver="explicit"), threads=1)
    bad = dict.fromkeys(load("dam_front").target, 0.0) | {"front_speed": 0.5}
    store.add(row(wall_seconds=780.0, error=bad, passed=False), threads=1)
    again = Store.choose(tmp_path)
    assert [(r.row.solver, r.row.wall_seconds) for r in again.results] == [("explicit", 2.0), ("chebyshev6", 780.0)]
    text = (tmp_path / "VALIDATION.md").read_text()
    assert text == again.markdown()
    worst = 0.5 / load("dam_front").target["front_speed"]
    assert f"**{worst:.3g}**, 13.0 min" in text and "| dam_front | coarse | front speed | 50 % |" in text
    assert "2 rows of all variants, 1 meet their targets" in text and again.results[0].machine in text
    (page,) = again.pages(["dam_front"])
    assert page.read_text().count("<td>coarse</td>") == 2
    assert (tmp_path / "dam_front.png").read_bytes().startswith(b"\x89PNG")


def test_two_processes_keep_the_rows_of_both(tmp_path):
    """Each had read the file before the other wrote."""
    one, other = Store.choose(tmp_path), Store.choose(tmp_path)
    one.add(row(), threads=1)
    other.add(row(level="medium"), threads=1)
    one.add(row(level="paper"), threads=1)
    assert [r.row.level for r in Store.choose(tmp_path).results] == ["coarse", "medium", "paper"]
    assert not list(tmp_path.glob("*.lock"))


def test_rows_of_other_measures_are_dropped_and_those_of_other_targets_judged_anew(tmp_path):
    target = dict(load("dam_front").target)
    store = Store.choose(tmp_path)
    store.add(row(), threads=1)
    store.file.write_text(store.file.read_text().replace("front_curve", "front_shape"))
    assert Store.choose(tmp_path).results == []
    loose = dict.fromkeys(target, 9.0)
    store.add(row(target=loose, error=dict.fromkeys(target, 0.0) | {"energy_loss": 5.0}), threads=1)
    (kept,) = Store.choose(tmp_path).results
    assert kept.row.target == target and not kept.row.passed
    store.file.write_text('[{"case": "dam_front"}]')
    with pytest.raises(SceneError, match="not a file of results"):
        Store.choose(tmp_path)


def test_the_command_end_to_end(tmp_path):
    run = CliRunner().invoke(
        app, ["validate", "dam_front", "--out", str(tmp_path), "--threads", "1", "--json", "--quiet"]
    )
    assert run.exit_code == 0
    (found,) = json.loads(run.stdout)
    assert list(found) == KEYS and found["case"] == "dam_front" and found["level"] == "coarse"
    assert all(math.isfinite(value) for value in found["error"].values())
    assert found["passed"] == all(abs(found["error"][k]) <= v for k, v in found["target"].items())
    assert abs(found["error"]["front_speed"]) < 0.1 and found["error"]["leaks"] == 0
    assert {file.name for file in tmp_path.iterdir()} == {"results.json", "VALIDATION.md"}
    assert "[dam_front](" in (tmp_path / "VALIDATION.md").read_text()
    pages = CliRunner().invoke(app, ["validate", "dam_front", "--pages", "--out", str(tmp_path)])
    assert pages.exit_code == 0 and (tmp_path / "dam_front.html").is_file()


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["nothing"], "no validation case 'nothing'"),
        (["dam_front", "--level", "finer"], "choose from coarse, medium, paper, fine"),
        (["dam_front", "--level", "fine"], "choose from coarse, medium, paper"),
        (["dam_front", "--solver", "magic"], f"choose from {', '.join(SOLVERS)}"),
    ],
)
def test_a_wrong_choice_ends_with_code_2(arguments, message, tmp_path):
    run = CliRunner().invoke(app, ["validate", *arguments, "--out", str(tmp_path)])
    assert run.exit_code == 2 and message in run.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["still_water", "standing_wave", "elliptical_drop", "wavemaker_2", "column_tall"])
def test_cheap_cases_give_all_their_errors(name):
    found, reason = run_case(load(name), "coarse", "chebyshev6", threads=1)
    assert reason == ""
    assert set(found.error) == set(found.target) and None not in found.error.values()


@pytest.mark.parametrize("module", MODULES)
def test_names_and_cases_of_a_module_agree(module):
    assert set(import_module(f"cases.validation.{module}").CASES) == set(MODULES[module])


@pytest.mark.parametrize(
    "names, told", [("", "CASES without NAMES"), ("NAMES = (*OTHERS,)\n", "NAMES that are not written out")]
)
def test_a_module_whose_names_cannot_be_read_is_told_by_file(tmp_path, names, told):
    (tmp_path / "waves").mkdir()
    (tmp_path / "waves" / "mine.py").write_text(f"CASES = {{}}\n{names}")
    with pytest.raises(SceneError, match=told) as refused:
        modules(tmp_path)
    assert "mine.py" in str(refused.value)
