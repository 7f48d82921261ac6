"""Forced oscillation: the scene it makes, and added mass and damping from a log whose force is known."""

import math

import numpy as np
import pytest
import xarray

from bodies import load
from cases.study.bem import compare_radiation, modes, radiated, read_bem, responses, transformation
from cases.study.design import design
from cases.study.plan import Bem, Parameter, Study
from cases.study.radiation import SETTLE, radiation_figures, radiation_study
from cases.study.routines import check_routine
from fsi.errors import SceneError

BOX = """
<mujoco model="box">
  <option timestep="0.002" integrator="implicitfast"/>
  <custom><tuple name="wet"><element objtype="geom" objname="box"/></tuple></custom>
  <worldbody>
    <body name="box">
      <joint name="heave" type="slide" axis="0 0 1"/>
      <joint name="roll" type="hinge" axis="0 1 0"/>
      <geom name="box" type="box" size="0.15 0.15 0.1" density="500"/>
    </body>
  </worldbody>
</mujoco>
"""
TANK = """
spacing = 0.05
duration = 1.0
[tank]
min = [-1.0, -0.5]
max = [1.0, 0.3]
width = 0.3
[bodies.box]
mjcf = "box.xml"
[bodies.box.pto.heave]
damping = 5.0
[waves]
kind = "regular"
wave_height = 0.05
period = 1.0
"""
OMEGA, STEP = 5.0, 0.02


@pytest.fixture
def box(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "box.xml").write_text(BOX)
    (tmp_path / "box.toml").write_text(TANK)
    return tmp_path


def study(**changes) -> Study:
    settings = {"radiation.joint": "heave", "radiation.amplitude": 0.02, **changes}
    omega = Parameter(key="radiation.omega", values=(OMEGA, 2 * OMEGA), units="rad/s")
    return Study(scene="box.toml", routine="radiation", set=settings, parameters={"omega": omega})


def test_a_point_is_a_scene_with_one_joint_that_oscillates(box):
    made = design(study(), {"omega": OMEGA}, box / "runs").scene
    assert made.waves is None and not made.bodies["box"].pto and made.coupler.scheme == "prescribed"
    motion = made.coupler.motion["heave"]
    assert (motion.amplitude, motion.omega) == (0.02, OMEGA)
    assert made.duration == pytest.approx((1 + SETTLE + 4) * 2 * math.pi / OMEGA)
    by_period = study(**{"radiation.ramp": 2.0, "radiation.periods": 3, "radiation.amplitude.heave": 0.01})
    by_period = by_period.model_copy(update={"parameters": {"T": Parameter(key="radiation.period", values=(0.5,))}})
    other = design(by_period, {"T": 0.5}, box / "runs").scene
    assert other.coupler.motion["heave"].amplitude == 0.01 and other.duration == pytest.approx(3.0)
    assert other.output.series < 0.5 / 50


@pytest.mark.parametrize(
    "changes, fault",
    [
        ({"radiation.amplitude": ""}, "radiation.amplitude: missing"),
        ({"radiation.amplitude": -0.1}, "radiation.amplitude: is -0.1; give a positive number"),
        ({"radiation.joint": ""}, "radiation.joint: missing"),
        ({"radiation.speed": 3}, "radiation.speed: unknown key"),
        ({"radiation.period": 3}, "2 of omega, period, frequency are given"),
    ],
)
def test_keys_that_are_wrong_are_named(box, changes, fault):
    with pytest.raises(SceneError) as error:
        design(study(**changes), {"omega": OMEGA}, box / "runs")
    assert fault in str(error.value)


def test_a_study_of_a_scene_moves_every_joint(box):
    made = radiation_study("box.toml")
    assert made.parameters["driven"].values == ("heave", "roll") and len(made.parameters["omega"].values) == 6
    check_routine(made)
    assert made.settings["radiation.amplitude.heave"] == 0.05  # a spacing, for a tenth of the box is less
    with pytest.raises(ValueError, match="keys of radiation need it"):
        Study(scene="box.toml", parameters={"a": Parameter(key="radiation.omega", values=(1.0,))})
    (box / "empty.toml").write_text(TANK.split("[bodies.box]")[0])
    with pytest.raises(SceneError, match="no joint to move by force"):
        radiation_study("empty.toml")


