"""The coupling against a fluid whose added mass is known: (M + Ma) a = F, whatever Ma is."""

import mujoco
import numpy as np
import pytest

from couplers import AddedMass
from couplers.added_mass import LIGHT, reserve

BALL = '<body name="ball"><freejoint/><geom name="ball" size="0.3" density="500"/></body>'
CHAIN = """<body name="lower"><joint name="hip" axis="0 1 0" damping="1" {limit}/>
  <geom name="lower" type="box" pos="0 0 0.5" size="0.1 0.2 0.4" density="300"/>
  <body name="upper" pos="0 0 1"><joint name="knee" axis="0 1 0" damping="2"/>
    <geom name="upper" type="box" pos="0 0 0.5" size="0.1 0.2 0.4" density="300"/></body></body>"""
HEAVE = """<body name="buoy"><joint name="heave" type="slide" axis="0 0 1" {joint}/>
  <geom name="buoy" type="box" size="0.2 0.2 0.2" density="500"/></body>"""


def spread(n, mass, ratio, seed=0):
    """Added mass (n, n) with strong coupling of all components, `ratio` times `mass` on the diagonal on average."""
    root = np.random.default_rng(seed).normal(size=(n, n))
    matrix = root @ root.T
    return matrix * ratio * mass / np.diag(matrix).mean()


def equation_of_motion(bodies, dt):
    """Mass matrix with the implicit damping of the joints, and force (nv,) without the fluid."""
    model, data = bodies.model, bodies.data
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return inertia + dt * np.diag(model.dof_damping), data.qfrc_passive - data.qfrc_bias


@pytest.mark.usefixtures("without_reserve")
@pytest.mark.parametrize("ratio", [0.1, 1.0, 30.0, 1000.0])
@pytest.mark.parametrize("world", [BALL, CHAIN.format(limit="")], ids=["free", "chain"])
def test_bodies_and_fluid_accelerate_together(make_bodies, linear_fluid, world, ratio):
    bodies = make_bodies(world)
    count, dt = len(bodies.names), 1e-3
    matrix = spread(6 * count, bodies.mass.sum(), ratio)
    fluid = linear_fluid(matrix, np.random.default_rng(1).normal(size=(count, 6)) * 30 * (1 + ratio))
    coupler = AddedMass(bodies)
    for _ in range(200):
        motion = bodies.motion()
        inertia, force = equation_of_motion(bodies, dt)
        jacobian = motion.jacobian.reshape(6 * count, -1)
        total = inertia + jacobian.T @ matrix @ jacobian
        exact = np.linalg.solve(total, force + jacobian.T @ (fluid.base.ravel() - matrix @ motion.bias.ravel()))
        wrench = coupler.step(fluid, bodies, 0.0, dt)
        realised = motion.jacobian @ coupler.acceleration + motion.bias
        assert coupler.acceleration == pytest.approx(exact, rel=1e-4, abs=1e-6 * np.abs(exact).max())
        assert fluid.field == pytest.approx(realised)
        settled = fluid.base.ravel() - matrix @ realised.ravel()
        assert wrench.ravel() == pytest.approx(settled, abs=1e-9 * np.abs(fluid.base).max())
    assert bodies.unsettled == 0 and np.isfinite(bodies.data.qvel).all()


@pytest.mark.usefixtures("without_reserve")
def test_settled_wrench_and_momentum(make_bodies, linear_fluid):
    """Momentum of the body alone grows by the impulse of the wrench that the coupler returns."""
    bodies = make_bodies(BALL)
    fluid = linear_fluid(spread(6, bodies.mass[0], 5.0), [10.0, 20.0, 30.0, 0.4, 0.5, 0.6])
    coupler, impulse, dt = AddedMass(bodies), np.zeros(3), 2e-3
    for _ in range(100):
        impulse += coupler.step(fluid, bodies, 0.0, dt)[0, :3] * dt
    assert bodies.mass[0] * bodies.motion().velocity[0, :3] == pytest.approx(impulse, rel=1e-9)


