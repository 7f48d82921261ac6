"""Prescribed motion: exact places and velocities, and the fluid feels the acceleration between them."""

import numpy as np
import pytest

from couplers import AddedMass, Prescribed, make
from couplers.prescribed import MotionTable, Oscillation, PrescribedSettings
from fsi.errors import SceneError
from fsi.scene.coupler import CouplerSettings

FLAP = """<body name="flap"><joint name="hinge" axis="0 1 0" pos="0 0 -0.5"/>
<geom name="flap" type="box" size="0.1 0.2 0.5"/></body>"""


def test_oscillation_is_followed_exactly(make_bodies, linear_fluid):
    bodies = make_bodies(FLAP)
    coupler = Prescribed({"hinge": Oscillation(amplitude=0.4, omega=3.0, ramp=1.0)}, bodies)
    fluid, dt = linear_fluid(np.eye(6), np.zeros(6)), 1e-3
    for step in range(2000):
        motion = bodies.motion()
        wrench = coupler.step(fluid, bodies, step * dt, dt)
        change = (bodies.motion().velocity - motion.velocity) / dt
        assert fluid.field == pytest.approx(change, abs=0.02)
        assert wrench == pytest.approx(-fluid.field)
    series = bodies.joints()
    assert series["joint_position"] == pytest.approx([0.4 * np.sin(6.0)], abs=1e-9)
    assert series["joint_velocity"] == pytest.approx([1.2 * np.cos(6.0)], abs=1e-9)


def test_the_work_of_the_acceleration_is_the_velocity(make_bodies, linear_fluid):
    """The acceleration the fluid feels, summed, is exactly the velocity of the joint."""
    bodies = make_bodies('<body name="b"><joint name="surge" type="slide" axis="1 0 0"/><geom size="0.3"/></body>')
    coupler = Prescribed({"surge": Oscillation(amplitude=0.4, omega=3.0)}, bodies)
    fluid, dt, gained = linear_fluid(np.eye(6), np.zeros(6)), 5e-3, bodies.motion().velocity[0, 0]
    assert gained == pytest.approx(1.2)
    for step in range(100):
        coupler.step(fluid, bodies, step * dt, dt)
        gained += fluid.field[0, 0] * dt
    assert bodies.motion().velocity[0, 0] == pytest.approx(gained, rel=1e-12)


def test_table(make_bodies, linear_fluid, tmp_path):
    times = np.linspace(0, 2, 81)
    file = tmp_path / "motion.csv"
    np.savetxt(
        file, np.column_stack([times, 0.1 * np.sin(2 * times) ** 2]), delimiter=",", header="time,angle", comments=""
    )
    bodies = make_bodies(FLAP)
    coupler = make(PrescribedSettings(motion={"hinge": MotionTable(file=file)}), bodies)
    fluid, dt = linear_fluid(np.eye(6), np.zeros(6)), 1e-2
    for step in range(100):
        coupler.step(fluid, bodies, step * dt, dt)
    assert bodies.joints()["joint_position"] == pytest.approx([0.1 * np.sin(2.0) ** 2], abs=1e-5)
    assert bodies.joints()["joint_velocity"] == pytest.approx([0.2 * np.sin(4.0)], abs=1e-3)


def test_make_and_its_errors(make_bodies, tmp_path):
    bodies = make_bodies(FLAP)
    assert isinstance(make(CouplerSettings(), bodies), AddedMass)
    wave = Oscillation(amplitude=0.1, omega=1.0)
    with pytest.raises(
        SceneError, match=r"run.toml: coupler.motion: no joint 'hing'; known hinge and slide joints: hinge"
    ):
        make(PrescribedSettings(motion={"hing": wave}), bodies, "run.toml")
    with pytest.raises(SceneError, match=r"coupler.motion: no joint has a motion; add"):
        make(PrescribedSettings(), bodies)
    file = tmp_path / "late.csv"
    file.write_text("time,angle\n0,0.3\n1,0.2\n2,0.3\n")
    with pytest.raises(SceneError, match=r"coupler.motion.hinge: starts at 0.3 where the body file has the joint at 0"):
        make(PrescribedSettings(motion={"hinge": MotionTable(file=file)}), bodies)
