"""The weights of the pressure sweeps, on a matrix whose spectrum is known."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.fluid.chebyshev import HIGHEST, SPAN, chebyshev, iteration
from fsi.scene.numerics import Numerics
from fsi.simulation.loop import Simulation


def error_left(weights, eigenvalue):
    """What k sweeps leave of an error along an eigenvector of D^-1 A, where J(p) - p = -eigenvalue p."""
    p, before = 1.0, 1.0
    for alpha, beta in weights:
        p, before = p - alpha * eigenvalue * p + beta * (p - before), p
    return p


@pytest.mark.parametrize("sweeps", [1, 2, 4, 8, 15])
def test_chebyshev_leaves_the_same_small_error_over_its_spectrum(sweeps):
    centre, half = 0.5 * HIGHEST * (1 + 1 / SPAN), 0.5 * HIGHEST * (1 - 1 / SPAN)
    bound = 1 / np.cosh(sweeps * np.arccosh(centre / half))
    spectrum = np.linspace(HIGHEST / SPAN, HIGHEST, 200)
    left = np.abs([error_left(chebyshev(sweeps).weights, value) for value in spectrum])
    assert left.max() == pytest.approx(bound, rel=1e-6)


@pytest.mark.parametrize("solver", ["explicit", "chebyshev"])
@pytest.mark.parametrize("sweeps", [1, 3, 6, 12])
def test_gain_is_the_slope_at_slow_modes(solver, sweeps):
    how = iteration(Numerics(solver=solver, sweeps=sweeps))
    assert len(how.weights) == sweeps
    assert (1 - error_left(how.weights, 1e-6)) / 1e-6 == pytest.approx(how.gain, rel=1e-3)


def test_chebyshev_carries_slow_modes_further():
    assert iteration(Numerics(solver="chebyshev", sweeps=6)).gain > 3.5 * 6


def test_the_residual_is_zero_until_a_pressure_has_been_found():
    """The first frame is logged before the coefficients of the first step are there."""
    sim = Simulation(still_tank(numerics={"smoothing_ratio": 2.0}), threads=1)
    sim.fluid.begin(1e-3, np.zeros((sim.fluid.owners, 3)), np.zeros((sim.fluid.owners, 6)))
    sim.fluid.work.coefficients[:] = np.nan
    assert sim.fluid.residual() == 0.0
    sim.step()
    assert 0.0 < sim.fluid.residual() < 1.0
