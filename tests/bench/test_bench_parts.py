"""The pieces of the benchmark: what it counts, and what it makes of the figures. No test depends on the machine's speed."""

import io
import json
import math
import sys

import numpy as np
import pytest

from cases.bench import child, flume, limits, report, roofline, targets
from cases.bench.block import PHASES, Block, measure
from cases.bench.pairs import pair_counts
from cases.bench.speed import phase_shares, ratios, speed
from cases.bench.users import facts
from fsi.errors import RunError
from fsi.fluid.fluid import MEMORY
from fsi.sph import terms


@pytest.fixture(scope="module")
def block():
    block = Block(3, 1000, sweeps=4)
    measure([block], rounds=1, visit=0.01)
    return block


class Counted:
    """A number that counts the operations it takes part in."""

    operations = 0

    def _count(self, other=None):
        Counted.operations += 1
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = _count


def counted_dot(a, b):
    return sum((x * y for x, y in zip(a[1:], b[1:], strict=True)), a[0] * b[0])


class Vector(list):
    def __mul__(self, factor):
        return Vector(x * factor for x in self)

    def __sub__(self, other):
        return Vector(x - y for x, y in zip(self, other, strict=True))


@pytest.mark.parametrize("dimension", [2, 3])
def test_operations_of_a_pair_are_those_of_the_terms(dimension, monkeypatch):
    monkeypatch.setattr(terms, "dot", counted_dot)
    monkeypatch.setattr(terms, "sqrt", lambda x: x._count())
    monkeypatch.setattr(terms, "maximum", lambda a, b: b)
    one, vector = Counted(), Vector(Counted() for _ in range(dimension))

    def operations(extra, *work):
        """What a pair costs: the distance, t, the slope, `work`, and `extra` additions to the sums."""
        Counted.operations = extra
        x_ij = vector - vector
        r2 = counted_dot(x_ij, x_ij)
        f = terms.slope(terms.closeness(r2, one))
        for term in work:
            term(f, r2, x_ij)
        return Counted.operations

    weight = lambda f, r2, x: terms.laplacian_weight(f, r2, one)  # noqa: E731
    pull = lambda f, r2, x: terms.laplacian_weight(f, r2, one) * one  # noqa: E731
    density = lambda f, r2, x: terms.kernel(one)  # noqa: E731
    drag = lambda f, r2, x: terms.viscous(one, vector - vector)  # noqa: E731
    outflow = lambda f, r2, x: terms.divergence(f, vector - vector, x)  # noqa: E731
    gradient = lambda f, r2, x: terms.pressure_gradient(f, one, one, x)  # noqa: E731
    expected = {
        "predictor": operations(3 + dimension, weight, density, drag),
        "first sweep": operations(2, outflow, pull),
        "further sweeps": operations(1, pull),
        "corrector": operations(dimension, gradient),
    }
    assert {name: cost.flops for name, cost in roofline.costs(dimension).items()} == expected


def test_roofline_arithmetic():
    fluid = {"dimension": 3, "lanes": 8, "entries": 25.0, "neighbours": 99.0, "number_bytes": 4}
    peak = {"flops_per_s": 200e9, "roots_per_s": 10e9, "quotients_per_s": 40e9, "bytes_per_s": 20e9}
    phases = {"predictor": 100.0, "first sweep": 80.0, "further sweeps": 150.0, "corrector": 50.0}
    passes = {"predictor": 1, "first sweep": 1, "further sweeps": 3, "corrector": 1}
    *rows, whole = roofline.roofline(phases, passes, peak, fluid)
    sweep = next(row for row in rows if row["sweep"] == "further sweeps")
    assert sweep["ns"] == 50.0
    assert sweep["multiply-adds_ns"] == pytest.approx(200 * 18 / 200)
    assert sweep["roots_ns"] == pytest.approx(20.0) and sweep["quotients_ns"] == pytest.approx(5.0)
    assert sweep["memory_ns"] == pytest.approx((4 * 25 + 4 * 8) / 20)
    assert (sweep["binds"], sweep["of_limit"]) == ("roots", pytest.approx(0.4))
    assert sweep["processed"] == pytest.approx(200 * 18 / 50 / 200)
    assert sweep["useful"] == pytest.approx(0.5 * sweep["processed"])
    assert whole["ns"] == pytest.approx(380.0)
    assert whole["processed"] == pytest.approx(200 * (33 + 28 + 3 * 18 + 21) / 380 / 200)
    (slow,) = [
        row
        for row in roofline.roofline(phases, passes, peak | {"bytes_per_s": 1e9}, fluid)
        if row["sweep"] == "corrector"
    ]
    assert slow["binds"] == "memory"


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(("root", "quotient"), [(False, False), (True, False), (False, True)])
def test_the_loops_that_measure_limits_do_their_work(precision, root, quotient):
    lanes = 8
    a = np.linspace(0.5, 0.9, (limits.CHAINS + 2) * lanes).astype(np.float32 if precision == "single" else np.float64)
    x, y, *chains = a.copy().astype(float).reshape(-1, lanes)
    for _ in range(3):
        chains = [np.sqrt(v + x) if root else x / (v + y) if quotient else v * x + y for v in chains]
    limits.make_chains(lanes, root, quotient)(a, 3)
    assert a[2 * lanes : 3 * lanes] == pytest.approx(sum(chains), rel=1e-5)


