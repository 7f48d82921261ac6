"""Liquids of unequal density: operators against plain sums, conservation, hydrostatics and an interface at rest."""

import numpy as np
import pytest
from tanks import pairs, random_fluid

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import Layout
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.sph.columns import COUNTS, DIAGONAL, SOURCE

REST = np.zeros((2, 6))
CASES = [(2, "double", 1e-12), (3, "double", 1e-12), (2, "single", 3e-5), (3, "single", 3e-5)]


def two_liquids(dim, precision="double", ratio=7.0, boundary=False, **numerics) -> Fluid:
    """A jittered block whose upper half is `ratio` times as dense and as viscous; see `random_fluid`."""
    plain = random_fluid(dim, precision, boundary=boundary, **numerics)
    data = plain.scene.model_dump(exclude_none=True)
    corner = {"min": [-2.0] * dim, "max": [-1.9] * dim}
    data["liquids"] = {"heavy": {"density": 1000 * ratio, "kinematic_viscosity": 0.1, "blocks": [corner]}}
    scene = Scene.model_validate(data)
    heavy, volume = (plain.position[:, -1] > 0).astype(np.int8), scene.spacing**dim
    layout = Layout(
        plain.position, plain.velocity, plain.pressure_values.astype(float), plain.boundary, plain.owner,
        np.array(scene.tank.min), np.array(scene.tank.max), 1.0, volume, (), heavy,
    )  # fmt: skip
    fluid = Fluid(scene, layout, Team(1))
    fluid.boundary_velocity[:] = plain.boundary_velocity
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    return fluid


@pytest.mark.parametrize("dim, precision, tolerance", CASES)
def test_pressure_equation_and_gradient_match_all_pairs(dim, precision, tolerance):
    fluid = two_liquids(dim, precision, boundary=True, wall_guard=0.0, sweeps=1, solver="explicit")
    fluid.predict()
    fluid.pressure(REST)
    x, r2, F, _ = pairs(fluid)
    n, h, volume, r = fluid.count, fluid.scene.smoothing_length, 0.1**dim, fluid.relative
    assert set(np.round(r, 9)) == {1.0, 7.0}
    both = np.hstack([np.tile(r, (n, 1)), np.tile(r[:, None], fluid.solids.count)])  # a wall's is its partner's
    link = 2 / (r[:, None] + both)
    a = 2 / 1000 * volume * F * r2 / (r2 + (0.1 * h) ** 2) * link
    inside = (F * r2).sum(1) * volume / dim > fluid.k.inside + 1e-3
    diagonal = fluid.work.coefficients[:n, DIAGONAL].astype(float)
    assert np.abs(diagonal - a.sum(1))[inside].max() <= 10 * tolerance * diagonal.max()
    trial = fluid.work.trial[: n + fluid.solids.count, dim].astype(float)
    expected = (a @ trial - fluid.work.coefficients[:n, SOURCE]) / diagonal
    p = fluid.work.field[: n + fluid.solids.count, dim].astype(float)
    solved = p[:n] / fluid.work.coefficients[:n, COUNTS]  # before rows under the surface count more
    assert np.abs(solved - expected).max() <= 20 * tolerance * np.abs(p).max()
    before = fluid.velocity.copy()
    between = (both * p[:n, None] + r[:, None] * p[None]) * link / r[:, None]
    acceleration = volume / 1000 * ((between * F)[..., None] * x).sum(1)
    fluid.correct()
    assert (
        np.abs((fluid.velocity - before) / fluid.dt - acceleration).max() <= 20 * tolerance * np.abs(acceleration).max()
    )


@pytest.mark.parametrize("dim, precision, tolerance", CASES)
@pytest.mark.parametrize("how", ["explicit", "implicit"])
def test_momentum_is_kept_between_liquids_and_walls(dim, precision, tolerance, how):
    """Pressure, viscosity, artificial viscosity and the wall guard; implicit viscosity up to the share of it solved for."""
    fluid = two_liquids(dim, precision, boundary=how == "explicit", viscous_step=how)
    mass = float(fluid.k.mass) * fluid.relative
    axes = [0, 2] if dim == 2 else [0, 1, 2]
    before = mass @ fluid.velocity
    fluid.predict()
    fluid.pressure(np.zeros((fluid.owners, 6)))
    wrench = fluid.wrench(viscous=True)
    sums, impulse = fluid.correct()
    given = (fluid.dt * wrench + impulse)[1:, axes].sum(0)
    gained = mass @ fluid.velocity - before
    assert np.abs(gained + given).max() <= tolerance * (mass @ np.abs(fluid.velocity)).sum()
    assert np.abs(sums[6 : 6 + dim] - mass @ fluid.velocity).max() <= 1e-6 * (mass @ np.abs(fluid.velocity)).sum()


