"""Viscosity that varies, turbulence and implicit viscosity against exact flows, dense matrices and conservation."""

import math

import numpy as np
import pytest
from tanks import pairs, random_fluid, still_tank

from cases.validation.fluid import yield_flows
from fsi.fluid import timestep
from fsi.fluid.rheology import height_above
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.sph import kernel

PLASTIC = {"mu_inf": 1.0, "mu_0": 1000.0, "yield_stress": 20.0}
REST = np.zeros((2, 6))


def linear_flow(fluid, gradient):
    """Give the fluid the velocity `gradient` @ x."""
    fluid.velocity[:] = fluid.position @ np.asarray(gradient).T
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    fluid.predict()
    return fluid


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("boundary", [False, True])
def test_a_rotating_solid_has_no_strain_and_shear_has_its_own(dim, boundary):
    """On disordered particles with edges, where uncorrected gradients see strain of the size of the rotation."""
    fluid = random_fluid(dim, boundary=boundary, turbulence="smagorinsky", wall_slip="free_slip")
    spin = np.zeros((dim, dim))
    spin[0, -1], spin[-1, 0] = 3.0, -3.0
    linear_flow(fluid, spin)
    assert fluid.rheology.rate.max() < 1e-9
    shear = np.zeros((dim, dim))
    shear[0, -1] = 3.0
    linear_flow(fluid, shear)
    assert np.allclose(fluid.rheology.rate, 3.0, rtol=1e-9)
    eddy = (0.12 * 0.1) ** 2 * 3.0
    assert np.allclose(fluid.rheology.fields(fluid.work.flow, fluid.count)["eddy_viscosity"], eddy, rtol=1e-9)
    assert np.allclose(fluid.work.flow[: fluid.count, 2 * dim], 1000 * (0.1 + eddy), rtol=1e-9)


def test_strain_of_a_pure_straining_flow():
    fluid = linear_flow(random_fluid(2, turbulence="smagorinsky"), [[2.0, 0.0], [0.0, -2.0]])
    assert np.allclose(fluid.rheology.rate, 4.0, rtol=1e-9)  # sqrt(2 (2^2 + 2^2))


def test_the_coefficient_of_the_eddies_is_that_of_the_flow():
    """0 in a linear shear on any particles; sqrt(1 / (48 sqrt(3))) = 0.110 in a uniform contraction on two axes, where
    L = var A A and M = -24 var s S; below 0, which is cut off, in an extension on two."""
    fluid = random_fluid(3, turbulence="dynamic")
    linear_flow(fluid, np.array([[0, 0, 3.0], [0, 0, 0], [0, 0, 0]]))
    assert fluid.rheology.dynamic.coefficient.max() < 1e-12
    contraction = np.diag([1.0, 1.0, -2.0])
    linear_flow(fluid, contraction)
    inside = np.abs(fluid.position).max(1) < 0.2
    found = np.sqrt(fluid.rheology.dynamic.coefficient[inside])
    assert found == pytest.approx(math.sqrt(1 / (48 * math.sqrt(3))), rel=0.05)
    eddies = fluid.rheology.dynamic.coefficient * 0.1**2 * math.sqrt(12)
    assert np.allclose(fluid.rheology.fields(fluid.work.flow, fluid.count)["eddy_viscosity"], eddies, rtol=1e-9)
    assert np.allclose(fluid.work.flow[: fluid.count, 6], 1000 * (0.1 + eddies), rtol=1e-9)
    linear_flow(fluid, -contraction)
    assert fluid.rheology.dynamic.coefficient[inside].max() == 0.0


def test_plastic_viscosity_follows_the_shear_rate():
    fluid = random_fluid(2, liquid={"rheology": PLASTIC})
    for rate in (0.0, 1e-3, 1.0, 50.0):
        linear_flow(fluid, [[0.0, rate], [0.0, 0.0]])
        expected = 1.0 + 999.0 / (1 + 50.0 * rate)
        assert np.allclose(fluid.work.flow[: fluid.count, 4], expected, rtol=1e-7)
    assert expected * rate == pytest.approx(20.0 + rate, rel=0.01)  # the plastic's stress


def test_herschel_bulkley_follows_its_law():
    """k s^n + tau above the yield stress, mu_0 at rest."""
    law = {"law": "herschel_bulkley", "consistency": 2.0, "exponent": 0.5, "yield_stress": 20.0, "mu_0": 1e4}
    fluid = random_fluid(2, liquid={"rheology": law})
    for rate in (1e-9, 1.0, 50.0):
        linear_flow(fluid, [[0.0, rate], [0.0, 0.0]])
        stress = fluid.work.flow[: fluid.count, 4] * rate
        assert np.allclose(stress, min(2.0 * rate**0.5 + 20.0, 1e4 * rate), rtol=1e-6)