def test_triad_and_rates():
    a, b, c = np.zeros(10), np.arange(10.0), np.ones(10)
    limits.triad(a, b, c, 1)
    assert (a == b + 3).all()
    found = limits.limits(2, {"single": 8}, seconds=1e-3, megabytes=1)
    assert [(row["lanes"], row["threads"]) for row in found["rates"]] == [(8, 1), (8, 2), (16, 1)]
    assert all(value > 0 for row in found["rates"] + found["bandwidth"] for value in row.values() if value != "single")


def test_pairs_are_counted_as_all_pairs_say(block):
    position = block.fluid.position
    r2 = ((position[:, None] - position[None]) ** 2).sum(-1)
    inside = (r2 < (2 * block.fluid.scene.smoothing_length) ** 2).sum() / len(position) - 1
    counts = pair_counts(block.fluid)
    assert counts["neighbours"] == pytest.approx(inside, rel=1e-4)
    assert counts["entries"] * block.fluid.lanes > counts["neighbours"]


def test_a_block_goes_back_to_where_it_was(block):
    block.rewind()
    block.step()
    first = block.fluid.position.copy()
    block.rewind()
    block.step()
    assert (block.fluid.position == first).all()


def test_every_phase_is_found_in_the_solver(block):
    row = phase_shares(block)
    assert all(row["ns"][phase] > 0 for phase in PHASES)
    assert set(block.team.seconds) == {name for names in PHASES.values() for name in names}
    assert sum(row["ns"].values()) == pytest.approx(block.nanoseconds(), rel=0.5)
    assert speed(block, pair_counts(block.fluid))["particles"] == block.fluid.count == 1000


def test_a_block_that_comes_apart_is_an_error(block):
    lost = Block(3, 1000)
    lost.fluid.departed.lost = 1
    with pytest.raises(RunError, match="come apart"):
        lost.check()


def test_memory_is_all_accounted_for(block):
    fluid, counted = block.fluid, {}
    parts = (
        fluid.particles,
        fluid.placed,
        fluid.work,
        fluid.work.arena,
        fluid.near,
        fluid.sort,
        fluid.solids,
        fluid.solids.near,
    )
    for part in (fluid, *parts, fluid.solids.sort):
        for value in vars(part).values():
            for array in value if isinstance(value, tuple) else value.values() if isinstance(value, dict) else [value]:
                while isinstance(getattr(array, "base", None), np.ndarray):
                    array = array.base
                if isinstance(array, np.ndarray):
                    counted[id(array)] = array.nbytes
    assert tuple(fluid.memory) == MEMORY
    assert abs(sum(counted.values()) - fluid.nbytes) < 0.01 * fluid.nbytes  # small arrays aside


def row(case, precision, sweeps, threads, seconds):
    facts = {"case": case, "dimension": 3, "precision": precision, "sweeps": sweeps, "threads": threads}
    times = {"wall_s": seconds, "processor_s": seconds * threads, "ns_per_particle": 1e9 * seconds / 1e5}
    return facts | times | {"particle_steps_per_s": 1e5 / seconds, "neighbours": 112.0}


def test_ratios():
    rows = [row("a", "single", 1, 1, 1.0), row("a", "single", 1, 2, 0.5), row("a", "single", 4, 1, 1.6)]
    phases = [{"case": "a", "precision": "single", "sweeps": 4, "threads": 1, "ns": {"further sweeps": 210.0}}]
    first, second = ratios(rows, phases)
    assert (first["speedup"], first["processor_ratio"], first["threads"]) == (2.0, 1.0, 2)
    assert second["further_sweep_ns"] == pytest.approx(70.0)


def empty():
    sections = (
        "speed",
        "phases",
        "ratios",
        "roofline",
        "flatness",
        "memory",
        "flap",
        "ablation",
        "start",
        "determinism",
        "order",
        "kernels",
    )
    return {name: [] for name in sections} | {"targets": [], "limits": {"rates": [], "bandwidth": []}, "machine": {}}


