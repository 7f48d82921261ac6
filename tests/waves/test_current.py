"""Waves on a current disperse by Doppler's shift and satisfy the equations of waves as seen from the tank."""

import math

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.waves.current import on_current, retimed
from fsi.waves.kinds.regular import Waves as Regular
from fsi.waves.linear import wavenumber

G, DEPTH, PERIOD, HEIGHT = 9.81, 0.6, 1.2, 0.06
STEP = 1e-4


def on(current, height=HEIGHT, order=2):
    kind = retimed(Regular(wave_height=height, period=PERIOD, order=order), DEPTH, G, current)
    return on_current(kind.incident(DEPTH, G), np.array([current, 0.0]), endless=True)


@pytest.mark.parametrize("current", [-0.4, -0.2, 0.0, 0.3, 1.0])
def test_low_waves_have_the_length_of_doppler_shifted_dispersion(current):
    waves, omega = on(current, height=1e-6, order=1), 2 * math.pi / PERIOD
    k = float(waves.k[0])
    assert (omega - k * current) ** 2 == pytest.approx(G * k * math.tanh(k * DEPTH), rel=1e-9)
    assert waves.seen[0] == pytest.approx(omega, rel=1e-11)
    assert (k > wavenumber(omega, DEPTH, G)) == (current < 0)


@pytest.mark.parametrize("current", [-0.3, 0.4])
def test_surface_and_pressure_are_those_of_waves_of_third_order_seen_from_the_tank(current):
    waves, t = on(current), 0.2
    x = np.linspace(0, 2 * math.pi / waves.k[0], 101)[:, None]
    eta = lambda y, time=t: waves.elevation(time, y)  # noqa: E731
    surface = np.column_stack([x, eta(x)])
    u = waves.velocity(t, surface)
    rise = (eta(x, t + STEP) - eta(x, t - STEP)) / (2 * STEP)
    slope = (eta(x + STEP) - eta(x - STEP)) / (2 * STEP)
    assert np.abs(rise + u[:, 0] * slope - u[:, 1]).max() < 0.02 * waves.omega[0] * HEIGHT
    assert np.ptp(waves.pressure(t, surface, 1.0)) < 0.02 * G * HEIGHT
    assert np.ptp(eta(x)) == pytest.approx(HEIGHT, rel=0.002)
    bed = np.column_stack([x, np.full_like(x, -DEPTH)])[:-1]
    assert waves.velocity(t, bed)[:, 0].mean() == pytest.approx(current)


def test_waves_that_move_with_the_current_see_what_those_in_still_water_see():
    waves, t = on(0.3), 0.7
    still = on_current(waves, np.zeros(2), endless=True)
    x = np.random.default_rng(0).uniform([-2, -0.5], [2, -0.05], (30, 2))
    back = x - [0.3 * t, 0]
    np.testing.assert_allclose(waves.velocity(t, x) - [0.3, 0], still.velocity(t, back), atol=1e-12)
    np.testing.assert_allclose(waves.pressure(t, x, 1.0), still.pressure(t, back, 1.0), atol=1e-12)


@pytest.mark.parametrize("current, told", [(-0.6, "faster than their energy"), (-3.0, "faster than any wave")])
def test_a_current_that_stops_the_waves_is_refused(current, told):
    with pytest.raises(SceneError, match=f"sea.current: there are no waves of 1.2 s.*{told}"):
        on(current)
