"""Kinematics, energy, joints and state of a BodySet against finite differences and formulas."""

import warnings

import mujoco
import numpy as np
import pytest
import trimesh

from bodies import load
from bodies.mjcf import mesh_arrays
from fsi.errors import RunError
from fsi.scene.model import BodyFile, Scene, Tank

CHAIN = """
<body name="lower" pos="0.1 0 0.2" euler="10 20 30"><joint name="yaw" type="hinge" axis="0.3 1 0.2"/>
  <geom name="lower" type="box" size="0.1 0.2 0.3" pos="0.05 0 0.3" density="400"/>
  <body name="upper" pos="0 0 0.7"><joint name="knee" type="hinge" axis="0 1 0" pos="0 0 0"/>
    <geom name="upper" type="capsule" size="0.08 0.2" pos="0 0.1 0.4" density="600"/>
    <body name="rod" pos="0 0 0.8"><joint name="stroke" type="slide" axis="0 1 1"/>
      <geom name="rod" size="0.12" pos="0 0 0.1"/></body></body></body>
"""
FREE = """<body name="b" pos="0.2 0.1 0"><freejoint/><geom name="g" type="box" size="0.1 0.2 0.3" density="500"/>
<geom name="e" type="sphere" size="0.1" pos="0.3 0.1 0.2"/></body>"""
MODELS = ["flap", "surge_flap", "floating_box", "spar", "slide"]


def stir(bodies, seed=0):
    """Random position and velocity."""
    rng = np.random.default_rng(seed)
    model, data = bodies.model, bodies.data
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv) * 0.3, 1.0)
    data.qvel[:] = rng.normal(size=model.nv)
    bodies.restore(bodies.state())


def drift(bodies, dt):
    """Move on with constant joint velocities."""
    mujoco.mj_integratePos(bodies.model, bodies.data.qpos, bodies.data.qvel, dt)
    bodies.restore(bodies.state())


@pytest.mark.parametrize("world", [CHAIN, FREE])
def test_velocity_and_bias_are_rates_of_the_motion(make_bodies, world):
    bodies = make_bodies(world, spacing=0.04)
    stir(bodies)
    dt = 1e-5
    state, here = bodies.state(), bodies.motion()
    drift(bodies, -dt)
    before = bodies.motion()
    bodies.restore(state)
    drift(bodies, dt)
    after = bodies.motion()
    assert here.velocity[:, :3] == pytest.approx((after.position - before.position) / (2 * dt), abs=1e-6)
    rate = (after.rotation - before.rotation) / (2 * dt) @ here.rotation.transpose(0, 2, 1)
    spin = np.stack([rate[:, 2, 1], rate[:, 0, 2], rate[:, 1, 0]], axis=1)
    assert here.velocity[:, 3:] == pytest.approx(spin, abs=1e-6)
    assert here.bias == pytest.approx((after.velocity - before.velocity) / (2 * dt), abs=1e-5)
    assert np.abs(here.bias).max() > 0.05


@pytest.mark.parametrize("world", [CHAIN, FREE])
def test_returned_acceleration_predicts_the_twist(make_bodies, world):
    bodies = make_bodies(world, spacing=0.04)
    stir(bodies)
    dt, before = 1e-5, bodies.motion()
    wrench = np.random.default_rng(1).normal(size=before.velocity.shape) * 100
    nothing = np.zeros((bodies.model.nv, bodies.model.nv))
    acceleration = bodies.advance(dt, wrench, nothing, np.zeros(bodies.model.nv))
    twist_rate = (bodies.motion().velocity - before.velocity) / dt
    assert twist_rate == pytest.approx(before.jacobian @ acceleration + before.bias, abs=2e-2, rel=1e-4)


