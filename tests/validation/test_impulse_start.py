"""What the pressure of a step leaves of a divergence, and the case that shows it."""

import numpy as np
import pytest

from cases.validation.coupling.heave_resistance import SECTIONS, hull
from cases.validation.coupling.impulse_start import Impulse, taken
from cases.validation.engine.case import met
from cases.validation.engine.registry import load
from cases.validation.engine.runner import run_case


@pytest.mark.parametrize("dim", [2, 3])
def test_a_step_takes_long_waves_away_and_leaves_short_ones(dim):
    lengths = (100.0, 10.0, 5.0, 3.0)
    shares = [taken(length, dim=dim) for length in lengths]
    assert shares[0] == pytest.approx(1.0, abs=0.06)
    assert shares == sorted(shares, reverse=True)
    assert 0.0 < shares[-1] < 0.02


def test_a_narrower_kernel_leaves_less():
    for length in (10.0, 5.0, 3.0):
        assert taken(length, smoothing_ratio=1.5) > taken(length, smoothing_ratio=2.0)


def test_late_is_what_comes_after_the_sound():
    measure = object.__new__(Impulse)
    measure.force = np.r_[np.full(200, 1.0), np.zeros(760)]
    assert measure.errors()["late"] == 0.0
    measure.force = np.r_[np.full(240, 1.0), np.full(720, 0.1)]
    assert measure.errors()["late"] == pytest.approx(0.3)


def test_the_hull_is_the_section():
    """Its mesh reaches from the bottom to the top, as wide as the section."""
    for section in SECTIONS.values():
        _, asset = hull(section)
        points = np.array(asset.split('vertex="')[1].split('"')[0].split(), float).reshape(-1, 3)
        assert np.ptp(points[:, 0]) == pytest.approx(section.width)
        assert points[:, 2].min() == pytest.approx(-section.draft)


def test_water_under_a_round_bottom_starts_at_once():
    case = load("impulse_start_round")
    row, failure = run_case(case, "coarse", "chebyshev6", threads=1)
    assert not failure
    assert all(met(row.error[name], target) for name, target in case.target.items())
