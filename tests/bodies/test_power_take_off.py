"""Power take-offs against formulas: force, power, energy, and steps far longer than their time scales."""

import numpy as np
import pytest

from fsi.errors import RunError, SceneError
from fsi.scene.model import BodyFile
from fsi.trust import checking, trusting

HEAVE = """<body name="buoy"><joint name="heave" type="slide" axis="0 0 1" {joint}/>
  <geom name="buoy" type="box" size="0.1 0.1 0.1" density="1000"/></body>"""
PAIR = """<body name="lower"><joint name="hip" axis="0 1 0"/><geom type="box" pos="0 0 0.5" size="0.1 0.2 0.4"/>
  <body name="upper" pos="0 0 1"><joint name="knee" axis="0 1 0"/>
    <geom type="box" pos="0 0 0.5" size="0.1 0.2 0.4"/></body></body>"""
MASS, DT = 8.0, 5e-3


@pytest.fixture(autouse=True)
def trusted():
    with trusting():
        yield


@pytest.fixture
def buoy(make_bodies, tmp_path):
    """A mass of 8 kg on a slide without gravity, with the given power take-off."""

    def make(pto, joint="", world=HEAVE):
        files = {"body": BodyFile.model_validate({"mjcf": tmp_path / "body.xml", "pto": pto})}
        return make_bodies(
            world.format(joint=joint), gravity=0.0, option='gravity="0 0 0" timestep="0.01"', bodies=files
        )

    return make


def run(bodies, steps, load=lambda t: 0.0, added=0.0, dt=DT):
    """Position, velocity, force and power (steps, 4) under a vertical force and an added mass [kg]."""
    rows, acceleration = [], np.zeros(1)
    for n in range(steps):
        wrench = np.array([[0, 0, load(n * dt) - added * acceleration[0], 0, 0, 0]])
        acceleration = bodies.advance(dt, wrench, np.array([[added]]), acceleration)
        rows.append([float(values[0]) for values in bodies.joints().values()])
    return np.array(rows)


def energy(rows):
    return 0.5 * MASS * rows[:, 1] ** 2


def test_linear_force_and_power(buoy):
    bodies = buoy({"damping": 7.0, "stiffness": 50.0, "rest": 0.1})
    bodies.place({"heave": 0.2}, {"heave": 0.3})
    x, v, force, power = run(bodies, 1)[0]
    assert force == pytest.approx(-50 * (x - 0.1) - 7 * v) and power == pytest.approx(-force * v)


def test_absorbed_power_is_the_energy_that_the_body_loses(buoy):
    bodies = buoy({"heave": {"damping": 4.0}})
    bodies.place({}, {"heave": 1.0})
    rows = run(bodies, 400, dt=1e-3)
    lost = 0.5 * MASS - energy(rows)[-1]
    assert lost > 0.5 and rows[:, 3].sum() * 1e-3 == pytest.approx(lost, rel=2e-3)


@pytest.mark.parametrize("added", [0.0, 200.0])
@pytest.mark.parametrize("pto", [{"stiffness": 1e9}, {"damping": 1e8}, {"stiffness": 1e7, "damping": 1e7}])
def test_stiff_ones_yield_by_the_law_and_create_no_energy(buoy, pto, added):
    bodies = buoy(pto)
    bodies.place({}, {"heave": 2.0})
    rows = run(bodies, 300, load=lambda t: 500.0, added=added)
    assert energy(rows).max() < 0.5 * MASS * 4
    if "damping" in pto and "stiffness" not in pto:
        assert rows[-1, 1] == pytest.approx(500.0 / 1e8, rel=1e-3)
    elif "damping" not in pto:
        assert rows[-1, 0] == pytest.approx(500.0 / 1e9, rel=0.05)
    assert rows[-1, 2] == pytest.approx(-500.0, rel=0.05)


def test_a_soft_spring_keeps_its_energy(buoy):
    bodies = buoy({"stiffness": 200.0})
    bodies.place({"heave": 0.1}, {})
    rows = run(bodies, 4000)
    assert np.abs(rows[-400:, 0]).max() == pytest.approx(0.1, rel=5e-3)
    assert not bodies.notes