def test_a_wrench_does_its_work(make_bodies):
    """Newton and Euler for a free body at rest: force over mass at the centre of mass, torque over inertia."""
    bodies = make_bodies('<body name="b"><freejoint/><geom type="box" size="0.1 0.2 0.3" density="500"/></body>')
    wrench = np.array([[1.0, 2.0, 3.0 + 9.81 * bodies.mass[0], 0.4, 0.5, 0.6]])
    acceleration = bodies.advance(1e-3, wrench, np.zeros((6, 6)), np.zeros(6))
    inertia = bodies.mass[0] / 3 * np.array([0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04])
    assert acceleration == pytest.approx(
        np.concatenate([np.array([1, 2, 3]) / bodies.mass[0], wrench[0, 3:] / inertia]), rel=1e-4
    )


@pytest.mark.parametrize("world", [CHAIN, FREE])
def test_save_and_restore_repeat_bit_for_bit(make_bodies, world):
    bodies = make_bodies(world, spacing=0.04)
    stir(bodies)
    nv = bodies.model.nv
    added = np.diag(np.arange(1.0, nv + 1)) + 0.3

    def path():
        accelerations = [
            bodies.advance(2e-3, np.full((len(bodies.names), 6), 3.0), added, np.ones(nv)) for _ in range(20)
        ]
        return np.array(accelerations), bodies.motion()

    state = bodies.state()
    first, there = path()
    bodies.restore(state)
    second, again = path()
    assert np.array_equal(first, second)
    assert np.array_equal(there.position, again.position) and np.array_equal(there.jacobian, again.jacobian)


def test_boundary_particles_follow_the_motion(make_bodies):
    """As the fluid carries them: by position and rotation of `motion`."""
    bodies = make_bodies(FREE)
    (_, solid), _ = bodies.solids()
    start, points = bodies.motion(), solid.boundary(0.02, 3)
    local = (points - start.position[0]) @ start.rotation[0]
    stir(bodies)
    now = bodies.motion()
    moved = now.position[0] + local @ now.rotation[0].T
    geom_from_world = bodies.data.geom_xmat[0].reshape(3, 3)
    in_geom = (moved - bodies.data.geom_xpos[0]) @ geom_from_world
    assert np.abs(in_geom).max(axis=0) == pytest.approx([0.09, 0.19, 0.29])


def test_visuals_and_boundary_agree(make_bodies):
    bodies = make_bodies(CHAIN, spacing=0.04)
    stir(bodies)
    motion = bodies.motion()
    for visual in bodies.visuals():
        b = bodies.names.index(visual.body)
        world = motion.position[b] + visual.vertices @ motion.rotation[b].T
        geom = bodies.model.geom(visual.name).id
        middle = (world.min(axis=0) + world.max(axis=0)) / 2
        assert middle == pytest.approx(bodies.data.geom_xpos[geom], abs=5e-3)
        assert trimesh.Trimesh(world, visual.triangles).is_watertight


def test_energy_of_a_swinging_chain(make_bodies):
    bodies = make_bodies(CHAIN, spacing=0.04)
    stir(bodies)
    kinetic = sum(
        0.5 * mass * velocity[:3] @ velocity[:3]
        for mass, velocity in zip(bodies.mass, bodies.motion().velocity, strict=True)
    )
    potential = 9.81 * bodies.mass @ bodies.motion().position[:, 2]
    assert bodies.energy() > kinetic + potential
    before = bodies.energy()
    for _ in range(1000):
        bodies.advance(1e-4, np.zeros((3, 6)), np.zeros((3, 3)), np.zeros(3))
    assert bodies.energy() == pytest.approx(before, rel=2e-3)
    assert bodies.energy() != before


def test_joint_series_of_a_damped_spring(make_bodies):
    world = """<body name="b"><joint name="heave" type="slide" axis="0 0 1" stiffness="50" damping="7"/>
    <geom type="box" size="0.1 0.1 0.1"/></body>"""
    bodies = make_bodies(world)
    bodies.place({"heave": 0.2}, {"heave": 0.3})
    series = bodies.joints()
    assert bodies.joint_names == ("heave",) and bodies.joint_is_rotary == (False,)
    assert series["joint_position"] == [0.2] and series["joint_velocity"] == [0.3]
    assert series["joint_force"] == pytest.approx([-50 * 0.2 - 7 * 0.3])
    assert series["pto_power"] == pytest.approx([7 * 0.3**2])


