"""The table of inputs that users met: what is expected of one is told where an answer lacks it."""

import math

import numpy as np
import pytest

from cases.field_expected import EXPECTED, VARIANTS, Expected, Figure, disagreements, refused


def test_what_an_answer_lacks_is_named():
    xarray = pytest.importorskip("xarray")
    data = xarray.Dataset({"lost_particles": ("time", np.array([0.0, 3.0]))})
    lost = Figure("nothing lost", lambda d: float(d.lost_particles[-1]), 0, 0)
    still = Expected(says=("words",), rest=True, figures=(lost,))
    assert disagreements(still, 0, "some words", "done", 0.01, data) == ["nothing lost: 3, not 0 to 0"]
    assert disagreements(still, 2, "", "", math.nan, None) == ["exit 2, not 0", "does not say 'words'"]
    assert disagreements(still, 0, "words", "done", 0.3, data)[0] == "speed 0.3, not 0.02"
    assert disagreements(still, 0, "words", "failed: why", math.nan, None) == ["run failed, not done"]
    assert disagreements(refused("row 3"), 2, "t.csv: row 3: nan", "", math.nan, None) == []
    fails = Expected(run="failed: returned nan")
    assert disagreements(fails, 0, "", "failed: laws.py:f(0) returned nan; give", math.nan, None) == []
    unread = Expected(figures=(Figure("a gauge", lambda d: float(d.elevation[0]), 0, 1),))
    assert disagreements(unread, 0, "", "done", 0.0, data)[0].startswith("a gauge: AttributeError")


def test_every_variant_has_an_expectation_and_words_for_the_table():
    assert set(VARIANTS) <= set(EXPECTED)
    assert all(expected.words for expected in EXPECTED.values())
