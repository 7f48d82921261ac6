"""Round bodies: which are, the wrench of a smooth one, and boundary particles that follow without the spin."""

import numpy as np
import pytest

from bodies import load
from bodies.roundness import roundness
from couplers import make
from fsi.owners import FIRST_BODY
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

BALL = '<geom type="sphere" size="0.2" pos="0.1 0 0.2" density="500"/>'
KEEL = '<geom name="keel" type="box" size="0.01 0.01 0.01" pos="0.1 0 0" density="8000"/>'
LYING = '<geom type="cylinder" size="0.2 0.3" euler="90 0 0" density="500"/>'
WET = '<custom><tuple name="wet"><element objtype="geom" objname="geom0"/></tuple></custom>'


def free(geoms: str, turned: str = "") -> str:
    return f'<body name="b" {turned}><freejoint/>{geoms}</body>'


def of(bodies, dimension=3):
    model = bodies.model
    wet = [g for g in range(model.ngeom) if model.geom(g).name != "keel"]
    return roundness(model, bodies.data, 1, wet, dimension)


@pytest.mark.parametrize(
    "geoms, dimension, axis",
    [
        (BALL, 3, "point"),
        (BALL, 2, (0, 1, 0)),
        (LYING, 2, (0, 1, 0)),
        (LYING, 3, (0, 1, 0)),
        (BALL + BALL.replace("0.2 d", "0.6 d").replace("0 0.2", "0 0.6"), 3, (0, 0, 1)),
        ('<geom type="ellipsoid" size="0.3 0.2 0.2" density="500"/>', 3, (1, 0, 0)),
        ('<geom type="box" size="0.3 0.2 0.2" density="500"/>', 3, None),
        (BALL + BALL.replace("0.1 0 0.2", "0.6 0 0.2"), 2, None),
        (LYING.replace("euler", "pos='0 0 0.3' euler") + BALL, 3, None),
    ],
)
def test_which_bodies_are_round(make_bodies, geoms, dimension, axis):
    found = of(make_bodies(free(geoms), spacing=0.04, dimension=dimension), dimension)
    if axis is None:
        assert found is None
    elif axis == "point":
        assert found.axis is None
    else:
        assert np.abs(found.axis) == pytest.approx(axis, abs=1e-9)


@pytest.mark.parametrize("geoms", [BALL + KEEL, LYING + KEEL])
def test_pressure_on_a_round_body_has_no_moment_about_its_axis(make_bodies, geoms):
    """Forces along the normals of the surface pass unchanged; a moment about the axis goes, whatever the pose, also where
    ballast moves the centre of mass."""
    bodies = make_bodies(free(geoms, 'euler="20 40 10"'), head=WET, spacing=0.04)
    rng = np.random.default_rng(1)
    bodies.data.qpos[3:7] = rng.normal(size=4)
    bodies.restore(bodies.state())
    motion = bodies.motion()
    rotation, smooth = motion.rotation[0], motion.smooth[0]
    shape = of(bodies)
    arm = rotation @ motion.pivot[0]
    centre = motion.position[0] + arm
    assert centre == pytest.approx(bodies.data.geom_xpos[0], abs=1e-9)
    axes = np.eye(3) if shape.axis is None else bodies.data.geom_xmat[0].reshape(3, 3).T[2:]
    for _ in range(5):
        force, outward = rng.normal(size=3), rng.normal(size=3)
        through = np.concatenate([force, np.cross(arm, force)])  # at the centre
        assert smooth @ through == pytest.approx(through)
        radial = outward if shape.axis is None else outward - axes[0] * (axes[0] @ outward)
        normal = np.concatenate([radial, np.cross(arm + radial, radial)])
        assert smooth @ normal == pytest.approx(normal)
        wrench = smooth @ rng.normal(size=6)
        assert axes @ (wrench[3:] - np.cross(arm, wrench[:3])) == pytest.approx(0.0, abs=1e-12)
    for axis in axes:  # and a spin about it moves nothing
        spin = np.concatenate([-np.cross(axis, arm), axis])
        assert smooth.T @ spin == pytest.approx(np.zeros(6), abs=1e-12)


def test_boundary_particles_keep_to_the_axis_and_do_not_spin(make_bodies):
    bodies = make_bodies(free(LYING), spacing=0.04)
    start = bodies.motion().turn[0]
    bodies.data.qvel[4] = 3.0
    bodies.data.qpos[3:7] = np.cos(0.7), 0, np.sin(0.7), 0
    bodies.restore(bodies.state())
    assert bodies.motion().turn[0] == pytest.approx(start, abs=1e-12)
    bodies.data.qpos[3:7] = np.cos(0.2), np.sin(0.2), 0, 0
    bodies.restore(bodies.state())
    motion = bodies.motion()
    assert motion.turn[0] == pytest.approx(motion.rotation[0], abs=1e-12)
    assert make_bodies(free(KEEL.replace("0.01 0.01 0.01", "0.1 0.1 0.1")), spacing=0.04).motion().smooth is None


def float_cylinder(tmp_path, viscosity: float, spin: float):
    """A cylinder of 0.05 of water's density beside a heap of water that collapses onto it."""
    world = '<body name="b" pos="0 0 0.1"><freejoint/><geom type="cylinder" size=".15 .5" euler="90 0 0" density="50"/></body>'
    (tmp_path / "b.xml").write_text(f'<mujoco><option timestep="0.01"/><worldbody>{world}</worldbody></mujoco>')
    scene = Scene.model_validate(
        {
            "dimension": 2,
            "spacing": 0.04,
            "duration": 1.5,
            "tank": {"min": (-0.8, -0.4), "max": (0.8, 0.6)},
            "fluid": {
                "blocks": [{"min": (-0.8, -0.4), "max": (0.8, 0.0)}, {"min": (-0.8, 0.0), "max": (-0.4, 0.2)}],
                "kinematic_viscosity": viscosity,
            },
            "bodies": {"b": {"mjcf": tmp_path / "b.xml"}},
        }
    )
    bodies = load(scene)
    bodies.data.qvel[4] = spin
    bodies.restore(bodies.state())
    return Simulation(scene, bodies=bodies, coupler=make(scene.coupler, bodies), threads=1)


def test_waves_do_not_spin_a_light_cylinder(tmp_path):
    """Teeth of boundary particles turned it at 2 rad/s."""
    sim = float_cylinder(tmp_path, 0.0, 0.0)
    sim.run()
    twist = sim.bodies.motion().velocity[0]
    assert np.abs(sim.bodies.data.qpos[0]) > 0.02  # it was moved
    assert abs(twist[4]) < 1e-6
    assert sim.audit()["momentum_residual"] < 1e-5


def test_viscous_water_slows_the_spin_of_a_cylinder(tmp_path):
    sim = float_cylinder(tmp_path, 1e-3, 5.0)
    sim.run(until=0.5)
    assert 0.5 < sim.bodies.motion().velocity[0, 4] < 4.9
    owned = sim.fluid.of_owner(FIRST_BODY)
    spun = sim.fluid.placed.felt[owned] - sim.fluid.boundary_velocity[owned]
    assert np.linalg.norm(spun, axis=1).max() > 0.1