def judged(seconds, warm):
    result = empty()
    result["speed"] = [row("3D 300k", "single", 1, 1, seconds)]
    facts = {"case": "3D 300k", "precision": "single", "sweeps": 1, "threads": 1}
    result["phases"] = [facts | {"ns": {"lists": 90.0, "predictor": 120.0, "sort": 0.1}}]
    result["start"] = [{"cache": "warm", "wall_s": warm, "processor_s": warm, "steps": 1}]
    result["targets"] = targets.verdicts(result)
    return result


def test_targets_are_met_or_missed_with_a_profile():
    by_unit = {row["unit"]: row for row in judged(0.05, 2.0)["targets"]}
    assert len(by_unit) == 3 and all(row["met"] for row in by_unit.values())
    assert by_unit["million particle-steps/s"]["measured"] == pytest.approx(2.0)
    assert by_unit["x the C++ code"]["measured"] == pytest.approx(2.0 / 0.147)
    by_unit = {row["unit"]: row for row in judged(0.1, 4.0)["targets"]}
    assert not any(row["met"] for row in by_unit.values())
    assert by_unit["million particle-steps/s"]["profile"] == "predictor 120, lists 90 ns per particle"


def test_a_block_with_fewer_neighbours_counts_for_less():
    result = judged(0.05, 2.0)
    result["speed"][0]["neighbours"] = 55.5
    assert targets.verdicts(result)[0]["measured"] == pytest.approx(1.0)


def test_report_shows_what_was_measured():
    missed = report.markdown(judged(0.1, 4.0))
    assert "| 3D 300k, single, 1 thread | million particle-steps/s | >= 1.3 | 1 | MISSED |" in missed
    assert "predictor 120, lists 90 ns per particle" in missed
    met = report.markdown(judged(0.05, 2.0))
    assert "MISSED" not in met and "Profiles" not in met
    assert f"{2.0 / 0.147:.1f}" in met


def test_the_bare_flume_has_nothing_that_costs():
    scene = flume.bare(0.05, numerics={"wall_guard": 0.8})
    assert not (scene.bodies or scene.waves or scene.damping or scene.output.mcap or scene.output.timeline)
    assert (scene.numerics.viscosity, scene.numerics.artificial_viscosity, scene.numerics.wall_guard) == (
        "none",
        0,
        0.8,
    )
    assert flume.flap(spacing=0.05).bodies


def test_the_child_tells_what_it_imported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO(flume.bare(0.1).model_dump_json()))
    child.main()
    facts = json.loads(capsys.readouterr().out)
    assert {"numba", "numpy", "fsi"} <= set(facts["packages"]) and math.isfinite(facts["processor_s"])


def test_a_child_that_fails_is_an_error(tmp_path):
    with pytest.raises(RunError, match="no_such_module"):
        child._python("fsi.no_such_module", cache=tmp_path)


START = {"counts": {"fluid": 100, "wall": 40, "body": 10}, "memory_bytes": 30_000, "start_s": 1.5}
VISITS = [
    {"steps": 4, "simulated": 0.02, "processor": p, "wall": 0.2, "phases": {"pressure": 0.12, "predictor": 0.04}}
    for p in (0.1, 0.3, 0.2)
]


def test_figures_of_what_users_run():
    found = facts(START, VISITS)
    assert (found["fluid"], found["boundary"], found["bytes_per_fluid_particle"]) == (100, 50, 300)
    assert found["processor_s"] == pytest.approx(0.2 / 0.02)
    assert found["ns_per_particle"] == pytest.approx(1e9 * 0.2 / 4 / 100)
    assert found["shares"] == pytest.approx({"predictor": 0.25, "pressure": 0.75})


def test_what_users_run_leads_a_report_that_is_there(tmp_path):
    file = tmp_path / "BENCHMARK.md"
    file.write_text(report.HEAD + "\n- date: then\n\n## Targets\n\nOld.\n")
    error = {"case": "dam", "spacing": 0.05, "error": 0.01, "steps": 9, "processor_s": 1.0}
    error |= {"peer": "a / 20", "peer_error": 0.016, "peer_s": 11.6, "times_less": 11.6}
    result = {"machine": {"date": "now"}, "users": [{"scene": "flap", "checkout": "here"} | facts(START, VISITS)]}
    for _ in range(2):  # again over its own
        file.write_text(report.led_by(file, result | {"equal_error": [error]}))
    text = file.read_text()
    places = [
        text.index(head) for head in ("- date: then", "## What users run", "## Time to equal error", "## Targets")
    ]
    assert places == sorted(places) and text.count("## What users run") == 1 and text.endswith("Old.\n")
    assert "date: now" in text
