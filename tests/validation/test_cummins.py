"""The free heave of a half submerged sphere by Cummins' equation, against the frequency domain and known limits."""

import numpy as np
import pytest

from cases.validation.coupling import decay
from cases.validation.coupling.radiation import turns
from cases.validation.theory import cummins
from cases.validation.theory.panels import release


def test_memory_gives_the_added_mass_of_each_frequency():
    """Ogilvie (1964): A(omega) = A_inf - 1/omega int K sin(omega t) dt."""
    t = np.linspace(0.0, 60.0, 6001)
    kernel = cummins.memory(t)
    for ka in (0.5, 0.8, 1.0):
        omega = np.sqrt(ka)
        added = cummins.ADDED - np.trapezoid(kernel * np.sin(omega * t), t) / omega
        assert added == pytest.approx(np.interp(ka, *cummins.TABLE.T[:2]), rel=0.04)


def test_small_motion_is_that_of_the_frequency_domain():
    sphere, t = decay.sphere(), np.linspace(0.0, 2.4, 801)
    expected = 0.003 * release(t, sphere.inertia, sphere.stiffness, sphere.coefficients, sphere.top)
    found = cummins.heave(t, decay.RADIUS, 0.003)
    (times, heights), (when, sizes) = turns(t, found), turns(t, expected)
    assert times == pytest.approx(when, rel=5e-3)
    assert heights == pytest.approx(sizes, rel=0.04)  # one is for deep water


def test_a_sphere_let_go_a_radius_high_falls_longer_than_linear_theory_says():
    t = np.linspace(0.0, 1.3, 801)
    low, high = turns(t, cummins.heave(t, 0.3, 0.03)), turns(t, cummins.heave(t, 0.3, 0.3))
    assert high[0][1] > 1.1 * low[0][1]
    assert abs(high[1][1]) < 0.3


def test_the_table_is_what_the_boundary_elements_give():
    pytest.importorskip("capytaine")
    ka, added, damping = cummins.TABLE[9]
    assert cummins.coefficients(ka, panels=8) == pytest.approx((added, damping), rel=0.04)