def test_coulomb_holds_below_and_slips_above_its_force(buoy):
    bodies = buoy({"kind": "coulomb", "force": 20.0})
    held = run(bodies, 200, load=lambda t: 15.0)
    assert abs(held[-1, 0]) < 1e-5 and held[-1, 2] == pytest.approx(-15.0, rel=1e-3)
    slipping = run(bodies, 200, load=lambda t: 28.0)
    assert slipping[-1, 1] == pytest.approx((28 - 20) / MASS * 1.0, rel=0.01)
    assert slipping[-1, 2:] == pytest.approx([-20.0, 20.0 * slipping[-1, 1]], rel=1e-3)


def test_latching_holds_at_the_end_of_each_swing(buoy):
    bodies = buoy({"kind": "latching", "stiffness": 800.0, "hold": 0.2})
    bodies.place({}, {"heave": 1.0})
    rows = run(bodies, 1000, dt=1e-3)
    half, reach = np.pi * np.sqrt(MASS / 800.0), np.sqrt(MASS / 800.0)
    moving = np.abs(rows[:, 1]) > 1e-4
    at = lambda t: int(t / 1e-3)  # noqa: E731
    assert not moving[at(half / 2 + 0.01) : at(half / 2 + 0.19)].any() and moving[at(half / 2 + 0.23)]
    assert not moving[at(1.5 * half + 0.22) : at(1.5 * half + 0.38)].any()
    assert rows[at(half / 2 + 0.1), 0] == pytest.approx(reach, rel=0.01)
    assert rows[at(1.5 * half + 0.3), 0] == pytest.approx(-reach, rel=0.02)
    assert rows[at(half / 2 + 0.1), 3] == pytest.approx(0.0, abs=1e-3)
    assert rows[at(half / 2 + 0.1), 2] == pytest.approx(0.0, abs=1.0)  # no load to hold


def test_latching_repeats_after_restore(buoy):
    bodies = buoy({"kind": "latching", "stiffness": 800.0, "hold": 0.2})
    bodies.place({}, {"heave": 1.0})
    run(bodies, 60)
    state = bodies.state()
    first = run(bodies, 60)
    bodies.restore(state)
    assert np.array_equal(run(bodies, 60), first)


def test_a_table_that_drives_the_joint_is_told(buoy, tmp_path):
    file = tmp_path / "pto.csv"
    for rows, told in ((["-1,5", "0,0", "1,-5"], False), (["-1,-5", "0,0", "1,5"], True), (["-1,9", "1,1"], False)):
        file.write_text("\n".join(["v,F", *rows]))
        notes = " ".join(buoy({"kind": "table", "file": file}).notes)
        assert ("drives the joint; one that absorbs has the other sign" in notes) == told


def test_table_interpolates_and_its_step_does_not_chatter(buoy, tmp_path):
    (tmp_path / "pto.csv").write_text("velocity,force\n-1,40\n-1e-5,20\n1e-5,-20\n1,-40\n")
    bodies = buoy({"kind": "table", "file": tmp_path / "pto.csv"})
    bodies.place({}, {"heave": 1.5})
    rows = run(bodies, 400)
    assert rows[0, 2] == pytest.approx(-20 - 20 * rows[0, 1], rel=1e-4)
    assert (rows[:, 1] > -1e-9).all() and rows[-1, 1] < 1e-6 and (np.diff(energy(rows)) <= 0).all()


def test_a_users_function(buoy, tmp_path):
    (tmp_path / "mine.py").write_text(
        "def brake(time, x, v):\n    return -1e7 * x - 3.0 * v + (5.0 if time > 1 else 0.0)\n"
    )
    bodies = buoy({"kind": "python", "function": f"{tmp_path / 'mine.py'}:brake"})
    bodies.place({}, {"heave": 1.0})
    rows = run(bodies, 400)
    assert energy(rows).max() < 0.5 * MASS and rows[-1, 0] == pytest.approx(5e-7, rel=0.01)
    assert any("power take-off too stiff" in note for note in bodies.notes)


def test_each_joint_has_its_own(buoy):
    bodies = buoy({"hip": {"damping": 1e9}, "knee": {"damping": 2.0}}, world=PAIR)
    bodies.place({}, {"hip": 1.0, "knee": 1.0})
    for _ in range(20):
        bodies.advance(DT, np.zeros((2, 6)), np.zeros((2, 2)), np.zeros(2))
    hip, knee = bodies.joints()["joint_velocity"]
    assert abs(hip) < 1e-5 and knee > 0.5
    assert bodies.joints()["joint_force"][1] == pytest.approx(-2.0 * knee)