def test_grains_carry_the_friction_of_their_weight():
    """mu(I) p with p the weight of the grains above, less that of the liquid in their pores."""
    law = {"law": "granular", "friction": 0.4, "friction_fast": 0.7, "grain_diameter": 0.01, "mu_0": 1e6}
    rate = 3.0
    grains = {"density": 1600.0, "rheology": law | {"pore_density": 1000.0}}
    fluid = Simulation(still_tank(spacing=0.05, length=1.0, fluid=grains), threads=1).fluid
    linear_flow(fluid, [[0.0, rate], [0.0, 0.0]])
    p = 9.81 * 600.0 * -fluid.position[:, 1]
    number = rate * 0.01 * np.sqrt(2500.0 / p)
    stress = (0.4 + 0.3 / (1 + 0.3 / number)) * p
    inner = np.abs(fluid.position[:, 0] - 0.5) < 0.3  # the mirrored velocities of the walls add to the rate
    inner &= fluid.position[:, 1] > fluid.position[:, 1].min() + 0.21
    assert inner.any()
    assert np.allclose(fluid.work.flow[: fluid.count, 4][inner] * rate, stress[inner], rtol=1e-3)


def test_height_above_is_what_stands_above():
    """Rows of a lattice that lie anywhere in the columns, the top ones apart: as many rows as there are; half columns at the
    ends count as full. On a slope it is the way to the surface."""
    rows = 0.1 * (np.arange(8) + 0.37) + 0.012 * (np.arange(8) > 5)
    shifts = 0.1 * np.random.default_rng(0).uniform(size=8)
    points = np.concatenate([np.stack([0.1 * np.arange(20) + shifts[j], np.full(20, rows[j])], 1) for j in range(8)])
    above = height_above(points, 0.1, 0.01).reshape(8, 20)
    exact = 0.1 * (8 - np.arange(8) - 0.5)
    assert np.abs(above[:, 2:-2] - exact[:, None]).max() < 0.01
    assert np.abs(height_above(points[::-1], 0.1, 0.01)[::-1].reshape(8, 20) - above).max() == 0
    points[:, 0] = 0.04 + 0.1 * np.tile(np.arange(20), 8)
    above = height_above(points, 0.1, 0.01).reshape(8, 20)
    assert np.abs(above / exact[:, None] - 1).max() < 0.05
    x, z = np.meshgrid(np.arange(0.05, 2, 0.1), np.arange(0.05, 1, 0.1), indexing="ij")
    points = np.stack([x, z], -1).reshape(-1, 2)
    points = points[points[:, 1] < 0.8 - 0.25 * points[:, 0]]
    inner = (points[:, 0] > 0.1) & (points[:, 0] < 1.9)
    surface = points[:, 1] + height_above(points, 0.1, 0.01)
    assert np.abs(surface - (0.8 - 0.25 * points[:, 0]))[inner].max() < 0.06


@pytest.mark.parametrize("dim, precision, tolerance", [(2, "double", 1e-12), (3, "double", 1e-12), (2, "single", 3e-5)])
@pytest.mark.parametrize("how", ["explicit", "implicit"])
def test_varying_viscosity_keeps_momentum(dim, precision, tolerance, how):
    """Fluid alone to round-off, explicit or implicit, however far the sweeps are from the solution."""
    fluid = random_fluid(dim, precision, liquid={"rheology": PLASTIC}, viscous_step=how)
    before = fluid.velocity.sum(0)
    fluid.predict()
    size = np.abs(fluid.velocity).sum()
    assert np.abs(fluid.velocity.sum(0) - before).max() <= tolerance * size
    assert np.ptp(fluid.work.flow[: fluid.count, 2 * dim]) > 1.0


@pytest.mark.parametrize("dim, precision, tolerance", [(2, "double", 1e-12), (3, "double", 1e-12), (2, "single", 3e-5)])
def test_fluid_and_wall_exchange_opposite_viscous_impulses(dim, precision, tolerance):
    fluid = random_fluid(dim, precision, boundary=True, turbulence="smagorinsky")
    axes = [0, 2] if dim == 2 else [0, 1, 2]
    before = fluid.velocity.sum(0)
    fluid.predict()
    fluid.pressure(REST)
    drag = (fluid.wrench(viscous=True) - fluid.wrench())[1, axes]
    change = float(fluid.k.mass) * (fluid.velocity.sum(0) - before)
    assert np.abs(change + fluid.dt * drag).max() <= tolerance * np.abs(drag).max() * fluid.dt + 1e-12


