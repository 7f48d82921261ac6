"""What the routines have on the page of a study: power matrix, annual energy, extremes, all at model and at full scale."""

import re
from html import unescape

import numpy as np
import pytest
import xarray

from cases.report.page import Page
from cases.study.compare import of_studies
from cases.study.report import report
from cases.study.results import write
from cases.study.routines import extreme, power_matrix
from cases.study.sections import sections
from fsi.errors import SceneError

FACTS = {"Hm0": ("m", "significant height"), "Te": ("s", "energy period"), "seed": ("1", "seed")}
STUDY = """
scene = "sea.toml"
routine = "power_matrix"
[parameters.Hm0]
key = "waves.Hm0"
values = [0.1, 0.2]
[parameters.Te]
key = "waves.Te"
values = [1.0, 2.0]
"""
SEA = """
spacing = 0.1
duration = 9.0
[tank]
min = [0.0, -0.5]
max = [5.0, 0.5]
[waves]
kind = "irregular"
Hm0 = 0.1
peak_period = 1.5
"""


def study(coords, variables):
    """The dataset of a study on a grid, all of its runs done."""
    shape = tuple(map(len, coords.values()))
    data = xarray.Dataset(
        attrs={"study": "made up", "method": "grid", "routine": "", "constraints": "{}", "description": ""}
    )
    for name, values in coords.items():
        units, words = FACTS[name]
        facts = {"units": units, "long_name": words, "key": f"waves.{name}"}
        data = data.assign_coords({name: (name, np.array(values), facts)})
    for name, text in (("status", "done"), ("reason", ""), ("run_hash", "abc")):
        data[name] = tuple(coords), np.full(shape, text), {"units": "1", "long_name": name}
    for name, (dims, values, units, words) in variables.items():
        data[name] = (*coords, *dims), np.asarray(values), {"units": units, "long_name": words}
    return data


def text_of(page: str) -> str:
    return unescape(re.sub(r"<[^>]+>", " ", re.sub(r"<img[^>]*>", "", page)))


def power():
    values = np.array([[10.0, 20.0], [40.0, 80.0]])[..., None] * [0.9, 1.1]
    words = "mean absorbed power of all joints"
    return power_matrix(
        study({"Hm0": [0.1, 0.2], "Te": [1.0, 2.0], "seed": [1, 2]}, {"mean_power": ((), values, "W", words)})
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "sea.toml").write_text(SEA)
    (tmp_path / "sites.csv").write_text("Hs,Te,hours\n2.5,5.0,1\n5.0,10.0,1\n")
    write(power(), tmp_path)
    return tmp_path


def test_a_power_matrix_at_full_scale_has_its_annual_energy(folder):
    page = text_of(report(folder, scale=25.0, scatter=folder / "sites.csv").read_text())
    mean = 0.5 * (10 + 80) * 25**3.5
    assert f"{mean:.4g} W" in page and f"{8766 * mean / 1000:.4g}" in page
    assert re.search(r"share of the year inside the matrix +100 %", page)
    assert "25 times the size of the runs" in page and (folder / "report/power_matrix.png").is_file()
    (folder / "study.nc").unlink()
    write(power().drop_vars("power_matrix"), folder)
    with pytest.raises(SceneError, match="--scatter: the study has no power matrix"):
        report(folder, scatter=folder / "sites.csv")


def test_extremes_tell_confidence_seeds_and_end_stops():
    rng = np.random.default_rng(0)
    motion = np.minimum(rng.gumbel(0.8, 0.2, (8, 1)), 1.0)
    variables = {
        "force_dynamic_max": (("body",), rng.gumbel(100, 10, (8, 1)), "N", "largest dynamic fluid force"),
        "motion_max": (("joint",), motion, "rad", "largest joint position"),
        "end_stop_hits": (("joint",), 1.0 * (motion == 1), "1", "hits"),
        "end_stop": (("joint",), np.where(motion == 1, 1.0, np.nan), "rad", "end stop"),
        "measured_seconds": ((), np.full(8, 300.0), "s", "measured time"),
    }
    data = extreme(study({"seed": range(8)}, variables).assign_coords(body=["hull"], joint=["hinge"]), 10800.0)
    page = Page("extremes")
    sections(page, data)
    text = text_of(page.html())
    assert "Largest dynamic fluid force" in text and "seeds for ±10 %" in text
    assert "bounded by the end stop" in text and f"end stop reached {int((motion == 1).sum())} times" in text


def test_studies_are_compared_by_what_they_share(folder, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "study.toml").write_text(STUDY.replace("0.2]", "0.3]"))
    write(power(), other)
    page = text_of(of_studies([folder, other], ["one", "two"]).html())
    assert "parameters.Hm0.values" in page and "Response" in page
    write(study({"seed": [1, 2]}, {"mean_power": ((), [1.0, 2.0], "W", "power")}), other)
    with pytest.raises(SceneError, match="vary no number in common"):
        of_studies([folder, other], ["one", "two"])
