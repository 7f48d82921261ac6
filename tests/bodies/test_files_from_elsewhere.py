"""What MJCF files of others bring with them: world coordinates, keyframes, compiler settings, flags, names."""

import mujoco
import numpy as np
import pytest

from bodies import load
from fsi.errors import SceneError
from fsi.scene.model import BodyFile, Scene, Tank

OPTION = '<option timestep="0.01"/>'
HULL = '<body name="buoy" pos="{pos}"><freejoint/><geom name="hull" type="box" size=".1 .1 .1" density="500"/></body>'
KEY = '<keyframe><key name="start" qpos="{qpos} 1 0 0 0" qvel="0.4 0 0 0 0 0"/></keyframe>'
HELD = f"""{OPTION}<worldbody><site name="hook" pos="0 0 1"/><geom name="bed" type="plane" size="1 1 1" pos="0 0 -1"/>
<body name="hand" mocap="true" pos="0 .5 .5"><geom name="palm" size=".05" contype="0" conaffinity="0"/></body>
{HULL.format(pos="0.1 0 0.2")}
<body name="twin" pos="-.5 0 0"><freejoint/><geom name="other" size=".1" density="500"/><site name="eye"/></body></worldbody>
<custom><tuple name="wet"><element objtype="geom" objname="hull"/></tuple></custom>
<equality><weld body1="buoy"/><weld body1="twin" relpose="0 0 .3 0 0 1 0" anchor="0 .1 0"/>
<weld body1="world" body2="twin" relpose="-.4 0 0 1 0 0 0" anchor=".1 0 0"/><connect body1="twin" anchor="0 0 .1"/>
<connect body1="world" body2="buoy" anchor="0.2 0 .1"/><connect site1="hook" site2="eye"/><weld body1="hand" body2="buoy"/>
</equality><tendon><spatial name="line"><site site="hook"/><site site="eye"/></spatial></tendon>
<contact><exclude body1="buoy" body2="twin"/></contact>
<keyframe><key name="start" qpos="0.1 0 .25 1 0 0 0 -.5 0 .1 1 0 0 0" mpos="0 .4 .5"/></keyframe>"""
AT = (0.3, 0.1, 0.2)


@pytest.fixture
def make(tmp_path):
    """MJCF texts by name, each with its position in a tank of 4 m around the origin, to a BodySet."""

    def make(dimension=3, **files):
        parts = {}
        for name, (text, position) in files.items():
            (tmp_path / f"{name}.xml").write_text(f"<mujoco>{text}</mujoco>")
            parts[name] = BodyFile(mjcf=tmp_path / f"{name}.xml", position=position)
        tank = Tank(min=(-2,) * dimension, max=(2,) * dimension)
        return load(Scene(spacing=0.04, duration=1, dimension=dimension, tank=tank, bodies=parts), "test.toml")

    return make


OTHER = f"{OPTION}<worldbody>{HULL.format(pos='-1 0 0').replace('buoy', 'far')}</worldbody>"


@pytest.mark.parametrize("beside", [{}, {"other": (OTHER, (0, 0, 0))}])
def test_constraints_to_the_world_move_with_the_file(make, beside):
    """Violations of constraints, and lengths of tendons, are what they are in the file where it was written."""
    here = make(a=(HELD, (0, 0, 0)))
    there = make(a=(HELD, AT), **beside)
    for bodies in (here, there):
        mujoco.mj_forward(bodies.model, bodies.data)
    assert there.data.ne == here.data.ne == 33
    assert there.data.efc_pos[:33] == pytest.approx(here.data.efc_pos[:33], abs=1e-6)
    assert np.abs(here.data.efc_pos[:33]).max() > 0.05
    assert there.data.ten_length == pytest.approx(here.data.ten_length)
    assert there.data.mocap_pos == pytest.approx(here.data.mocap_pos + AT)
    moved = there.motion().position[there.names.index("a/buoy" if beside else "buoy")]
    assert moved == pytest.approx(here.motion().position[0] + AT)


