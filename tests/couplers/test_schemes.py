"""The schemes beside each other, against a fluid whose added mass is known."""

import numpy as np
import pytest

from couplers import AddedMass, FixedPoint, Lagged, make
from couplers.quasi_newton import QuasiNewton
from fsi.scene.model import CouplerSettings

BALL = '<body name="ball"><freejoint/><geom name="ball" size="0.3" density="500"/></body>'
PAIR = """<body name="fore" pos="-0.5 0 0"><freejoint/><geom name="fore" type="box" size="0.4 0.2 0.1" density="300"/>
  <body name="aft" pos="0.5 0 0"><joint name="hinge" axis="0 1 0" damping="1"/>
    <geom name="aft" type="box" pos="0.5 0 0" size="0.4 0.2 0.1" density="300"/></body></body>
  <body name="near" pos="0 1 0"><joint name="heave" type="slide" axis="0 0 1"/>
    <geom name="near" size="0.2" density="100"/></body>"""
STOPPED = """<body name="flap"><joint name="hip" axis="0 1 0" range="-20 20" solreflimit="0.004 1"/>
  <geom name="flap" type="box" pos="0 0 0.5" size="0.1 0.2 0.4" density="300"/></body>"""


def dense(n, mass, ratio, seed=0):
    """Added mass (n, n) that couples every component of every body with every other."""
    root = np.random.default_rng(seed).normal(size=(n, n))
    matrix = root @ root.T
    return matrix * ratio * mass / np.diag(matrix).mean()


@pytest.mark.parametrize("n, slope", [(1, 50.0), (3, 10.0), (12, 1000.0)])
def test_an_affine_map_is_solved_in_as_many_calls_as_it_has_unknowns(n, slope):
    rng = np.random.default_rng(n)
    matrix, constant = slope * rng.normal(size=(n, n)), rng.normal(size=n)
    exact = np.linalg.solve(np.eye(n) - matrix, constant)
    solver, x = QuasiNewton(), np.zeros(n)
    calls = 0
    while np.abs((image := matrix @ x + constant) - x).max() > 1e-8 * slope:
        x, calls = solver.next(x, image, np.ones(n)), calls + 1
        assert calls <= n + 1
    assert x == pytest.approx(exact, rel=1e-6, abs=1e-9)


def test_the_next_problem_profits_from_the_last():
    rng = np.random.default_rng(0)
    matrix, solver, calls = 20 * rng.normal(size=(4, 4)), QuasiNewton(), []
    for _ in range(3):
        constant, x = rng.normal(size=4), np.zeros(4)
        solver.begin()
        calls.append(0)
        while np.abs((image := matrix @ x + constant) - x).max() > 1e-8:
            x, calls[-1] = solver.next(x, image, np.ones(4)), calls[-1] + 1
    assert calls[0] == 5 and max(calls[1:]) <= 2


