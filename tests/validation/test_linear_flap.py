"""Linear theory of a flap in a flume: its damping by the torque and by the waves it sends, its constants, its limits."""

import math
from dataclasses import replace

import pytest

from cases.validation.bodies import owsc
from cases.validation.theory.linear_flap import Flap, inertia, radiate, respond, stiffness
from fsi.waves import wavenumber

PLANE = (0.01, 0.2, 0.01)


@pytest.mark.parametrize("name", ["owsc_2d", "owsc_2d_surface", "owsc_2d_shallow"])
def test_the_waves_carry_away_what_the_torque_puts_in(name):
    response = respond(owsc.FLAPS[name], owsc.OMEGA, PLANE)
    added, damping, _ = radiate(owsc.FLAPS[name], owsc.OMEGA, PLANE, 1.2)
    assert response.damping == pytest.approx(damping, rel=2e-3)
    assert response.added == added > 0


@pytest.mark.parametrize("name", ["owsc_2d", "owsc_2d_surface", "owsc_2d_shallow"])
def test_the_constants_of_the_case_are_those_of_the_theory(name):
    coarse, fine = (respond(owsc.FLAPS[name], owsc.OMEGA, (d, 0.2, d)) for d in (0.01, 0.005))
    known = owsc.LINEAR[name]
    for key in ("added", "damping", "excitation"):
        drawn_on = 2 * getattr(fine, key) - getattr(coarse, key)
        assert getattr(known, key) == pytest.approx(drawn_on, rel=0.01)


def test_a_thin_flap_over_the_whole_depth_is_a_flap_wavemaker():
    """Flap wavemaker of linear theory (Dean & Dalrymple 1991, eq. 6.25): H/S = 4 sinh(kd)/kd (kd sinh kd - cosh kd + 1)
    / (sinh 2kd + 2kd), where S is the stroke at still water."""
    depth, omega = 0.7, owsc.OMEGA
    flap = Flap(hinge=-depth, top=0.1, thick=0.01, wide=0.4, flume=0.4, depth=depth)
    _, _, far = radiate(flap, omega, (0.005, 0.2, 0.005), 1.2)
    kd = wavenumber(omega, depth, 9.81) * depth
    ratio = 4 * math.sinh(kd) / kd * (kd * math.sinh(kd) - math.cosh(kd) + 1) / (math.sinh(2 * kd) + 2 * kd)
    assert far == pytest.approx(ratio * depth / omega, rel=0.01)


def test_weight_and_buoyancy_of_a_flap():
    flap = owsc.FLAPS["owsc_2d"]
    assert stiffness(flap, 550.0) == pytest.approx(450 * 9.81 * 0.4 * 0.3 * 0.06 * 0.15)
    assert stiffness(replace(flap, hinge=-0.3, top=0.0), 1000.0) == pytest.approx(0, abs=1e-9)
    assert inertia(flap, 550.0) == pytest.approx(3.96 * (0.09 / 3 + 0.0036 / 12))


@pytest.mark.slow
def test_the_flap_in_the_narrow_flume():
    coarse, fine = (respond(owsc.FLAPS["owsc"], owsc.OMEGA, d) for d in ((0.03, 0.02, 0.05), (0.015, 0.02, 0.025)))
    known = owsc.LINEAR["owsc"]
    for key in ("added", "damping", "excitation"):
        assert getattr(known, key) == pytest.approx(2 * getattr(fine, key) - getattr(coarse, key), rel=0.03)