@pytest.mark.parametrize(
    "pto, world, message",
    [
        ({"damping": 1.0}, PAIR, r"test.toml: bodies.body.pto: the file has 2 joints to choose from; .*hip, knee"),
        ({"ankle": {"damping": 1.0}}, PAIR, r"bodies.body.pto.ankle: no joint 'ankle'; known .*: hip, knee"),
        ({"kind": "table", "file": "none.csv"}, HEAVE, r"none.csv.*; give velocity and force"),
        ({"kind": "python", "function": "none.py:f"}, HEAVE, r"pto.function: no file '.*none.py'; write"),
        ({"kind": "python", "function": __file__ + ":none"}, HEAVE, r"pto.function: no function 'none'; .* has: .*run"),
    ],
)
def test_faults(buoy, pto, world, message):
    with pytest.raises(SceneError, match=message):
        buoy(pto, world=world)


def test_a_fault_in_a_users_function_names_it(buoy, tmp_path):
    (tmp_path / "mine.py").write_text("def brake(time, x, v):\n    return 1 / 0\n")
    with pytest.raises(RunError, match=r"mine.py:brake\(0, 0, 0\): ZeroDivisionError: division by zero"):
        buoy({"kind": "python", "function": f"{tmp_path / 'mine.py'}:brake"})


def test_a_function_that_returns_nan_stops_the_run_by_its_name(buoy, tmp_path):
    (tmp_path / "mine.py").write_text("def brake(time, x, v):\n    return float('nan') if time > 0.01 else -3.0 * v\n")
    bodies = buoy({"kind": "python", "function": f"{tmp_path / 'mine.py'}:brake"})
    with pytest.raises(RunError, match=r"mine.py:brake\(0.0.*\) returned nan; it must return a finite force"):
        run(bodies, 400)


MEMORIES = {
    "a sum": "s = [0.0]\ndef brake(time, x, v):\n    s[0] += 1e-3 * v\n    return -s[0]\n",
    "a filter": "s = [0.0]\ndef brake(time, x, v):\n    s[0] = 0.9 * s[0] + 0.1 * v\n    return -3 * s[0]\n",
    "a sample held": "s = {'t': 0.0, 'u': 0.0}\ndef brake(time, x, v):\n    if time - s['t'] > 0.02:\n"
    "        s.update(t=time, u=-3 * v)\n    return s['u']\n",
    "chance": "import random\ndef brake(time, x, v):\n    return random.random()\n",
}


@pytest.mark.parametrize("text", MEMORIES.values(), ids=MEMORIES)
def test_a_function_that_remembers_is_refused(buoy, tmp_path, text):
    (tmp_path / "mine.py").write_text(text)
    bodies = buoy({"kind": "python", "function": f"{tmp_path / 'mine.py'}:brake"})
    bodies.place({}, {"heave": 1.0})
    with pytest.raises(
        RunError, match=r"mine.py:brake\(.*\) gave .* and later .*: it remembers, and steps are repeated"
    ):
        run(bodies, 400)


def test_a_check_reads_a_users_function_and_does_not_run_it(buoy, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("raise SystemExit\ndef brake(time, x, v):\n    return -v\nbrake2 = lambda t, x, v: 0\n")
    with checking():
        for name in ("brake", "brake2"):
            bodies = buoy({"kind": "python", "function": f"{file}:{name}"})
            assert any(f"mine.py:{name} is not run by a check" in note for note in bodies.notes)
        assert bodies.joints()["joint_force"] == 0.0
        with pytest.raises(SceneError, match=r"pto.function: no function 'broke'; .*mine.py has: brake2, brake"):
            buoy({"kind": "python", "function": f"{file}:broke"})
        file.write_text("def brake(:\n")
        with pytest.raises(SceneError, match=r"mine.py: SyntaxError"):
            buoy({"kind": "python", "function": f"{file}:brake"})


def test_a_coulomb_force_needs_the_flag(make_bodies, tmp_path):
    option = 'timestep="0.01"><flag frictionloss="disable"/></option><option '
    world = '<body name="b"><joint name="heave" type="slide" axis="0 0 1"/><geom type="box" size=".1 .1 .1"/></body>'
    with pytest.raises(SceneError, match="disables flag constraint or frictionloss"):
        pto = {"kind": "coulomb", "force": 20.0}
        make_bodies(world, option=option, bodies={"body": {"mjcf": tmp_path / "body.xml", "pto": pto}})
