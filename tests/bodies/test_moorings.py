"""Mooring lines: the catenary of theory, a spring without weight, and what a float on lines does."""

import math

import numpy as np
import pytest

import fsi
from bodies import load
from fsi.errors import SceneError
from fsi.record.series import labels

pytest.importorskip("moorpy")

FLOAT = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="float">
      {joints}
      <geom name="float" type="box" size="0.15 0.15 0.1" density="500"/>
      <site name="bow" pos="-0.15 0 0"/>
    </body>
  </worldbody>
  <sensor><accelerometer name="felt" site="bow"/></sensor>
</mujoco>
"""
HEAVY = {"mass": 2.0, "diameter": 0.02, "EA": 1e7}
G, RHO = 9.81, 1000.0


@pytest.fixture
def bodies(tmp_path):
    def made(lines, joints="<freejoint/>", **keys):
        (tmp_path / "float.xml").write_text(FLOAT.format(joints=joints))
        body = {"mjcf": tmp_path / "float.xml", "moorings": lines, **keys}
        tank = {"min": (-6.0, -2.0), "max": (6.0, 0.5), "width": 0.3}
        return load(fsi.Scene(spacing=0.05, duration=1.0, tank=tank, bodies={"float": body}))

    return made


def catenary(across, height, length):
    """Tension over weight per length at the upper end of an inextensible line: sqrt(l^2 - h^2) = 2 a sinh(x / 2a)
    (Irvine 1981, Cable Structures, sec. 1.2)."""
    low, high = 1e-3, 1e4
    for _ in range(200):
        a = math.sqrt(low * high)
        low, high = (
            (a, high) if 2 * a * math.sinh(min(across / (2 * a), 500)) > math.sqrt(length**2 - height**2) else (low, a)
        )
    middle = a * math.atanh(height / length)  # of the ends from the lowest point
    return a * math.cosh((middle + across / 2) / a)


def test_a_hanging_line_is_the_catenary_of_theory(bodies):
    line = {"anchor": (-4.15, 0.0, -1.0), "fairlead": "bow", "length": 4.5, **HEAVY}
    [tension] = bodies({"line": line}).moorings()["mooring_tension"]
    weight = (HEAVY["mass"] - RHO * math.pi * 0.02**2 / 4) * G
    assert tension == pytest.approx(weight * catenary(4.0, 1.0, 4.5), rel=1e-4)


def test_a_line_on_the_floor_pulls_as_theory_has_it(bodies):
    """H = T0: height = a (cosh(s / a) - 1) over the hanging part of length s (Faltinsen 1990, eq. 8.16 ff.)."""
    a = 1.2
    s = a * math.acosh(2.0 / a + 1)  # x of the hanging part
    hanging = a * math.sinh(s / a)
    length = hanging + 1.0
    line = {"anchor": (-0.15 - 1.0 - s, 0.0, -2.0), "fairlead": "bow", "length": length, "mass": 1.0, "EA": 1e8}
    [tension] = bodies({"line": line}).moorings()["mooring_tension"]
    assert tension == pytest.approx(G * (a + 2.0), rel=1e-4)


def test_a_float_between_springs_swings_at_their_frequency(bodies):
    slide = '<joint name="surge" type="slide" axis="1 0 0"/>'
    lines = {
        name: {
            "anchor": (side * 3.0, 0.0, 0.0),
            "fairlead": (side * 0.15, 0.0, 0.0),
            "length": 2.5,
            "mass": 0,
            "EA": 2e4,
        }
        for name, side in (("left", -1), ("right", 1))
    }
    set_ = bodies(lines, slide)
    assert set_.moorings()["mooring_tension"] == pytest.approx([2e4 * (2.85 / 2.5 - 1)] * 2)
    omega = math.sqrt(2 * 2e4 / 2.5 / 9.0)
    set_.place({"surge": 0.01}, {})
    none, dt = np.zeros((1, 6)), 0.05 / omega  # a step of the fluid
    track = []
    for _ in range(1000):
        set_.advance(dt, none, np.zeros((1, 1)), np.zeros(1))
        track.append(set_.data.qpos[0])
    track = np.array(track)
    assert np.abs(track[-200:]).max() == pytest.approx(0.01, rel=0.02)  # neither driven nor damped
    turns = np.flatnonzero(np.diff(np.sign(track)) != 0)
    assert (turns[-1] - turns[0]) * dt * omega / math.pi == pytest.approx(len(turns) - 1, rel=1e-3)


def test_a_spring_that_is_slack_is_told(bodies):
    line = {"anchor": (-4.15, 0.0, 0.0), "fairlead": "bow", "mass": 0.0, "EA": 1e3}
    for length, told in ((3.9, False), (4.0, False), (50.0, True)):
        notes = " ".join(bodies({"line": line | {"length": length}}).notes)
        assert ("mooring 'line' has no weight and is 50 m long between ends 4 m apart" in notes) == told


def test_a_stiff_line_gets_substeps(bodies):
    slide = '<joint name="surge" type="slide" axis="1 0 0"/>'
    stiff = {"anchor": (-3.0, 0.0, 0.0), "fairlead": "bow", "length": 2.84, "mass": 0, "EA": 1e8}
    set_ = bodies({"line": stiff}, slide)
    for _ in range(50):
        set_.advance(2e-3, np.array([[8e5, 0, 0, 0, 0, 0]]), np.zeros((1, 1)), np.zeros(1))
    assert abs(set_.data.qpos[0]) < 0.05 and np.isfinite(set_.data.qvel).all()


@pytest.mark.slow
def test_the_equilibrium_carries_the_lines(bodies):
    lines = {
        name: {
            "anchor": (side * 2.0, 0.0, -2.0),
            "fairlead": (side * 0.15, 0.0, 0.0),
            "length": 3.0,
            "mass": 1.0,
            "EA": 1e6,
        }
        for name, side in (("left", -1), ("right", 1))
    }
    alone, moored = bodies({}, start="equilibrium"), bodies(lines, start="equilibrium")
    assert alone.data.qpos[2] == pytest.approx(0.0, abs=1e-4)
    down = -sum(pull[2] for pull in (line.pull(line.place(moored.data))[0] for line in moored._moorings._lines))
    assert moored.data.qpos[2] == pytest.approx(-down / (RHO * G * 0.3 * 0.3), rel=0.01) and down > 30
    assert moored.hydrostatics()["float"]["rest"]["rise"] == pytest.approx(0.0, abs=1e-4)


def test_a_moored_run_logs_its_tensions_and_sensors_feel_them(bodies, tmp_path):
    bodies({})
    line = {"anchor": (-1.0, 0.0, -0.5), "fairlead": "bow", "length": 0.95, "mass": 0.0, "EA": 2e3}
    other = line | {"anchor": (1.0, 0.0, -0.5), "fairlead": (0.15, 0.0, 0.0)}
    body = {"mjcf": tmp_path / "float.xml", "moorings": {"bow": line, "stern": other}, "start": "equilibrium"}
    tank = {"min": (-1.0, -0.5), "max": (1.0, 0.3), "width": 0.3}
    scene = fsi.Scene(spacing=0.05, duration=1.0, tank=tank, bodies={"float": body})
    with fsi.open(scene, threads=1) as sim:
        sim.run(0.1)
        tension, other = sim.simulation.balance.series()["mooring_tension"]
        assert labels(scene, sim.bodies)["mooring"] == ["bow", "stern"]
        assert tension > 20 and tension == pytest.approx(other, rel=0.1)
        assert abs(sim.data.qvel[0]) < 0.05  # it started where the line lets it rest
        felt = sim.data.sensor("felt").data
        assert np.linalg.norm(felt - [0, 0, 9.81]) < 2.0


@pytest.mark.parametrize(
    "change, told",
    [
        ({"fairlead": "stern"}, r"bodies.float.moorings.line.fairlead: no site 'stern'; sites of the file: bow"),
        ({"anchor": (-4.0, 0.0, -2.5)}, r"line.anchor: z = -2.5 m is below the tank's floor"),
        ({"diameter": 0.2}, r"it floats; give it mass"),
        ({"length": 2.0}, r"line.length: anchor and fairlead are .* m apart"),
        ({"fairlead": (0.0, 0.0, 0.0), "body": "keel"}, r"no body 'keel' that moves; name one of float"),
    ],
)
def test_lines_that_cannot_be_are_told(bodies, change, told):
    line = {"anchor": (-4.15, 0.0, -1.0), "fairlead": "bow", "length": 4.5, **HEAVY}
    with pytest.raises(SceneError, match=told):
        bodies({"line": line | change})
