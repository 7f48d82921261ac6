"""Instruments against what is known: hydrostatics, a uniform flow, the volume that has passed."""

import sys
from pathlib import Path

import numpy as np
import pytest

from fsi.compute.reduce import SERIAL
from fsi.errors import SceneError
from fsi.fluid.currents import Columns, Discharge, Flood, Shore, velocity_at
from fsi.scene.check import check_scene
from fsi.scene.instruments import Area, RunUp, Velocimeter
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.simulation.view import View

sys.path.insert(0, str(Path(__file__).parents[1] / "fluid"))
from tanks import still_tank

DR, DEPTH, WEIGHT = 0.04, 0.48, 9810.0
QUIET = {"series": 0.05, "particles": 0}


class Kept:
    """A recorder that keeps the series."""

    def __init__(self):
        self.frames = []

    def series(self, frame):
        self.frames.append({name: np.array(value) for name, value in frame.series.items()} | {"time": frame.time})

    def ignore(self, *_):
        pass

    begin = particles = event = end = ignore


def ran(scene, until, **parts):
    kept = Kept()
    sim = Simulation(scene, recorders=[kept], threads=1, **parts)
    sim.run(until)
    return sim, kept.frames


@pytest.fixture(scope="module")
def still():
    loads = {"right": {"on": "x+", "about": (0.96, -DEPTH)}, "left": {"on": "x-"}, "bed": {"on": "z-"}}
    loads["low"] = {"on": "x+", "min": (0.9, -DEPTH), "max": (1.0, -0.24)}
    loads["all"] = {"min": (-1.0, -1.0), "max": (2.0, 1.0)}
    return ran(still_tank(spacing=DR, depth=DEPTH, length=0.96, loads=loads, output=QUIET), 0.21)


def test_load_on_walls_at_rest_is_the_integral_of_hydrostatics(still):
    _, frames = still
    assert np.isnan(frames[0]["load_force"]).all()  # nothing is known before the first step
    force, torque, centre = (frames[-2][f"load_{kind}"] for kind in ("force", "torque", "centre"))
    push = 0.5 * WEIGHT * DEPTH**2
    np.testing.assert_allclose(force[:2, 0], [push, -push], rtol=0.01)
    assert force[2, 2] == pytest.approx(-WEIGHT * DEPTH * 0.96, rel=0.01)
    np.testing.assert_allclose(centre[0], [0.96, 0.0, -2 / 3 * DEPTH], atol=0.2 * DR)
    np.testing.assert_allclose(centre[2], [0.48, 0.0, -DEPTH], atol=0.2 * DR)
    assert torque[0, 1] == pytest.approx(push * DEPTH / 3, rel=0.02)  # about the toe
    assert force[3, 0] == pytest.approx(0.75 * push, rel=0.05)  # the lower half, whose face ends between two rows


def test_loads_on_all_sides_make_up_the_force_on_the_walls(still):
    force = still[1][-2]["load_force"]
    np.testing.assert_allclose(force[:3].sum(0), force[4], atol=1e-6 * WEIGHT)


def test_loads_change_no_step(still):
    sim, _ = still
    plain, _ = ran(still_tank(spacing=DR, depth=DEPTH, length=0.96, output=QUIET), 0.21)
    assert np.array_equal(sim.fluid.position, plain.fluid.position)
    assert np.array_equal(sim.fluid.pressure_values, plain.fluid.pressure_values)