def test_each_file_keeps_its_keyframe(make):
    text = OPTION + "<worldbody>" + HULL + "</worldbody>" + KEY
    first = text.format(pos="0 0 0", qpos="0 0 .05")
    second = text.format(pos=".1 0 0", qpos=".1 0 -.05").replace("0.4", "-0.2")
    bodies = make(a=(first, (1, 0, 0)), b=(second, (-1, 0, 0.1)), c=(OTHER, (0, 0, 0.5)))
    motion = bodies.motion()
    assert motion.position[:, 0] == pytest.approx([1, -0.9, -1]) and motion.position[:, 2] == pytest.approx(
        [0.05, 0.05, 0.5], abs=1e-4
    )
    assert motion.velocity[:, 0] == pytest.approx([0.4, -0.2, 0.0])
    alone = make(a=(first, (1, 0, 0))).motion()
    assert alone.position[0] == pytest.approx(motion.position[0], abs=1e-5) and alone.velocity[0, 0] == 0.4


def test_a_key_of_joints_and_actuators_beside_another_file(make):
    arm = """<worldbody><body name="arm"><joint name="swing" axis="0 1 0"/><geom name="arm" type="box" size=".1 .1 .1"/>
    </body></worldbody><actuator><general joint="swing" dyntype="integrator"/></actuator>
    <keyframe><key name="start" qpos="0.3" qvel="2" act="0.7" ctrl="0.1"/></keyframe>"""
    bodies = make(z=(OTHER, (0, 0, 0)), a=(OPTION + arm, (1, 0, 0)))
    assert bodies.joints()["joint_position"] == pytest.approx([0.3]) and bodies.data.ctrl == pytest.approx([0.1])
    assert bodies.joints()["joint_velocity"] == pytest.approx([2.0]) and bodies.data.act == pytest.approx([0.7])


@pytest.mark.parametrize(
    "compiler, inertial",
    [
        ('settotalmass="9"', ""),
        ('inertiafromgeom="true"', '<inertial pos="0 0 0" mass="50" diaginertia="1 1 1"/>'),
        ('boundmass="7" boundinertia="0.5"', ""),
        ('balanceinertia="true"', '<inertial pos="0 0 0" mass="5" diaginertia="1 1 3"/>'),
        ('angle="radian" eulerseq="zyx"', ""),
        ('autolimits="false"', ""),
    ],
)
def test_compiler_settings_of_a_file_hold_beside_another(make, compiler, inertial):
    """Each file has settings of its own, and default classes that the other names too."""
    text = f"""<compiler {compiler}/>{OPTION}<default><geom density="500"/><default class="part"><joint damping="3"/>
    </default></default><worldbody><body name="b" euler="0 0.3 0.2"><joint name="j" class="part" axis="0 1 0"
    range="-1 1" limited="true"/>
    {inertial}<geom name="g" type="box" size=".1 .12 .14" euler="10 0 3"/></body></worldbody>"""
    plain = text.replace(compiler, "").replace('damping="3"', 'damping="5"').replace(inertial, "")
    alone = make(a=(text, (0, 0, 0)))
    both = make(plain=(plain, (-1, 0, 0)), a=(text, (0.5, 0, 0)))
    a, b = alone.model, both.model
    assert b.body("a/b").mass == pytest.approx(a.body("b").mass)
    assert b.body("a/b").inertia == pytest.approx(a.body("b").inertia)
    assert b.body("a/b").quat == pytest.approx(a.body("b").quat)
    assert b.joint("a/j").range == pytest.approx(a.joint("j").range)
    assert b.joint("a/j").limited == a.joint("j").limited
    assert b.joint("a/j").damping == a.joint("j").damping == 3 and b.joint("plain/j").damping == 5
    assert both.mass[1] == pytest.approx(alone.mass[0]) and both.mass[0] == pytest.approx(500 * 8 * 0.1 * 0.12 * 0.14)


