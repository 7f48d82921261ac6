"""Moments and derivatives of the kernel, and what the lattice makes of it."""

import numpy as np
import pytest

from fsi.sph import kernel

H = 0.3


def radial_integral(f, dim):
    r = (np.arange(20000) + 0.5) * 2 * H / 20000
    shell = 2 * np.pi * r if dim == 2 else 4 * np.pi * r**2
    return (f(r) * shell).sum() * 2 * H / 20000


@pytest.mark.parametrize("dim", [2, 3])
def test_kernel_integrates_to_one(dim):
    assert radial_integral(lambda r: kernel.value(r, H, dim), dim) == pytest.approx(1, rel=1e-7)


@pytest.mark.parametrize("dim", [2, 3])
def test_gradient_is_the_derivative(dim):
    r = np.linspace(0.01, 2.2 * H, 50)
    slope = (kernel.value(r + 1e-6, H, dim) - kernel.value(r - 1e-6, H, dim)) / 2e-6
    assert np.allclose(-kernel.gradient_factor(r, H, dim) * r, slope, atol=1e-4 * abs(slope).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_first_moment_of_the_gradient_is_minus_one(dim):
    """integral of x grad W = -1 on each axis, so that a linear field has the right gradient."""
    assert radial_integral(lambda r: kernel.gradient_factor(r, H, dim) * r**2, dim) == pytest.approx(dim, rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_laplacian_sum_is_three_and_a_half_over_h_squared(dim):
    """integral of F r^2/r^2 dV = 3.5 / h^2 in both dimensions: the sound speed of one sweep is the same in both."""
    assert radial_integral(lambda r: kernel.gradient_factor(r, H, dim), dim) == pytest.approx(3.5 / H**2, rel=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_lattice_density_is_that_of_the_lattice(dim):
    lattice = kernel.lattice(0.2, 0.3, dim)
    assert lattice.density * 0.2**dim == pytest.approx(1, rel=0.01)
    assert lattice.surface_factor == pytest.approx(2.2, abs=0.03)