@pytest.mark.usefixtures("without_reserve")
@pytest.mark.parametrize("ratio", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("world", [BALL, PAIR], ids=["ball", "pair"])
def test_the_fixed_point_is_where_the_default_scheme_lands(make_bodies, linear_fluid, world, ratio):
    """Free joints, a joint tree and a body beside it, all coupled by the fluid: dense added inertia."""
    results, updates = {}, 0
    for scheme in (AddedMass, FixedPoint):
        bodies = make_bodies(world, gravity=9.81)
        count = len(bodies.names)
        fluid = linear_fluid(
            dense(6 * count, bodies.mass.mean(), ratio), np.tile([3.0, 1, 40, 0.2, 0.3, 0.1], (count, 1))
        )
        coupler, path = scheme(bodies), []
        solve, calls = fluid.pressure, []
        fluid.pressure = lambda acceleration, solve=solve, calls=calls: calls.append(1) or solve(acceleration)
        for _ in range(50):
            wrench = coupler.step(fluid, bodies, 0.0, 2e-3)
            path.append(np.concatenate([coupler.acceleration, wrench.ravel()]))
        results[scheme], updates = np.array(path), len(calls) / 50
    scale = np.abs(results[AddedMass]).max(0)
    assert results[FixedPoint] == pytest.approx(results[AddedMass], abs=2e-4 * scale.max())
    assert not coupler.notes and updates < 6


def test_the_fixed_point_conserves_momentum_exactly(make_bodies, linear_fluid):
    bodies = make_bodies(BALL)
    fluid = linear_fluid(dense(6, bodies.mass[0], 5.0), [10.0, 20.0, 30.0, 0.4, 0.5, 0.6])
    coupler, impulse, dt = FixedPoint(bodies), np.zeros(3), 2e-3
    for _ in range(50):
        impulse += coupler.step(fluid, bodies, 0.0, dt)[0, :3] * dt
    assert bodies.mass[0] * bodies.motion().velocity[0, :3] == pytest.approx(impulse, rel=1e-10)


def test_every_pass_starts_from_the_same_state(make_bodies, linear_fluid):
    """As if the settled acceleration had been known beforehand: one pass with it gives the same state, bit for bit."""
    bodies = make_bodies(PAIR, gravity=9.81)
    fluid = linear_fluid(dense(18, bodies.mass.mean(), 20.0), np.tile([3.0, 1, 40, 0.2, 0.3, 0.1], (3, 1)))
    coupler = FixedPoint(bodies)
    for _ in range(5):
        coupler.step(fluid, bodies, 0.0, 2e-3)
    start, motion = bodies.state(), bodies.motion()
    wrench = coupler.step(fluid, bodies, 0.0, 2e-3)
    ended = bodies.state()
    bodies.restore(start)
    assert (bodies.motion().velocity == motion.velocity).all()
    nv = motion.jacobian.shape[2]
    bodies.advance(2e-3, wrench, np.zeros((nv, nv)), coupler.acceleration)
    assert (bodies.state()["mujoco"] == ended["mujoco"]).all()


def test_the_fixed_point_settles_at_a_joint_limit(make_bodies, linear_fluid):
    bodies = make_bodies(STOPPED)
    fluid = linear_fluid(dense(6, bodies.mass[0], 10.0), 400.0 * np.array([1.0, 0, 0, 0, 1, 0]))
    coupler, angle = FixedPoint(bodies), []
    for _ in range(600):
        coupler.step(fluid, bodies, 0.0, 1e-3)
        angle.append(bodies.joints()["joint_position"][0])
    assert np.radians(19.9) < max(angle) < np.radians(21.0)
    assert not coupler.notes


@pytest.mark.parametrize("ratio, stable", [(0.8, True), (1.25, False)])
def test_lagged_is_stable_below_an_added_mass_of_one_only(make_bodies, linear_fluid, ratio, stable):
    bodies = make_bodies(BALL)
    fluid = linear_fluid(np.eye(6) * ratio * bodies.mass[0], [0, 0, 10.0, 0, 0, 0])
    coupler = Lagged(bodies)
    for _ in range(60):
        coupler.step(fluid, bodies, 0.0, 1e-3)
    exact = 10.0 / (bodies.mass[0] * (1 + ratio))
    assert (abs(coupler.acceleration[2] - exact) < 0.01 * exact) == stable
    assert coupler.mass_ratio(bodies)[0] >= ratio  # that of the rotations is larger


def test_the_ratio_is_that_of_each_body(make_bodies, linear_fluid):
    world = (
        BALL + '<body name="buoy" pos="2 0 0"><joint type="slide" axis="0 0 1"/><geom size="0.2" density="250"/></body>'
    )
    bodies = make_bodies(world)
    matrix = np.diag([3.0, 3.0, 3.0, 0, 0, 0, 9.0, 9.0, 7.0, 0, 0, 0]) * np.repeat(bodies.mass, 6)
    for scheme in (AddedMass, FixedPoint, Lagged):
        coupler = scheme(bodies)
        assert coupler.mass_ratio(bodies) is None
        coupler.step(linear_fluid(matrix, np.zeros((2, 6))), bodies, 0.0, 1e-3)
        assert coupler.mass_ratio(bodies) == pytest.approx([3.0, 7.0])


def test_the_scene_chooses_the_scheme(make_bodies):
    bodies = make_bodies(BALL)
    kinds = {"added_mass": AddedMass, "fixed_point": FixedPoint, "lagged": Lagged}
    for name, kind in kinds.items():
        assert type(make(CouplerSettings(scheme=name), bodies)) is kind
    assert make(CouplerSettings(scheme="fixed_point", tolerance=1e-3), bodies).tolerance == 1e-3
