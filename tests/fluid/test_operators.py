"""Sweeps against plain sums over all pairs, and the conservation that their symmetry gives."""

import numpy as np
import pytest
from tanks import pairs, random_fluid

from fsi.sph import kernel
from fsi.sph.columns import DEFICIT, DIAGONAL

CASES = [(2, "double", 1e-12), (3, "double", 1e-12), (2, "single", 3e-5), (3, "single", 3e-5)]
REST = np.zeros((2, 6))


def close(got, expected, tolerance):
    assert np.abs(got - expected).max() <= tolerance * np.abs(expected).max()


def strain_rates(x, u, F):
    """(n, dim, dim) of velocities whose differences are u (n, n, dim) over the ways x, in least squares."""
    moments, mixed = (np.einsum("ij,ija,ijb->iab", F, values, x) for values in (x, u))
    gradient = mixed @ np.linalg.inv(moments)
    return 0.5 * (gradient + gradient.transpose(0, 2, 1))


@pytest.mark.parametrize("reconstruction", ["none", "linear"])
@pytest.mark.parametrize("dim, precision, tolerance", CASES)
def test_predictor_matches_all_pairs(dim, precision, tolerance, reconstruction):
    """Laminar and artificial viscosity, gravity, density and the diagonal of the pressure equation."""
    fluid = random_fluid(dim, precision, boundary=True, gravity=9.81, velocity_reconstruction=reconstruction)
    before = fluid.velocity.copy()
    fluid.predict()
    x, r2, F, W = pairs(fluid)
    n, h, volume, nu = fluid.count, fluid.scene.smoothing_length, 0.1**dim, 0.1
    eta2, sound = (0.1 * h) ** 2, np.sqrt(9.81 * 1.0)
    a = F * r2 / (r2 + eta2)
    lattice = kernel.lattice(0.1, h, dim)
    shepard = W[:, n:].sum(0)
    carried = (W[:, n:, None] * before[:, None]).sum(0) / np.maximum(shepard, 1e-300)[:, None]
    wall = fluid.solids.velocity[: fluid.solids.count]
    wall = np.where(shepard[:, None] > 0, 2 * wall - carried, wall)  # no slip: the wall's velocity half way
    u = before[:, None] - np.concatenate([before, wall])
    expected = -2 * nu * volume / lattice.second_moment * (a[..., None] * u).sum(1)
    approach = (u * x).sum(-1)[:, :n]
    if reconstruction == "linear":
        strain = strain_rates(x[:, :n], u[:, :n], F[:, :n])
        linear = np.einsum("ija,ijab,ijb->ij", x[:, :n], 0.5 * (strain[:, None] + strain[None]), x[:, :n])
        approach = np.maximum(approach, approach - linear)
    damping = (np.minimum(0, approach) * F[:, :n] / (r2 + eta2)[:, :n])[..., None] * x[:, :n]
    expected -= fluid.scene.numerics.artificial_viscosity * sound * h * volume * damping.sum(1)
    expected[:, -1] -= 9.81
    close((fluid.velocity - before) / fluid.dt, expected, 20 * tolerance)
    deficit = 1 - W.sum(1) / lattice.density
    compressed = deficit < 0  # elsewhere the gate of the free surface reduces it
    close(fluid.work.coefficients[:n, DEFICIT][compressed], deficit[compressed], 100 * tolerance)
    own = 2 / 1000 * volume * a.sum(1)
    inside = (F * r2).sum(1) * volume / dim > fluid.k.inside + 1e-3
    close(fluid.work.coefficients[:n, DIAGONAL][inside], own[inside], tolerance)
    assert (fluid.work.coefficients[:n, DIAGONAL] >= own * (1 - tolerance)).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_artificial_viscosity_leaves_linear_velocities_alone_and_takes_energy_from_others(dim):
    """Up to the edges of disordered particles; momentum and angular momentum are kept."""
    fluid = random_fluid(dim, gravity=9.81, viscosity="none")
    fluid.force.uniform[:] = 0.0
    gradient = np.random.default_rng(1).normal(size=(dim, dim))
    noise, linear = fluid.velocity.copy(), fluid.position @ gradient.T
    for velocity, calmed in ((linear, False), (linear + noise, True)):
        fluid.velocity[:] = velocity
        fluid.begin(1e-4, np.zeros((2, 3)), np.zeros((2, 6)))
        place, before = fluid.position.copy(), fluid.velocity.copy()
        fluid.predict()
        change = fluid.velocity - before
        if calmed:
            assert (before * change).sum() < -1e-6 * (before**2).sum()
            spin = np.einsum("na,nb->ab", place, change)
            assert np.abs(spin - spin.T).max() < 1e-10 * np.abs(spin).max()
            assert np.abs(change.sum(0)).max() < 1e-10 * np.abs(change).sum()
        else:
            assert np.abs(change).max() < 1e-12 * np.abs(before).max()


