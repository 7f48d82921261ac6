"""Whatever MuJoCo models acts in a run with water: each part is seen to do its work."""

import numpy as np
import pytest

import fsi
from bodies import load
from couplers import make
from fsi.simulation.loop import Simulation

SPACING, RHO, G = 0.04, 1000.0, 9.81


@pytest.fixture
def wet(tmp_path):
    """MJCF of a world to a simulation: 1.2 x 0.48 m of water, spacing 4 cm, bodies 1 m wide."""

    def make_run(world, rest="", level=0.0, pto=None):
        path = tmp_path / "body.xml"
        text = f'<mujoco><option timestep="0.01"/><worldbody>{world}</worldbody>{rest}</mujoco>'
        path.write_text(text)
        scene = fsi.Scene.model_validate(
            {
                "spacing": SPACING,
                "duration": 1,
                "tank": {"min": (-0.6, -0.48), "max": (0.6, 0.48)},
                "fluid": {"still_water_level": level},
                "bodies": {"body": {"mjcf": path, "pto": pto or {}}},
            }
        )
        bodies = load(scene)
        return Simulation(scene, bodies=bodies, coupler=make(scene.coupler, bodies), threads=1)

    return make_run


def box(name, density, pos="0 0 0", joint="<freejoint/>", half=(0.12, 0.08), more=""):
    size = f"{half[0]} 0.5 {half[1]}"
    geom = f'<geom name="{name}" type="box" size="{size}" density="{density}" {more}/>'
    return f'<body name="{name}" pos="{pos}">{joint}{geom}</body>'


def heave(name="heave", more=""):
    return f'<joint name="{name}" type="slide" axis="0 0 1" {more}/>'


def height(sim, body=0):
    return float(sim.bodies.motion().position[body, 2])


def settle(sim, until=1.0):
    sim.run(until=until)
    return sim.bodies.joints()


def test_a_joint_limit_stops_a_buoyant_body(wet):
    sim = wet(box("b", 200, "0 0 -0.24", heave(more='range="-0.1 0.06" limited="true" solreflimit="0.004 1"')))
    assert settle(sim, 0.8)["joint_position"] == pytest.approx([0.06], abs=0.003)
    assert any("'heave' went up to" in note and "m beyond its range" in note for note in sim.warnings)


def test_spring_and_damper_carry_the_net_buoyancy(wet):
    sim = wet(box("b", 500, "0 0 -0.24", heave(more='stiffness="4000" damping="300"')))
    lift = (RHO - 500) * G * 0.24 * 0.16
    assert settle(sim, 1.2)["joint_position"] == pytest.approx([lift / 4000], rel=0.08)


def test_a_tendon_holds_a_float_down(wet):
    world = '<site name="anchor" pos="0 0 -0.46"/>' + box("b", 300, "0 0 -0.2").replace(
        "</body>", '<site name="keel" pos="0 0 -0.08"/></body>'
    )
    tendon = '<tendon><spatial name="mooring" stiffness="4e6" damping="200" springlength="0 0.18">'
    sim = wet(world, tendon + '<site site="anchor"/><site site="keel"/></spatial></tendon>')
    lengths, heights = [], []
    sim.run(until=1.0, on_step=lambda sim: (lengths.append(sim.bodies.data.ten_length[0]), heights.append(height(sim))))
    pull = (RHO - 300) * G * 0.24 * 0.16
    assert 0.18 + 0.5 * pull / 4e6 < max(lengths) < 0.182  # it goes taut, and is slack now and then
    assert np.mean(heights) == pytest.approx(-0.2, abs=0.01)
    assert heights == pytest.approx(
        np.full(len(heights), -0.2), abs=0.03
    )  # a jerk of the tendon throws it down by up to 2 cm
    assert any("for tendons and actuators" in note for note in sim.warnings)


def test_an_actuator_moves_its_joint_against_the_water(wet):
    actuator = '<actuator><position name="servo" joint="surge" kp="2e5" kv="2e3"/></actuator>'
    sim = wet(box("b", 900, "0 0 -0.24", '<joint name="surge" type="slide" axis="1 0 0"/>'), actuator)
    sim.bodies.data.ctrl[0] = 0.08
    assert settle(sim, 0.6)["joint_position"] == pytest.approx([0.08], abs=0.002)