def test_responses_between_liquids_are_exact():
    fluid = two_liquids(2, boundary=True)
    fluid.owners, fluid.owner[:] = 3, 2
    fluid.begin(1e-3, np.zeros((3, 3)), np.zeros((3, 6)))
    fluid.predict()
    push = np.zeros((1, 3, 6))
    push[0, 2] = [0.3, 0, -0.2, 0, 0.5, 0]
    resting, fields, wrenches = fluid.respond(0 * push[0], push)
    at_rest = fluid.work.field[:, 2].copy()
    pushed = fluid.pressure(push[0])
    n = fields.shape[1]
    assert np.allclose(fluid.work.field[:n, 2] - at_rest[:n], fields[0], atol=1e-9 * np.abs(fields).max())
    assert np.allclose(pushed - resting, wrenches[0], atol=1e-9 * np.abs(wrenches).max())


def layers(lower: float, upper: float, spacing=0.02, duration=1.0, **numerics) -> Simulation:
    """Two layers of 0.2 m at rest in a tank 0.4 m long."""
    return Simulation(
        Scene.model_validate(
            {
                "spacing": spacing,
                "duration": duration,
                "tank": {"min": [0, -0.4], "max": [0.4, 0.2]},
                "fluid": {"density": upper},
                "liquids": {"lower": {"density": lower, "blocks": [{"min": [0, -0.4], "max": [0.4, -0.2]}]}},
                "numerics": numerics,
            }
        ),
        threads=1,
    )


@pytest.mark.parametrize("lower", [1000.0, 2000.0])
def test_a_full_tank_under_gravity_stays_at_rest(lower):
    """Its pressure is measured from the smallest: from the mean, half of it would be tension, which tears particles apart."""
    data = layers(lower, 1000.0).scene.model_dump(exclude_none=True)
    data["tank"] = {"min": [0, -0.4], "max": [0.4, 0.0], "walls": ["x-", "x+", "z-", "z+"]}
    sim = Simulation(Scene.model_validate(data), threads=1)
    sim.run()
    z, p = sim.fluid.position[:, 1], sim.fluid.pressure_values
    exact = layered_pressure(z, lower, 1000.0)
    error = p - p.mean() - exact + exact.mean()
    assert np.sqrt((error**2).mean()) < 0.005 * exact.max()
    assert np.sqrt((sim.fluid.velocity**2).sum(1).mean()) < 0.01 * np.sqrt(9.81 * 0.4)
    assert ((sim.fluid.liquid[sim.fluid.label] == 1) == (z < -0.2)).all()


def layered_pressure(z, lower, upper):
    return 9.81 * (upper * np.minimum(-z, 0.2) + lower * np.maximum(-z - 0.2, 0.0))


def test_layers_start_at_their_pressure():
    sim = layers(2000.0, 1000.0)
    exact = layered_pressure(sim.fluid.position[:, 1], 2000.0, 1000.0)
    assert np.allclose(sim.fluid.pressure_values, exact, rtol=1e-6)
    assert np.bincount(sim.fluid.liquid[sim.fluid.label]).tolist() == [200, 200]


def test_layers_at_rest_keep_their_pressure_and_do_not_mix():
    sim = layers(2000.0, 1000.0)
    sim.run()
    z, heavy = sim.fluid.position[:, 1], sim.fluid.relative > 1
    exact = layered_pressure(z, 2000.0, 1000.0)
    deep = z < -0.04
    assert np.sqrt(((sim.fluid.pressure_values - exact)[deep] ** 2).mean()) < 0.02 * exact.max()
    assert z[heavy].max() < -0.2 and z[~heavy].min() > -0.2
    assert sim.balance.audit()["momentum_residual"] < 1e-5