@pytest.mark.parametrize("dim, precision, tolerance", CASES)
def test_corrector_applies_the_symmetric_gradient(dim, precision, tolerance):
    fluid = random_fluid(dim, precision, boundary=True, wall_guard=0.0)
    fluid.predict()
    fluid.pressure(REST)
    before = fluid.velocity.copy()
    x, _, F, _ = pairs(fluid)
    p = fluid.work.field[: fluid.count + fluid.solids.count, dim].astype(float)
    total = p[: fluid.count, None] + p[None]
    expected = 0.1**dim / 1000 * ((total * F)[..., None] * x).sum(1)
    fluid.correct()
    close((fluid.velocity - before) / fluid.dt, expected, 10 * tolerance)


@pytest.mark.parametrize("dim, precision, tolerance", CASES)
@pytest.mark.parametrize("guard", [0.0, 0.8])
def test_fluid_and_solid_exchange_opposite_impulses(dim, precision, tolerance, guard):
    """Pressure, viscosity and the wall guard together, over one step."""
    fluid = random_fluid(dim, precision, boundary=True, wall_guard=guard)
    mass = float(fluid.k.mass)
    axes = [0, 2] if dim == 2 else [0, 1, 2]
    before = mass * fluid.velocity.sum(0)
    fluid.predict()
    fluid.pressure(REST)
    wrench = fluid.wrench(viscous=True)[1]
    _, impulse = fluid.correct()
    given = (fluid.dt * wrench + impulse[1])[axes]
    gained = mass * fluid.velocity.sum(0) - before
    assert np.abs(gained + given).max() <= tolerance * mass * np.abs(fluid.velocity).sum()
    if guard:
        assert np.abs(impulse[1]).max() > 0


def test_inviscid_pair_forces_keep_angular_momentum():
    fluid = random_fluid(2, boundary=True, wall_guard=0.8, viscosity="none")
    start = fluid.position.copy()
    spin = lambda u: float(fluid.k.mass) * (start[:, 1] * u[:, 0] - start[:, 0] * u[:, 1]).sum()  # noqa: E731
    before = spin(fluid.velocity)
    fluid.predict()
    fluid.pressure(REST)
    torque = fluid.wrench(viscous=True)[1, 4]
    _, impulse = fluid.correct()
    change = spin(fluid.velocity) - before
    assert abs(change + fluid.dt * torque + impulse[1, 4]) <= 1e-11 * abs(fluid.dt * torque)


@pytest.mark.parametrize("solver", ["explicit", "chebyshev", "converged"])
@pytest.mark.parametrize("sweeps", [1, 4])
def test_responses_are_the_exact_changes_of_pressure_and_wrench(solver, sweeps):
    fluid = random_fluid(2, boundary=True, solver=solver, sweeps=sweeps)
    fluid.owners, fluid.owner[:] = 3, 2  # the solid half as a body
    fluid.begin(1e-3, np.zeros((3, 3)), np.zeros((3, 6)))
    fluid.predict()
    pushes = np.zeros((2, 3, 6))
    pushes[0, 2] = [0.3, 0, -0.2, 0, 0.5, 0]
    pushes[1, 2] = [0.0, 0, 1.0, 0, 0.0, 0]
    resting, fields, wrenches = fluid.respond(0 * pushes[0], pushes)
    at_rest = fluid.work.field[:, 2].copy()
    for push, field, wrench in zip(pushes, fields, wrenches, strict=True):
        pushed = fluid.pressure(push)
        n = len(field)
        assert np.allclose(fluid.work.field[:n, 2] - at_rest[:n], field, atol=1e-9 * np.abs(field).max())
        assert np.allclose(pushed - resting, wrench, atol=1e-9 * np.abs(wrench).max())


@pytest.mark.parametrize("threads", [2, 3])
def test_results_do_not_depend_on_threads(threads):
    states = []
    for t in (1, threads):
        fluid = random_fluid(2, "single", count=80, threads=t)
        for _ in range(3):
            fluid.predict()
            fluid.pressure(np.zeros((fluid.owners, 6)))
            fluid.correct()
            fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
        states.append((fluid.position.copy(), fluid.velocity.copy(), fluid.pressure_values.copy()))
    assert all((a == b).all() for a, b in zip(*states, strict=True))


def test_a_linear_field_of_acceleration_acts_at_the_particles():
    fluid = random_fluid(2, viscosity="none", field=[[-1.0, 0.5], [0.0, -2.0]])
    position, before = fluid.position.copy(), fluid.velocity.copy()
    fluid.predict()
    expected = position @ np.array([[-1.0, 0.0], [0.5, -2.0]])
    close((fluid.velocity - before) / fluid.dt, expected, 1e-12)
    assert np.allclose(fluid.driven(), expected.sum(0))