def test_names_that_the_automatic_ones_would_take(make):
    text = f"""{OPTION}<worldbody><body name="body1"><freejoint/><geom name="geom1" type="box" size=".1 .1 .1"/>
    <geom type="box" pos="0 0 .2" size=".1 .1 .1"/><geom name="geom0" type="box" pos="0 0 .4" size=".1 .1 .1"/></body>
    </worldbody>"""
    bodies = make(a=(text, (0, 0, 0)))
    assert {bodies.model.geom(g).name for g in range(3)} == {"geom0", "geom1", "geom1_1"} and len(bodies.solids()) == 3


FIXED = '<geom name="wall" type="box" size=".2 .2 .2"/>'
SOLID = f"<worldbody>{HULL.format(pos='0 0 0')}</worldbody>"


@pytest.mark.parametrize(
    "text, message",
    [
        (f'<option timestep="0"/>{SOLID}', r"a.xml: option: timestep is 0 s; give it a positive value"),
        (f'<option timestep="-1"/>{SOLID}', r"option: timestep is -1 s"),
        (f'<option timestep="nan"/>{SOLID}', r"a.xml: holds the value nan, which MuJoCo takes for none; give numbers"),
        (f'<option timestep="inf"/>{SOLID}', r"option: timestep is inf s"),
        (f"<worldbody>{HULL.format(pos='nan 0 0')}</worldbody>", r"a.xml: holds the value nan"),
        (f'<option><flag gravity="disable"/></option>{SOLID}', r"option: flag gravity is disabled where .* 9.81 m/s2"),
        (
            f"<worldbody>{FIXED}</worldbody>",
            r"bodies.a.mjcf: .*a.xml has no body that moves.*'wall'; name its wet geoms",
        ),
        ("<worldbody/>", r"bodies.a.mjcf: .*a.xml has no wet geom; give it geoms, or take bodies.a out of the scene"),
        (f'<custom><tuple name="wet"/></custom>{SOLID}', r"wet"),
        (
            f"<worldbody>{FIXED.replace('/>', ' pos=' + chr(34) + '250 0 0' + chr(34) + '/>')}</worldbody>"
            '<custom><tuple name="wet"><element objtype="geom" objname="wall"/></tuple></custom>',
            r"geom 'wall': lies outside the tank: x = 249.8 to 250.2 m where the tank has -2 to 2 m; move",
        ),
    ],
)
def test_files_that_are_refused(make, text, message):
    with pytest.raises(SceneError, match=message):
        make(a=(text, (0, 0, 0)))


def test_options_that_differ_name_both_values(make):
    a = f'<option timestep="0.01" cone="elliptic"/>{SOLID}'
    with pytest.raises(SceneError, match=r"bodies.b.mjcf: option 'cone' is 0, in the first file 1; give all files"):
        make(a=(a, (1, 0, 0)), b=(OTHER, (0, 0, 0)))
    slower = make(a=(OTHER, (0, 0, 0)), b=(OTHER.replace("0.01", "0.004").replace("far", "f"), (0, 1, 0)))
    assert slower.model.opt.timestep == 0.004


@pytest.mark.parametrize("flag", ["constraint", "limit", "contact", "spring", "damper", "equality", "frictionloss"])
def test_a_flag_that_is_off_is_said(make, flag):
    text = f'<option timestep="0.01"><flag {flag}="disable"/></option>{SOLID}'
    assert any(f"a.xml: flag {flag} is disabled" in note for note in make(a=(text, (0, 0, 0))).notes)