def test_actuators_take_out_power(make_bodies, tmp_path):
    path = tmp_path / "motor.xml"
    path.write_text("""<mujoco><worldbody><body name="b"><joint name="heave" type="slide" axis="0 0 1" damping="7"/>
    <geom type="box" size="0.1 0.1 0.1"/></body></worldbody>
    <actuator><general name="pto" joint="heave" biastype="affine" biasprm="0 0 -20"/></actuator></mujoco>""")
    tank = Tank(min=(-1, -1), max=(1, 1))
    bodies = load(Scene(spacing=0.02, duration=1, tank=tank, bodies={"b": BodyFile(mjcf=path)}))
    bodies.place({}, {"heave": 0.5})
    assert bodies.joints()["pto_power"] == pytest.approx([27 * 0.25])
    assert bodies.joints()["joint_force"] == pytest.approx([-27 * 0.5])


def test_mesh_bodies_weigh_what_they_displace(make_bodies, tmp_path):
    """A bracket, concave: exact mass, and its walls where the mesh has them although MuJoCo moves its frame."""
    outline = trimesh.creation.box(
        extents=[0.4, 0.2, 0.1], transform=trimesh.transformations.translation_matrix([0.2, 0, 0.05])
    )
    upright = trimesh.creation.box(
        extents=[0.1, 0.2, 0.3], transform=trimesh.transformations.translation_matrix([0.05, 0, 0.25])
    )
    bracket = _weld(outline, upright)
    bracket.export(tmp_path / "bracket.stl")
    head = '<asset><mesh name="bracket" file="bracket.stl"/></asset>'
    world = '<body name="b"><freejoint/><geom name="b" type="mesh" mesh="bracket" density="500"/></body>'
    bodies = make_bodies(world, head=head)
    volume = 0.4 * 0.2 * 0.1 + 0.1 * 0.2 * 0.3
    assert bodies.mass[0] == pytest.approx(500 * volume, rel=1e-5)
    vertices, faces = mesh_arrays(bodies.model, 0)
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(volume, rel=1e-5)
    ((_, solid),) = bodies.solids()
    points = np.array([[0.2, 0, 0.05], [0.05, 0, 0.3], [0.2, 0, 0.2], [0.05, 0, 0.39]])
    assert solid.clearance(points) == pytest.approx([-0.05, -0.05, 0.1, -0.01], abs=1e-6)
    flat = make_bodies(world, head=head, dimension=2)
    assert flat.solids()[0][1].clearance(points[:, [0, 2]]) == pytest.approx([-0.05, -0.05, 0.1, -0.01], abs=1e-6)


def _weld(lower, upper):
    """An L along y from its outline, closed and without inner walls."""
    profile = np.array([[0, 0], [0.4, 0], [0.4, 0.1], [0.1, 0.1], [0.1, 0.4], [0, 0.4], [0, 0.1]])
    assert np.allclose(profile.max(axis=0), [lower.bounds[1, 0], upper.bounds[1, 2]])
    caps = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 6], [6, 3, 4], [6, 4, 5]])
    n = len(profile)
    front, back = (np.insert(profile, 1, y, axis=1) for y in (-0.1, 0.1))
    ring = np.arange(n)
    sides = np.concatenate([np.c_[ring, (ring + 1) % n, ring + n], np.c_[(ring + 1) % n, (ring + 1) % n + n, ring + n]])
    shape = trimesh.Trimesh(np.vstack([front, back]), np.concatenate([caps, caps[:, ::-1] + n, sides[:, ::-1]]))
    trimesh.repair.fix_normals(shape)
    return shape