class Block:
    """A box of stone: a static wet geom."""

    def __init__(self, low, high, name):
        self.low, self.high, self.name = np.array(low), np.array(high), name

    def clearance(self, points):
        outside = np.maximum(self.low - points, points - self.high)
        far = np.linalg.norm(np.maximum(outside, 0.0), axis=1)
        return np.where(far > 0, far, outside.max(1))

    def boundary(self, spacing, layers):
        axes = [np.arange(a + spacing / 2, b, spacing) for a, b in zip(self.low, self.high, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


def test_load_on_the_bed_and_on_a_face_of_it():
    """Ground as a step in the middle of the tank: its seaward face alone carries the water's push, with what pushes under its
    foot; as a whole it carries none along x."""
    face = {"on": "bathymetry", "min": (0.31, -DEPTH), "max": (0.33, 0.2)}
    scene = still_tank(
        spacing=DR, depth=DEPTH, length=0.96, loads={"face": face, "step": {"on": "bathymetry"}}, output=QUIET
    )
    tank = scene.tank.model_copy(update={"bathymetry": Path("step.stl")})
    step = Block((0.32, -DEPTH), (0.64, 0.2), "step")
    _, frames = ran(scene.model_copy(update={"tank": tank}), 0.11, ground=step)
    force = frames[-2]["load_force"]
    assert force[0, 0] == pytest.approx(0.5 * WEIGHT * DEPTH**2, rel=0.03)
    assert abs(force[1, 0]) < 0.01 * WEIGHT * DEPTH**2


def test_a_load_on_nothing_is_refused():
    tank = {"spacing": DR, "depth": DEPTH}
    with pytest.raises(SceneError, match=r"loads\.a: no boundary particle lies there"):
        Simulation(still_tank(**tank, loads={"a": {"min": (0.4, -0.2), "max": (0.5, -0.1)}}))
    for on, why in (("y+", "the tank has no wall"), ("bathymetry", "no bathymetry"), ("pier", "no side of the tank")):
        with pytest.raises(SceneError, match=why):
            check_scene(still_tank(**tank, loads={"a": {"on": on}}))


def test_the_volume_that_passes_a_plane_is_what_lies_behind_it():
    walls = {"min": (0.0, -DEPTH), "max": (2.0, 0.4)}
    fluid = {"blocks": [{"min": (0.0, -DEPTH), "max": (0.6, 0.0), "velocity": (1.0, 0.0)}]}
    planes = {"through": {"min": (0.7, -DEPTH), "max": (0.7, 0.4)}, "above": {"min": (0.7, 0.1), "max": (0.7, 0.4)}}
    parts = {"tank": walls, "fluid": fluid, "fluxes": planes, "output": QUIET}
    scene = Scene.model_validate({"spacing": DR, "duration": 1.0} | parts)
    sim, frames = ran(scene, 0.3)
    beyond = DR**2 * (sim.fluid.position[:, 0] >= 0.7).sum()
    assert beyond > 0.05
    assert frames[-1]["passed_volume"][0] == pytest.approx(beyond, rel=1e-12)
    assert frames[-1]["passed_volume"][1] == 0.0
    time = np.array([f["time"] for f in frames])
    rate = np.array([f["discharge"][0] for f in frames])
    assert (rate[1:] * np.diff(time)).sum() == pytest.approx(beyond, rel=1e-9)
    again = Discharge(scene)
    again.restore(sim.instruments.discharge.state())
    assert again.passed[0] == pytest.approx(beyond, rel=1e-12)


def lattice(dim, low, high):
    axes = [np.arange(a + DR / 2, b, DR) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_velocimeter_reads_a_uniform_flow_and_nothing_in_air(dim):
    points = lattice(dim, [0.0] * dim, [0.8] * dim)
    flow = np.arange(1.0, dim + 1)
    for place in ([0.4] * dim, [0.0] * dim):  # inside, and in a corner
        read = velocity_at(points, np.tile(flow, (len(points), 1)), place, DR, 2 * DR)
        np.testing.assert_allclose(read, flow, rtol=1e-12)
    assert np.isnan(velocity_at(points, points, [2.0] * dim, DR, 2 * DR)).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_thickness_run_up_and_flooded_area_of_a_wedge(dim):
    """Water of a level surface over a beach of slope 0.2 that rises through it at x = 2."""
    across = [1.2] * (dim - 2)
    scene = Scene.model_validate(
        {
            "dimension": dim,
            "spacing": DR,
            "duration": 1,
            "tank": {"min": [0.0] * (dim - 1) + [-0.4], "max": [3.2, *across, 0.4]},
        }
    )
    points = lattice(dim, [0.0] * (dim - 1) + [-0.4], [3.2, *across, 0.0])
    wet = points[points[:, -1] > 0.2 * (points[:, 0] - 2.0)]
    side = [0.0] * (dim - 2)
    middle = [0.6] * (dim - 2)
    read, height = Columns(scene, np.array([[0.0, *side], [1.0, *middle]]))(wet, SERIAL)
    np.testing.assert_allclose(read, [0.4, 0.2], atol=0.35 * DR)
    assert height[1] == pytest.approx(-0.1, abs=0.3 * DR)
    shore = Shore(scene, RunUp(start=(0.5, *middle), end=(3.0, *middle), depth=0.08))
    distance, top = shore(wet, SERIAL)
    assert distance == pytest.approx(1.1, abs=3 * DR) and top == pytest.approx(0.0, abs=DR)
    area, depth = Flood(scene, Area(min=(0.0, *side), max=(3.2, *across), depth=0.08))(wet, SERIAL)
    width = 1.0 if dim == 2 else 1.2
    assert area == pytest.approx(1.6 * width, abs=0.15 * width) and depth == pytest.approx(0.24, abs=0.5 * DR)
    dry = Shore(scene, RunUp(start=(2.5, *middle), end=(3.0, *middle)))(wet, SERIAL)
    assert dry[0] == 0.0 and np.isnan(dry[1])


def test_the_three_readings_of_a_gauge_agree_in_still_water():
    gauges = {kind: {"x": 0.48, "reading": kind} for kind in ("surface", "particles", "points")}
    sim = Simulation(still_tank(spacing=DR, depth=DEPTH, length=0.96, gauges=gauges))
    np.testing.assert_allclose(sim.instruments.series(0.0, 0.0)["elevation"], 0.0, atol=0.02 * DR)


FLOAT = """<mujoco><worldbody><body name="raft" pos="0.5 0 0"><freejoint/>
<geom name="hull" type="box" size="0.16 0.5 0.12" mass="38.4"/>
<site name="keel" pos="0 0 -0.12"/><site name="hold"/></body></worldbody></mujoco>"""


def afloat(tmp_path, **probes):
    pytest.importorskip("mujoco")
    (tmp_path / "raft.xml").write_text(FLOAT)
    body = {"bodies": {"raft": {"mjcf": tmp_path / "raft.xml"}}}
    return still_tank(spacing=DR, depth=DEPTH, length=1.0, probes=probes, output=QUIET, **body)


def test_a_probe_that_rides_reads_what_a_fixed_one_does_and_moves_with_its_body(tmp_path):
    keel = {"position": (0.5, -0.12)}
    sim = Simulation(afloat(tmp_path, fixed=keel, rides=keel | {"body": "raft"}, site={"site": "keel"}))
    read = sim.instruments.series(0.0, 0.0)["pressure"]
    assert read[0] == pytest.approx(0.12 * WEIGHT, rel=0.01)
    np.testing.assert_allclose(read[1:], read[0], rtol=1e-12)
    data = sim.bodies.data
    data.qpos[0] += 0.1
    data.qpos[3:7] = [np.cos(0.25), 0, np.sin(0.25), 0]  # half a radian about y
    import mujoco

    mujoco.mj_forward(sim.bodies.model, data)
    place = sim.instruments._riders["site"].place()
    np.testing.assert_allclose(place, [0.6 - 0.12 * np.sin(0.5), -0.12 * np.cos(0.5)], atol=1e-12)
    seen = View(sim).probes  # by a controller and by the user of `fsi.open`
    np.testing.assert_array_equal(list(seen.values()), sim.instruments.series(0.0, 0.0)["pressure"])
    assert seen["site"] == seen["rides"] != seen["fixed"]


def test_a_probe_that_rides_on_nothing_is_refused(tmp_path):
    with pytest.raises(SceneError, match=r"probes\.a\.site: no moving wet body has a site 'nose'"):
        Simulation(afloat(tmp_path, a={"site": "nose"}))
    with pytest.raises(SceneError, match=r"probes\.a\.site: the site is 0\.12 m inside a solid"):
        Simulation(afloat(tmp_path, a={"site": "hold"}))
    with pytest.raises(SceneError, match=r"velocimeters\.v: reaches 0\.12 m into a solid"):
        Simulation(afloat(tmp_path).model_copy(update={"velocimeters": {"v": Velocimeter(position=(0.5, 0.0))}}))
    with pytest.raises(SceneError, match=r"probes\.a\.body: no moving wet body 'boat'"):
        Simulation(afloat(tmp_path, a={"position": (0.5, -0.12), "body": "boat"}))
    with pytest.raises(SceneError, match="the scene has no bodies"):
        check_scene(still_tank(probes={"a": {"position": (0.5, -0.12), "body": "boat"}}))