def test_a_spring_that_is_off_does_not_act_however_stiff(make):
    text = """<option timestep="0.01"><flag spring="disable" damper="disable"/></option><worldbody><body name="b">
    <joint name="j" type="slide" axis="1 0 0" stiffness="1e9" damping="1e7"/><geom name="g" type="box" size=".1 .1 .1"/>
    </body></worldbody>"""
    bodies = make(a=(text, (0, 0, 0)))
    bodies.place({"j": 0.1}, {"j": 0.5})
    for _ in range(10):
        bodies.advance(0.01, np.zeros((1, 6)), np.zeros((1, 1)), np.zeros(1))
    assert bodies.joints()["joint_velocity"] == pytest.approx([0.5], rel=1e-6)


def test_no_log_file_is_left(make, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError):
        make(a=(f'<option timestep="nan"/>{SOLID}', (0, 0, 0)))
    bodies = make(a=(f'<compiler settotalmass="9"/>{SOLID}', (0, 0, 0)))
    assert any("settotalmass" in note for note in bodies.notes)
    bodies.data.qpos[0] = np.nan
    mujoco.mj_checkPos(bodies.model, bodies.data)
    assert any("MuJoCo: " in note and "(1 times)" in note for note in bodies.notes)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


JOINTED = (
    '<worldbody><body name="b"{}><joint name="j" type="{}" axis="{}"{}/><geom name="g" type="box" size=".1 .1 .1"/>'
)
JOINTED += '<geom name="seen" type="box" size=".1 .1 .11" contype="0" conaffinity="0" mass="0"/></body></worldbody>'


@pytest.mark.parametrize(
    "text, note",
    [
        (JOINTED.format(' gravcomp="0.5"', "slide", "0 0 1", ""), "body 'b' has gravcomp = 0.5: MuJoCo bears"),
        (JOINTED.format("", "slide", "0 0 1", ' stiffness="-5"'), "joint 'j': stiffness is -5: it pushes away"),
        (JOINTED.format("", "hinge", "0 0 1", ""), "joint 'j' leads out of the plane y = 0"),
        (JOINTED.format("", "slide", "1 1 0", ""), "joint 'j' leads out of the plane y = 0"),
        (JOINTED.format("", "hinge", "0 1 0", ""), ""),
        (
            JOINTED.format("", "slide", "0 0 1", "") + '<sensor><user name="u" dim="1"/></sensor>',
            "sensor 'u' of type user",
        ),
        (
            JOINTED.format("", "slide", "0 0 1", "") + '<keyframe><key name="home" qpos=".1"/></keyframe>',
            "a.xml: keyframe 'home' has no effect",
        ),
    ],
)
def test_settings_that_act_otherwise_than_one_may_think_are_told(make, text, note):
    notes = make(dimension=2, a=(text, (0, 0, 0))).notes
    looks = [line for line in notes if "touches nothing, as one for looks, and is wet" in line]
    assert len(looks) == 1 and "'seen'" in looks[0]
    told = [
        line for line in notes if any(word in line for word in ("gravcomp", "stiffness", "leads", "user", "keyframe"))
    ]
    assert len(told) == bool(note) and all(note in line for line in told)


@pytest.mark.parametrize(
    "text, message",
    [
        (JOINTED.format("", "slide", "0 0 1", ' damping="-1"'), r"joint 'j': damping is -1: it drives the joint"),
        (f'<option timestep="1e-9"/>{SOLID}', r"timestep is 1e-09 s: a step of the fluid would take thousands"),
        (
            '<custom><tuple name="Wet"><element objtype="geom" objname="hull"/></tuple></custom>' + SOLID,
            r"tuple 'Wet': has no effect; call it 'wet'",
        ),
    ],
)
def test_settings_that_can_only_be_mistakes_are_refused(make, text, message):
    with pytest.raises(SceneError, match=message):
        make(a=(text, (0, 0, 0)))


def test_a_geom_that_is_named_wet_twice_counts_once(make):
    twice = '<element objtype="geom" objname="hull"/>' * 2
    assert len(make(a=(f'<custom><tuple name="wet">{twice}</tuple></custom>{SOLID}', (0, 0, 0))).solids()) == 1