def test_a_free_body_gets_slides_and_hinges(box):
    free = BOX.replace('<joint name="heave" type="slide" axis="0 0 1"/>', "<freejoint/>")
    free = free.replace('<joint name="roll" type="hinge" axis="0 1 0"/>', "")
    free = free.replace('<body name="box">', '<body name="box" euler="0 0 90">')
    (box / "box.xml").write_text(free)
    (box / "box.toml").write_text(TANK.replace("[bodies.box.pto.heave]\ndamping = 5.0\n", ""))
    made = radiation_study("box.toml")
    assert made.parameters["driven"].values == ("box surge", "box heave", "box pitch")
    point = design(made, {"driven": "box surge", "omega": 6.0}, box / "runs")
    bodies = load(point.scene)
    assert bodies.joint_names == ("box surge", "box heave", "box pitch")
    for motion, way in (("surge", [1, 0, 0]), ("heave", [0, 0, 1])):
        before = bodies.motion().position[0].copy()
        bodies.place({f"box {motion}": 0.1}, {})
        assert bodies.motion().position[0] - before == pytest.approx(0.1 * np.array(way))
    (box / "box.xml").write_text(free.replace("</mujoco>", '<keyframe><key qpos="0 0 0 1 0 0 0"/></keyframe></mujoco>'))
    with pytest.raises(SceneError, match=r"box\.xml: has keyframes of a free body"):
        radiation_study("box.toml")


def log(scene, mass, damping, coupled):
    """The log of a run whose fluid has this added mass and damping in heave, `coupled` of both into roll, and the buoyancy of
    the body in its pose; each force is that of the step before, in its middle, but for the buoyancy, that at its start."""
    motion, bodies = scene.coupler.motion["heave"], load(scene)
    time = np.arange(0.0, scene.duration + STEP / 2, STEP)
    phase = lambda t: (np.sin(OMEGA * t), np.cos(OMEGA * t))  # noqa: E731
    still, wrench = bodies.buoyancy(), np.zeros((len(time), 1, 6))
    for n, t in enumerate(time - STEP / 2):
        s, c = phase(t)
        bodies.place({"heave": motion.amplitude * phase(t - STEP / 2)[0]}, {})
        force = motion.amplitude * (mass * OMEGA**2 * s - damping * OMEGA * c)
        wrench[n] = still()
        wrench[n, 0, [2, 4]] += force, coupled * force
    s, c = phase(time)
    return xarray.Dataset(
        {
            "joint_position": (("time", "joint"), np.stack([motion.amplitude * s, 0 * s], 1)),
            "joint_velocity": (("time", "joint"), np.stack([motion.amplitude * OMEGA * c, 0 * s], 1)),
            "body_force": (("time", "body", "axis"), wrench[..., :3]),
            "body_torque": (("time", "body", "axis"), wrench[..., 3:]),
            "time_step": ("time", np.full(len(time), STEP)),
        },
        coords={"time": time, "joint": ["heave", "roll"], "body": ["box"], "axis": list("xyz")},
    )


def test_added_mass_and_damping_are_those_of_the_force(box):
    scene = design(study(**{"radiation.periods": 2}), {"omega": OMEGA}, box / "runs").scene
    data = log(scene, 12.0, 30.0, 0.1)
    found = {f.key: f for f in radiation_figures(data, scene)}
    assert found["added_mass.heave"].value == pytest.approx(12.0, rel=5e-3)  # of the still water, 36 kg are taken out
    assert found["radiation_damping.heave"].value == pytest.approx(30.0, rel=5e-3)
    assert found["added_mass.roll"].value == pytest.approx(1.2, rel=5e-3)
    assert found["added_mass_error.heave"].value < 0.5
    assert "kg" in found["added_mass.heave"].units
    with pytest.raises(SceneError, match=r"radiation\.periods: 0.* s are left"):
        list(radiation_figures(data.sel(time=slice(0, 3.0)), scene))


DOFS = ["float__Heave", "spar__Heave"]


