"""The search for the best design, on a function in place of runs."""

import math

import pytest

from cases.study.optimise import JOURNAL, Search
from cases.study.plan import Bounds, Objective, Parameter, Sampling, Study
from cases.study.worker import Outcome


def study(samples=24, **changes):
    parameters = {
        "mass": Parameter(key="a", min=0.0, max=1.0),
        "damping": Parameter(key="b", min=1.0, max=100.0, scale="log"),
    }
    settings = {"objective": Objective(maximise="power"), "scene": "x", "parameters": parameters}
    return Study(**settings | {"sampling": Sampling(method="optimise", samples=samples, seed=2)} | changes)


def power(point):
    """One hill over mass and the logarithm of the damping, its top 1 at (0.37, 20)."""
    return math.exp(-(((point["mass"] - 0.37) / 0.3) ** 2) - math.log(point["damping"] / 20) ** 2)


def outcome(point):
    return Outcome("done", figures={"power": ("power", power(point)), "load": ("load", 10 * point["mass"])})


def go_on(search, count):
    asked = []
    for _ in range(count):
        number, point = search.ask()
        asked.append(point)
        search.tell(number, outcome(point))
    return asked


def test_it_beats_a_grid_of_as_many_points(tmp_path):
    asked = go_on(Search(study(), tmp_path), 24)
    grid = [{"mass": m / 3, "damping": 100 ** (d / 5)} for m in range(4) for d in range(6)]
    assert max(map(power, asked)) > max(map(power, grid))


def test_a_constraint_is_kept_by_the_best_and_sought(tmp_path):
    limited = study(samples=30, constraints={"load": Bounds(max=2.0)})
    asked = go_on(Search(limited, tmp_path), 30)
    good = [point for point in asked if point["mass"] <= 0.2]
    assert max(map(power, good)) > 0.85 * power({"mass": 0.2, "damping": 20.0})
    assert sum(p["mass"] <= 0.25 for p in asked[10:]) > 10  # a sampler that did not know would follow the hill to 0.37


def test_minimising_is_maximising_the_negative(tmp_path):
    search = Search(study(objective=Objective(minimise="power")), tmp_path)
    assert min(map(power, go_on(search, 24))) < 1e-3


def test_a_kill_loses_no_trial_and_repeats_none(tmp_path):
    search = Search(study(), tmp_path)
    told = go_on(search, 9)
    _, first_open = search.ask()
    _, second_open = search.ask()
    with open(tmp_path / JOURNAL, "ab") as journal:  # a line that the kill tore
        journal.write(b'{"op_code": 5, "worker')
    again = Search(study(), tmp_path)
    assert again.points() == told
    assert [again.ask()[1], again.ask()[1]] == [first_open, second_open]
    rest = go_on(again, 6)
    assert not [point for point in rest if point in told]
    assert len(Search(study(), tmp_path).points()) == 15


def test_failed_runs_are_trials_without_a_value(tmp_path):
    search = Search(study(), tmp_path)
    number, point = search.ask()
    search.tell(number, Outcome("failed", "unstable", {}))
    go_on(search, 3)
    assert len(Search(study(), tmp_path).points()) == 4
    assert Search(study(), tmp_path).points()[0] == point


def test_another_question_is_another_search(tmp_path):
    go_on(Search(study(), tmp_path), 4)
    assert Search(study(objective=Objective(minimise="load")), tmp_path).points() == []


def test_given_points_are_tried_first(tmp_path):
    start = ({"mass": 0.25, "damping": 7.0},)
    search = Search(study(sampling=Sampling(method="optimise", samples=9, points=start)), tmp_path)
    assert search.ask()[1] == start[0]


@pytest.mark.parametrize("values", [(1, 2, 3), ("flap.xml", "wide.xml")])
def test_choices_stay_what_they_were(tmp_path, values):
    parameters = {"choice": Parameter(key="a", values=values), "n": Parameter(key="b", min=1, max=9, whole=True)}
    search = Search(study(parameters=parameters, samples=9), tmp_path)
    for _ in range(6):
        number, point = search.ask()
        assert point["choice"] in values and isinstance(point["n"], int) and 1 <= point["n"] <= 9
        search.tell(number, Outcome("done", figures={"power": ("power", float(point["n"]))}))