@pytest.mark.parametrize("boundary", [False, True])
def test_implicit_viscosity_solves_its_equation(boundary):
    """Against a dense matrix; with walls, whose mirrored velocities depend on the fluid's, also as a matrix."""
    fluid = random_fluid(2, boundary=boundary, viscous_step="implicit", artificial_viscosity=0.0)
    dt, fluid.pressure_values[:] = 0.5, 0.0
    fluid.begin(dt, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    start = fluid.velocity.copy()
    fluid.predict()
    _, r2, F, W = pairs(fluid)
    n, h = fluid.count, fluid.scene.smoothing_length
    a = F * r2 / (r2 + (0.1 * h) ** 2) * 2 * 0.1 * 0.1**2 / kernel.lattice(0.1, h, 2).second_moment
    A = a[:, :n] - np.diag(a.sum(1))
    right = start
    if boundary:
        shepard = W[:, n:] / np.maximum(W[:, n:].sum(0), 1e-300)
        A = A - a[:, n:] @ shepard.T
        right = start + dt * 2 * a[:, n:] @ fluid.solids.velocity[: fluid.solids.count]
    exact = np.linalg.solve(np.eye(n) - dt * A, right)
    stiffness = dt * np.abs(A).sum(1).max()
    assert stiffness > 10
    assert np.abs(fluid.velocity - exact).max() < 1e-3 * np.abs(right - exact).max()


@pytest.mark.parametrize("case, speed", [("channel", "herschel_bulkley_speed"), ("incline", "bagnold_speed")])
def test_a_steady_profile_stays(case, speed):
    """A plastic beside its yield surface, and grains up to their surface, where half of the pairs are missing."""
    spacing = 0.005
    sim = Simulation(Scene.model_validate(getattr(yield_flows, case)(spacing, None) | {"spacing": spacing}), threads=1)
    origin = 0.5 * yield_flows.GAP if case == "channel" else 0.0
    exact = getattr(yield_flows, speed)(sim.fluid.position[:, 1] - origin)
    sim.fluid.velocity[:, 0] = exact
    sim.run(0.3)
    off = (sim.fluid.velocity[:, 0] - getattr(yield_flows, speed)(sim.fluid.position[:, 1] - origin)) / exact.max()
    assert np.sqrt((off**2).mean()) < 0.01  # with the plain mean of the gradients 2.7 % in the channel
    assert abs(off[sim.fluid.position[:, 1] > 0.095].mean()) < 0.01 or case == "channel"  # 2.1 % with plain weights


def poiseuille(step: float | None, duration=1.0, **numerics) -> Simulation:
    """Flow between plates 1 mm apart, 10 spacings across; the largest speed is 1.25e-5 m/s."""
    gap = 1e-3
    return Simulation(
        Scene.model_validate(
            {
                "spacing": gap / 10,
                "duration": duration,
                "gravity": 0.0,
                "tank": {"min": [0, 0], "max": [1.7 * gap, gap], "walls": ["z-", "z+"], "periodic": ["x"]},
                "fluid": {"still_water_level": gap, "start": "zero", "acceleration": [1e-4, 0.0]},
                "numerics": {"max_time_step": step} | numerics,
            }
        )
    )


def test_steps_far_beyond_the_explicit_limit_settle_to_the_exact_profile():
    """A hundred times as long as explicit viscosity takes them."""
    h = 1.5e-4
    sim = poiseuille(step=100 * 0.125 * h * h / 1e-6, duration=3.0)
    assert sim.fluid.rheology.implicit and any("implicit" in note for note in sim.warnings)
    sim.run()
    z = sim.fluid.position[:, 1]
    exact = 50.0 * z * (1e-3 - z)
    assert np.abs(sim.fluid.velocity[:, 0] - exact).max() < 0.05 * 1.25e-5
    assert sim.step_count < 20


def test_implicit_viscosity_holds_up_no_weight():
    """Honey a thousand times as stiff as real one, at rest: the pressure is that of water at rest."""
    scene = still_tank(spacing=0.025, length=0.3, fluid={"kinematic_viscosity": 1.0})
    sim = Simulation(scene, threads=1)
    sim.run(1.0)
    z = sim.fluid.position[:, 1]
    assert sim.fluid.rheology.implicit
    error = (sim.fluid.pressure_values + 9810 * z)[z < -0.05] / (9810 * 0.5)
    assert np.sqrt((error**2).mean()) < 0.005


def test_viscosity_is_implicit_only_where_that_pays():
    h = 1.5e-4
    for step, implicit in ((0.5 * 0.125 * h * h / 1e-6, False), (None, False), (10 * 0.125 * h * h / 1e-6, True)):
        sim = poiseuille(step)
        assert timestep.TimeStep(sim.scene, 1.0).implicit == implicit
        assert (sim.fluid.rheology is not None) == implicit
