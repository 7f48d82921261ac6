"""`fsi bench --quick` from end to end."""

import json
import math

import pytest
from typer.testing import CliRunner

from fsi.command import app

SECTIONS = {
    "machine", "limits", "speed", "phases", "ratios", "roofline", "flatness", "memory", "determinism", "order", "flap",
    "ablation", "kernels", "start", "targets", "users", "equal_error",
}  # fmt: skip


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The results and the text of the report of a quick run."""
    file = tmp_path_factory.mktemp("bench") / "report.md"
    done = CliRunner().invoke(app, ["bench", "--quick", "--json", "--quiet", "--out", str(file)])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout), file.read_text()


def numbers(value):
    """Every number in nested rows."""
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from numbers(item)
    elif isinstance(value, int | float):
        yield value


def test_all_sections_are_there_with_sound_numbers(quick):
    result, _ = quick
    assert result.keys() == SECTIONS
    assert all(math.isfinite(number) for number in numbers(result))
    assert all(row["ns_per_particle"] > 0 for name in ("speed", "flatness", "flap", "ablation") for row in result[name])
    assert all(row["identical"] for row in result["determinism"])
    assert all(row["difference"] < 1e-5 for row in result["order"])  # both sweeps do the same
    assert result["targets"] == []  # tiny sizes are not held against the targets


def test_rows_agree_with_each_other(quick):
    result, _ = quick
    for row in result["speed"]:
        passes = 2 + row["sweeps"]
        assert row["particle_steps_per_s"] * row["ns_per_particle"] == pytest.approx(1e9)
        assert row["pairs_per_s"] == pytest.approx(row["particle_steps_per_s"] * row["neighbours"] * passes)
        assert row["processed_pairs_per_s"] > row["pairs_per_s"]
    for row in result["memory"]:
        assert sum(row["parts"].values()) == pytest.approx(row["bytes_per_particle"])
    plain = {row["threads"]: row for row in result["flap"] if row["run"] == "flume, no logging"}
    for row in result["flap"]:
        expected = row["particle_steps_per_s"] / plain[row["threads"]]["particle_steps_per_s"]
        assert row["speed_over_plain"] == pytest.approx(expected)
    assert (result["ablation"][0]["term"], result["ablation"][0]["over_plain"]) == ("plain", 1.0)


def test_the_report_is_made_of_the_rows(quick):
    result, text = quick
    assert result["machine"]["versions"] in text
    for row in result["speed"]:
        assert f"| {row['particle_steps_per_s'] / 1e6:.3g} | {row['ns_per_particle']:.0f} |" in text
    for row in result["ablation"]:
        assert f"| {row['term']} | {row['ns_per_particle']:.0f} | {row['over_plain']:.3f} |" in text


def test_a_report_that_cannot_be_written_is_wrong_input(monkeypatch, tmp_path):
    from cases.bench import run

    monkeypatch.setattr(run, "run_plan", lambda *plan: {"machine": {}})
    monkeypatch.setattr(run, "markdown", lambda result: "")
    done = CliRunner().invoke(app, ["bench", "--quick", "--out", str(tmp_path / "none" / "report.md")])
    assert done.exit_code == 2 and "cannot be written" in done.stderr