@pytest.mark.parametrize(
    "geom, inside, outside",
    [
        ('type="sphere" size="0.2" pos="0 0.12 0"', [0.155, 0], [0.165, 0]),
        ('type="box" size="0.2 0.1 0.1" euler="0 0 30"', [0.19, 0], [0.21, 0]),
        ('type="box" size="0.2 0.1 0.1" euler="0 90 0"', [0, 0.19], [0, 0.21]),
        ('type="box" size="0.2 0.1 0.1" euler="40 0 0"', [0, 0.12], [0, 0.14]),
        ('type="cylinder" size="0.1 0.3" euler="90 0 0"', [0.07, 0.06], [0.08, 0.07]),
        ('type="cylinder" size="0.1 0.3" euler="0 90 0"', [0.29, 0.09], [0.31, 0.0]),
        ('type="cylinder" size="0.1 0.3" euler="30 0 0"', [0.0, 0.19], [0.0, 0.21]),
        ('type="capsule" size="0.1 0.3"', [0.0, 0.39], [0.05, 0.39]),
        ('type="ellipsoid" size="0.1 0.2 0.3" euler="0 90 0"', [0.29, 0.0], [0.0, 0.11]),
    ],
)
def test_sections_in_two_dimensions(make_bodies, geom, inside, outside):
    bodies = make_bodies(f'<body name="b"><freejoint/><geom name="g" {geom}/></body>', dimension=2)
    ((owner, solid),) = bodies.solids()
    assert owner == 2
    assert (solid.clearance(np.array([inside, outside])) < 0).tolist() == [True, False]
    depth = -solid.clearance(solid.boundary(0.02, 3))
    assert depth.min() == pytest.approx(0.01, abs=1e-3)


def test_static_geoms_are_fixed_walls_and_files_keep_apart(tmp_path):
    ramp = tmp_path / "ramp.xml"
    wet = '<custom><tuple name="wet"><element objtype="geom" objname="ramp"/></tuple></custom>'
    ramp.write_text(f'<mujoco>{wet}<worldbody><geom name="ramp" type="box" size="0.2 0.1 0.1"/></worldbody></mujoco>')
    files = {"a": BodyFile(mjcf=ramp, position=(1, 0, 0)), "b": BodyFile(mjcf="package://bodies/models/flap.xml")}
    tank = Tank(min=(-2, -2), max=(2, 2), width=0.4)
    bodies = load(Scene(spacing=0.02, duration=1, tank=tank, bodies=files))
    assert bodies.names == ("b/flap",) and bodies.joint_names == ("b/hinge",)
    assert [owner for owner, _ in bodies.solids()] == [0, 2]
    assert bodies.solids()[0][1].clearance(np.array([[1.0, 0.0]])) == pytest.approx([-0.1])
    assert bodies.motion().position[0] == pytest.approx([0, 0, -0.5])


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("name", MODELS)
def test_models_that_come_with_the_project(name, dimension):
    low, high = ((-2, -1, -1), (2, 1, 1)) if dimension == 3 else ((-2, -1), (2, 1))
    file = BodyFile(mjcf=f"package://bodies/models/{name}.xml")
    tank = Tank(min=low, max=high, width=0.4)
    bodies = load(Scene(spacing=0.02, duration=1, dimension=dimension, tank=tank, bodies={name: file}))
    nv = bodies.model.nv
    still = np.zeros((len(bodies.names), 6))
    still[:, 2] = 9.81 * bodies.mass
    assert np.abs(bodies.advance(1e-3, still, np.zeros((nv, nv)), np.zeros(nv))).max() < 1


def test_an_unstable_step_ends_the_run(make_bodies, tmp_path, monkeypatch):
    """No silent restart, and no log file in the working directory."""
    monkeypatch.chdir(tmp_path)
    bodies = make_bodies()
    for force, message in ((np.nan, "not finite"), (1e30, "accelerate without bound")):
        with warnings.catch_warnings(), pytest.raises(RunError, match=message):
            warnings.simplefilter("ignore")
            bodies.advance(1e-3, np.full((1, 6), force), np.zeros((6, 6)), np.zeros(6))
    assert not list(tmp_path.glob("*.TXT"))
