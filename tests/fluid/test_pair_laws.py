"""The viscosity of pairs at their own shear rate: against plain sums, in flows that are known, and what it leaves alone."""

import numpy as np
import pytest
from tanks import pairs, random_fluid

from fsi.sph import kernel
from fsi.sph.columns import flow, pair_law

PLASTIC = {"mu_inf": 1.0, "mu_0": 1000.0, "yield_stress": 20.0}
REST = np.zeros((2, 6))


def law(rate):
    return 1.0 + 999.0 / (1 + 50.0 * rate)


def predicted(dim, gradient=None, **kind):
    """A disordered fluid after `predict` and its velocities before, `gradient` @ x or random ones."""
    fluid = random_fluid(dim, liquid={"rheology": PLASTIC}, artificial_viscosity=0.0, viscous_step="explicit", **kind)
    if gradient is not None:
        fluid.velocity[:] = fluid.position @ np.asarray(gradient).T
    fluid.begin(1e-6, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    before = fluid.velocity.copy()
    fluid.predict()
    return fluid, before


def viscous_change(fluid, velocity, mu):
    """dt times the viscous acceleration of these velocities by pairs of the viscosities (n, n), as plain sums."""
    _, r2, F, _ = pairs(fluid)
    dr, h, dim = fluid.scene.spacing, fluid.scene.smoothing_length, fluid.dim
    a = F * r2 / (r2 + (0.1 * h) ** 2) * 2 * dr**dim / kernel.lattice(dr, h, dim).second_moment / 1000.0
    u_ij = velocity[:, None] - velocity[None]
    return -fluid.dt * ((a * mu)[..., None] * u_ij).sum(1)


def filled(fluid):
    """Mean filled part of the supports of two particles (n, n), as the shear pass has left them."""
    part = fluid.rheology.pairs.known[: fluid.count, pair_law(fluid.dim).filled].astype(float)
    return 0.5 * (part[:, None] + part)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_pair_takes_the_law_at_its_own_shear_rate(dim):
    """Random velocities on disordered particles; the gradients of the particles are those that the shear pass has left."""
    fluid, before = predicted(dim)
    n, x = fluid.count, fluid.position
    G = fluid.rheology.pairs.known[:n, : dim * dim].reshape(n, dim, dim)
    x_ij, u_ij = x[:, None] - x[None], before[:, None] - before[None]
    r2 = (x_ij**2).sum(-1) + np.eye(n)
    mean = 0.5 * (G[:, None] + G[None])
    seen = np.einsum("ijab,ijb->ija", mean, x_ij)
    even = 0.05 * r2 * (mean**2).sum((-1, -2)) + 1e-30
    scale = np.clip(((u_ij * seen).sum(-1) + even) / ((seen**2).sum(-1) + even), 0.0, 2.0)
    c = (u_ij - scale[..., None] * seen) / r2[..., None]
    mean = scale[..., None, None] * mean + c[..., :, None] * x_ij[..., None, :]
    S = 0.5 * (mean + mean.swapaxes(-1, -2))
    rate = np.sqrt(2 * (S**2).sum((-1, -2)))
    change = viscous_change(fluid, before, law(rate) / filled(fluid))
    assert np.abs(fluid.velocity - before - change).max() < 1e-9 * np.abs(change).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_linear_flow_has_one_viscosity(dim):
    gradient = np.zeros((dim, dim))
    gradient[0, -1] = 3.0
    fluid, before = predicted(dim, gradient)
    change = viscous_change(fluid, before, law(3.0) / filled(fluid))
    assert np.abs(fluid.velocity - before - change).max() < 1e-7 * np.abs(change).max()
    assert np.allclose(fluid.rheology.fields(fluid.work.flow, fluid.count)["viscosity"], law(3.0))


@pytest.mark.parametrize("dim", [2, 3])
def test_fluid_and_wall_exchange_opposite_impulses(dim):
    fluid, before = predicted(dim, boundary=True)
    fluid.pressure(REST)
    axes = [0, 2] if dim == 2 else [0, 1, 2]
    drag = (fluid.wrench(viscous=True) - fluid.wrench())[1, axes]
    change = float(fluid.k.mass) * (fluid.velocity - before).sum(0)
    assert np.abs(change + fluid.dt * drag).max() <= 1e-12 * np.abs(drag).max() * fluid.dt + 1e-12


def test_away_from_walls_a_particle_shows_its_own_viscosity():
    fluid, _ = predicted(2, boundary=True, count=20)
    shown, own = fluid.work.flow[: fluid.count, flow(2).mu], fluid.rheology.pairs.viscosity(fluid.count)
    far = fluid.position[:, 0] < -2.5 * fluid.scene.smoothing_length
    near = fluid.position[:, 0] > -fluid.scene.smoothing_length
    assert far.any() and np.array_equal(shown[far], own[far])
    assert (shown[near] != own[near]).any()
    assert (shown >= 1.0).all() and (shown <= 1000.0).all()


def test_scenes_without_a_law_have_no_pair_laws():
    assert random_fluid(2, turbulence="smagorinsky").rheology.pairs is None
    assert random_fluid(2).rheology is None