@pytest.mark.usefixtures("without_reserve")
def test_substeps_share_the_impulse(make_bodies, linear_fluid):
    """A file with a shorter time step gives the same constant acceleration."""
    bodies = make_bodies(HEAVE.format(joint=""), option='timestep="0.0003"')
    fluid = linear_fluid(spread(6, bodies.mass[0], 20.0), [0, 0, 50.0, 0, 0, 0])
    coupler = AddedMass(bodies)
    for _ in range(10):
        coupler.step(fluid, bodies, 0.0, 2e-3)
    expected = 50.0 / (bodies.mass[0] + fluid.matrix[2, 2])
    assert coupler.acceleration == pytest.approx([expected])
    assert bodies.joints()["joint_velocity"] == pytest.approx([0.02 * expected])
    assert any("substeps of at most 0.0003 s" in note for note in bodies.notes)


@pytest.mark.parametrize("ratio", [0.5, 20.0])
def test_soft_spring_keeps_period_and_energy(make_bodies, linear_fluid, ratio):
    stiffness, dt = 900.0, 2e-3
    bodies = make_bodies(HEAVE.format(joint=f'stiffness="{stiffness}"'))
    fluid = linear_fluid(np.eye(6) * ratio * bodies.mass[0], np.zeros(6))
    omega = np.sqrt(stiffness / (bodies.mass[0] * (1 + ratio)))
    bodies.place({"heave": 0.1}, {})
    coupler, heave = AddedMass(bodies), []
    for _ in range(round(5.25 * 2 * np.pi / omega / dt)):
        coupler.step(fluid, bodies, 0.0, dt)
        heave.append(bodies.joints()["joint_position"][0])
    crossings = np.flatnonzero(np.diff(np.sign(heave)))
    times = dt * (crossings + 1 + np.array([heave[i] / (heave[i] - heave[i + 1]) for i in crossings]))
    assert 2 * np.diff(times).mean() == pytest.approx(2 * np.pi / omega, rel=2e-3)
    assert max(heave[len(heave) // 2 :]) == pytest.approx(0.1, rel=2e-3)
    assert not bodies.notes


@pytest.mark.parametrize("ratio", [0.0, 1.0, 100.0])
def test_a_stiff_spring_stays_put(make_bodies, linear_fluid, ratio):
    """A thousand oscillations to the step: taken implicitly, it yields by force over stiffness and says so."""
    bodies = make_bodies(HEAVE.format(joint='stiffness="1e9"'))
    fluid = linear_fluid(np.eye(6) * ratio * bodies.mass[0], [0, 0, 5e3, 0, 0, 0])
    coupler = AddedMass(bodies)
    for _ in range(300):
        coupler.step(fluid, bodies, 0.0, 1e-3)
        assert abs(bodies.joints()["joint_position"][0]) < 1e-5
    assert bodies.joints()["joint_position"][0] == pytest.approx(5e-6, rel=0.01)
    assert any("spring too stiff for the time step" in note for note in bodies.notes)
    assert bodies.joints()["pto_power"] == pytest.approx([0.0], abs=1e-12)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 100.0])
def test_a_joint_limit_holds(make_bodies, linear_fluid, ratio):
    """A chain is driven against the limit of its hip: it stops there, and the added inertia settles."""
    limit = 'range="-20 20" solreflimit="0.004 1"'
    bodies = make_bodies(CHAIN.format(limit=limit))
    fluid = linear_fluid(spread(12, bodies.mass.sum(), ratio), 40.0 * (1 + ratio) * np.tile([1, 0, 0, 0, 1, 0], (2, 1)))
    coupler, angle = AddedMass(bodies), []
    for _ in range(1500):
        coupler.step(fluid, bodies, 0.0, 1e-3)
        angle.append(bodies.joints()["joint_position"][0])
    assert max(angle) > np.radians(19.9)
    assert max(angle) < np.radians(21.0)
    assert bodies.unsettled == 0


def test_components_out_of_the_plane_cost_nothing(make_bodies, linear_fluid):
    """In two dimensions a free body has three responses, and a pitching chain two."""
    for world, solutions in ((BALL, 3), (CHAIN.format(limit=""), 2)):
        bodies = make_bodies(world, dimension=2)
        count = len(bodies.names)
        fluid = linear_fluid(np.eye(6 * count), np.zeros((count, 6)))
        AddedMass(bodies).step(fluid, bodies, 0.0, 1e-3)
        assert fluid.solutions == solutions