def test_an_equality_constraint_ties_two_joints(wet):
    world = box("a", 300, "-0.3 0 -0.24", heave("left")) + box("b", 900, "0.3 0 -0.24", heave("right"))
    sim = wet(world, '<equality><joint name="same" joint1="left" joint2="right"/></equality>')
    left, right = settle(sim, 0.3)["joint_position"]
    assert left > 0.03 and left == pytest.approx(right, abs=0.002)


def test_a_heavy_body_comes_to_rest_on_the_seabed(wet):
    bed = '<geom name="bed" type="plane" pos="0 0 -0.48" size="5 5 1" contype="1"/>'
    sim = wet(bed + box("b", 3000, "0 0 -0.3"))
    sim.run(until=1.2)
    assert height(sim) == pytest.approx(-0.40, abs=0.005)
    assert np.abs(sim.bodies.motion().velocity).max() < 0.05


def test_two_bodies_meet_and_one_carries_the_other(wet):
    sim = wet(box("under", 300, "0 0 -0.24", heave("low")) + box("over", 2500, "0 0 -0.02", heave("high")))
    start = height(sim, 1)
    sim.run(until=0.45)  # they reach the floor of the tank at 0.5 s
    gap = height(sim, 1) - height(sim, 0) - 0.16
    assert -0.002 < gap < 0.5 * SPACING  # a film of water is left between them
    assert height(sim, 1) < start - 0.05


def test_a_mocap_body_leads_another(wet):
    world = '<body name="hand" mocap="true" pos="0 0 -0.24"><geom size="0.01" contype="0" conaffinity="0"/></body>'
    weld = '<equality><weld body1="b" body2="hand" solref="0.02 1"/></equality>'
    wet_one = '<custom><tuple name="wet"><element objtype="geom" objname="b"/></tuple></custom>'
    sim = wet(world + box("b", 900, "0 0 -0.24"), weld + wet_one)

    def lead(sim):
        sim.bodies.data.mocap_pos[0, 0] = 0.2 * min(sim.time, 0.5)

    sim.run(until=0.8, on_step=lead)
    assert sim.bodies.motion().position[0, [0, 2]] == pytest.approx([0.1, -0.24], abs=0.01)


def test_friction_on_a_ramp_holds_or_lets_go(wet):
    """A block under water on a 20 degree ramp: it stays for mu over tan(20 degrees), else it slides."""
    ramp = '<geom name="ramp" type="box" pos="0 0 -0.4" euler="0 20 0" size="0.5 0.5 0.04" friction="{mu}"/>'
    block = box("b", 2500, "-0.0528 0 -0.2526", half=(0.12, 0.08), more='friction="{mu}"')
    block = block.replace('<body name="b"', '<body name="b" euler="0 20 0"')
    moved = {}
    for mu in (0.1, 0.7):
        sim = wet((ramp + block).format(mu=f"{mu} 0.005 0.0001"))
        start = sim.bodies.motion().position[0, 0]
        sim.run(until=0.5)
        moved[mu] = sim.bodies.motion().position[0, 0] - start
    assert moved[0.1] > 0.08 and abs(moved[0.7]) < 0.004


def test_reactions_and_accelerations_see_the_settled_load(wet):
    """A light body that rises on a slide through a bracket: the bracket holds no vertical force, and the accelerometer
    reads what body and fluid agreed on, not what the load on the bare mass would give."""
    light = box("b", 50, "0 0 -0.24", heave()).replace("</body>", '<site name="inside"/></body>')
    sensors = '<sensor><force name="bracket" site="inside"/><accelerometer name="felt" site="inside"/></sensor>'
    sim = wet(light, sensors)
    assert sim.bodies.sensor_names == ("bracket.x", "bracket.y", "bracket.z", "felt.x", "felt.y", "felt.z")
    for _ in range(20):
        sim.step()
        felt = sim.balance.series()["sensor_reading"][5] - G
        assert felt == pytest.approx(sim.coupler.acceleration[0], rel=1e-3)
    assert abs(felt) < 0.5 * (RHO / 50 - 1) * G


def test_hinge_reactions_hold_what_the_water_does(wet):
    """A float on a stiff vertical power take-off: the sensor at its slide reads the net buoyancy."""
    world = box("b", 500, "0 0 -0.24", '<joint name="surge" type="slide" axis="1 0 0" damping="1e6"/>')
    sim = wet(world.replace("</body>", '<site name="s"/></body>'), '<sensor><force name="reaction" site="s"/></sensor>')
    sim.run(until=0.5)
    lift = (RHO - 500) * G * 0.24 * 0.16
    assert sim.balance.series()["sensor_reading"] == pytest.approx([0, 0, -lift], abs=0.05 * lift)