def two_bodies(path):
    """A dataset of two heaving bodies, as Capytaine names their degrees of freedom."""
    w = np.array([1.0, 2.0, 3.0, 4.0])
    added = np.array([[4.0, -1.0], [-1.0, 6.0]]) * np.ones((4, 1, 1))
    lost = np.array([[2.0, 0.5], [0.5, 1.0]]) * np.ones((4, 1, 1))
    force = np.stack([[50.0 + 0j, 20.0 + 5j]] * 4)[:, None]
    data = xarray.Dataset(
        {
            "added_mass": (("omega", "radiating_dof", "influenced_dof"), added),
            "radiation_damping": (("omega", "radiating_dof", "influenced_dof"), lost),
            "inertia_matrix": (("influenced_dof", "radiating_dof"), np.diag([10.0, 30.0])),
            "hydrostatic_stiffness": (("influenced_dof", "radiating_dof"), np.diag([90.0, 40.0])),
            "excitation_force": (
                ("complex", "omega", "wave_direction", "influenced_dof"), np.stack([force.real, force.imag])),
        },
        coords={"omega": w, "radiating_dof": DOFS, "influenced_dof": DOFS, "wave_direction": [0.0], "complex": ["re", "im"]},
    )  # fmt: skip
    data.isel(omega=[2, 0, 3, 1]).to_netcdf(path, engine="h5netcdf")  # in any order
    return path


def test_joints_are_modes_of_several_bodies(tmp_path):
    """A spar that heaves and a float that slides along it: the joints move both bodies, and one of them."""
    bem = Bem(file=two_bodies(tmp_path / "rm3.nc"), dofs={"heave": dict.fromkeys(DOFS, 1.0), "slide": DOFS[0]})
    data, ways = read_bem(bem.file), modes(bem, ["slide", "heave"])
    found = radiated(data, ways).isel(omega=0)
    assert found.added_mass.sel(driven="heave", joint="heave") == pytest.approx(4 + 6 - 2)
    assert found.added_mass.sel(driven="heave", joint="slide") == pytest.approx(4 - 1)
    damping = np.array([0.0, 25.0])
    joints = responses(data, transformation(data, ways), damping, np.zeros(2))
    link = 25.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])  # the same damper between the bodies
    for n, w in enumerate(data.omega.values):
        left = -(w**2) * np.array([[14.0, -1.0], [-1.0, 36.0]]) - 1j * w * (np.array([[2, 0.5], [0.5, 1]]) + link)
        absolute = np.linalg.solve(left + np.diag([90.0, 40.0]), [50.0, 20.0 + 5j])
        assert joints[n] == pytest.approx([absolute[1], absolute[0] - absolute[1]])
    with pytest.raises(SceneError, match=r"bem\.dofs: no joint 'slide'; the study has heave"):
        modes(bem, ["heave"])
    with pytest.raises(ValueError, match="give one of dof"):
        Bem(file="rm3.nc", dof="Heave", dofs={"heave": "Heave"})


def test_a_radiation_study_is_set_beside_theory(tmp_path):
    facts = {"units": "kg", "long_name": "added mass"}
    shape = (("driven", "omega", "joint"), np.ones((2, 2, 2)), facts)
    data = xarray.Dataset({"added_mass": shape, "radiation_damping": shape})
    data = data.assign_coords(
        driven=("driven", ["heave", "slide"], {"key": "radiation.joint"}),
        omega=("omega", [2.0, 9.0], {"key": "radiation.omega", "units": "rad/s"}),
        joint=["heave", "slide"],
    )
    bem = Bem(file=two_bodies(tmp_path / "rm3.nc"), dofs={"heave": dict.fromkeys(DOFS, 1.0), "slide": DOFS[0]})
    found = compare_radiation(data, bem)
    at = found.added_mass_bem.sel(driven="slide", joint="slide")
    assert at.sel(omega=2.0) == pytest.approx(4.0) and np.isnan(at.sel(omega=9.0))  # beyond the file
    assert found.added_mass_theory.sizes["bem_omega"] == 4 and found.omega.attrs["key"] == "radiation.omega"


def test_a_study_is_no_scene_to_radiate(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text('scene = "flap.toml"\n[parameters."waves.period"]\nvalues = [1.0, 2.0]\n')
    with pytest.raises(SceneError, match=r"study.toml: is a study, not a scene; give --radiation the scene itself, flap.toml"):
        radiation_study(file)