@pytest.mark.usefixtures("without_reserve")
def test_an_unsymmetrical_added_mass_is_met_exactly(make_bodies, linear_fluid):
    """As from a few sweeps of the pressure: the part that is not symmetrical does no work."""
    bodies = make_bodies(BALL)
    skew = np.triu(np.random.default_rng(3).normal(size=(6, 6)), 1) * bodies.mass[0] * 30
    fluid = linear_fluid(spread(6, bodies.mass[0], 100.0) + skew - skew.T, [100.0, 200.0, 300.0, 10.0, 20.0, 30.0])
    coupler = AddedMass(bodies)
    for _ in range(300):
        motion = bodies.motion()
        inertia, force = equation_of_motion(bodies, 1e-3)
        jacobian = motion.jacobian[0]
        total = inertia + jacobian.T @ fluid.matrix @ jacobian
        exact = np.linalg.solve(total, force + jacobian.T @ (fluid.base[0] - fluid.matrix @ motion.bias[0]))
        coupler.step(fluid, bodies, 0.0, 1e-3)
        assert coupler.acceleration == pytest.approx(exact, abs=1e-4 * np.abs(exact).max())
    assert bodies.unsettled == 0


def test_noise_below_the_own_inertia_does_no_harm(make_bodies, linear_fluid):
    """Added mass in one direction only, a thousand times the own mass, with noise that makes it indefinite."""
    bodies = make_bodies(BALL)
    rng = np.random.default_rng(3)
    direction, noise = rng.normal(size=6), rng.normal(size=(6, 6)) * 0.005 * bodies.mass[0]
    matrix = 1000 * bodies.mass[0] * np.outer(direction, direction) + noise + noise.T
    fluid = linear_fluid(matrix, [1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    coupler = AddedMass(bodies)
    assert np.linalg.eigvalsh(fluid.matrix).min() < 0
    for _ in range(300):
        coupler.step(fluid, bodies, 0.0, 1e-3)
    assert np.abs(coupler.acceleration).max() < 1 and bodies.unsettled == 0


def test_fixed_walls_alone_need_no_exchange(make_bodies, linear_fluid, tmp_path):
    """A body file may hold nothing but a wet ramp."""
    wet = '</worldbody><custom><tuple name="wet"><element objtype="geom" objname="ramp"/></tuple></custom><worldbody>'
    bodies = make_bodies(f'<geom name="ramp" type="box" size="1 1 0.2"/>{wet}')
    wrench = AddedMass(bodies).step(linear_fluid(np.zeros((0, 0)), np.zeros((0, 6))), bodies, 0.0, 1e-3)
    assert wrench.shape == (0, 6) and [owner for owner, _ in bodies.solids()] == [0]


def test_a_reserve_is_for_very_light_bodies_and_their_trees(make_bodies):
    """A multiple of the mass matrix of the tree that holds the light body, nothing elsewhere."""
    light = '<geom type="box" pos="0 0 0.5" size="0.1 0.2 0.4" density="300"/>'
    chain = f'<body><joint axis="0 1 0"/>{light}<body pos="0 0 1"><joint axis="0 1 0"/>{light}</body></body>'
    bodies = make_bodies(chain + f'<body pos="1 0 0"><freejoint/>{light}</body>')
    own, jacobian = bodies.inertia(), bodies.motion().jacobian
    added = np.diag(np.diag(own)) * LIGHT
    assert not reserve(own, added, jacobian).any()
    added[1, 1] *= 4
    found = reserve(own, added, jacobian)
    assert found[:2, :2] == pytest.approx(3 * own[:2, :2]) and own[0, 1] != 0
    assert not found[2:].any() and not found[:, 2:].any()
    added[4, 4] *= 11
    found = reserve(own, added, jacobian)
    assert found[2:, 2:] == pytest.approx(10 * own[2:, 2:]) and found[:2, :2] == pytest.approx(3 * own[:2, :2])


def test_a_reserve_settles_to_the_same_acceleration(make_bodies, linear_fluid):
    """Along x, where the fluid adds nothing, it takes ten times the reserve's share of the own mass in steps."""
    bodies = make_bodies(BALL)
    fluid = linear_fluid(np.diag([0, 0, 10 * LIGHT * bodies.mass[0], 0, 0, 0]), [[10.0, 0, 1e3, 0, 0, 0.0]])
    coupler, found = AddedMass(bodies), []
    for _ in range(100):
        coupler.step(fluid, bodies, 0.0, 1e-3)
        found.append(coupler.acceleration[:3])
    total = (10 * LIGHT + 1) * bodies.mass[0]
    assert found[0][0] < 0.2 * 10 / bodies.mass[0]
    assert found[-1] == pytest.approx([10 / bodies.mass[0], 0, 1e3 / total], rel=1e-3, abs=1e-9)
