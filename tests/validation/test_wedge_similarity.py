"""The similarity flow of wedge entry against published figures and its own balance."""

import math

import numpy as np
import pytest

from cases.validation.theory.wedge_similarity import entry, free_entry


def test_the_flow_at_30_degrees_is_that_of_the_literature():
    flow = entry(math.radians(30))
    peak = flow.pressure.argmax()
    # Zhao & Faltinsen (1993), table 1: pressure coefficient, its height over V t, force over rho V^3 t
    assert 2 * flow.pressure[peak] == pytest.approx(6.927, rel=0.01)
    assert flow.height[peak] == pytest.approx(0.4243, abs=0.005)
    assert flow.force == pytest.approx(14.139, rel=0.01)
    assert flow.pressure[-1] < 0.01 * flow.pressure[peak]
    wagner = math.pi / 2 * (math.pi / 2 / math.tan(math.radians(30))) ** 2  # of a flat plate as wide as the splash
    assert 0.5 * wagner < flow.mass < wagner


def test_a_heavy_wedge_keeps_its_speed_and_a_light_one_is_stopped():
    times = np.array([0.005, 0.01])
    heavy = free_entry(math.radians(30), 1e7, 6.0, 1000.0, 9.81, times)
    np.testing.assert_allclose(heavy[:, 1], 6.0 + 9.81 * times, rtol=1e-3)
    np.testing.assert_allclose(heavy[:, 0], 6.0 * times + 0.5 * 9.81 * times**2, rtol=1e-3)
    assert free_entry(math.radians(30), 20.0, 6.0, 1000.0, 9.81, times)[1, 1] < 4.5
