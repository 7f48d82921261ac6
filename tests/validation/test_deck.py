"""Linear theory of a piston's way."""

import math

import numpy as np
import pytest

from cases.validation.waves.deck import DEPTH, G, linear_elevation
from fsi.waves import piston_transfer, wavenumber


def test_a_sinusoidal_piston_makes_the_wave_of_its_transfer_function():
    omega, x, t = 4.0, 3.0, np.arange(0, 60, 0.02)
    k = wavenumber(omega, DEPTH, G)
    envelope = np.clip(t / 10, 0, 1) * np.clip((50 - t) / 10, 0, 1)
    found = linear_elevation(t, 0.01 * envelope * np.sin(omega * t), x)
    middle = (t > 25) & (t < 35)
    expected = 0.01 * piston_transfer(k * DEPTH) * np.cos(k * x - omega * t[middle])
    assert np.abs(found[middle] - expected).max() < 0.03 * 0.01 * piston_transfer(k * DEPTH)
    assert math.sqrt((found[t > 58] ** 2).mean()) == pytest.approx(0.0, abs=1e-3)
