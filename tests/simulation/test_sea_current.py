"""A current through a sea: it keeps its speed, and waves on it the length and the height that theory gives them."""

import math

import numpy as np
import pytest

from fsi.errors import RunError
from fsi.fluid.gauges import elevation
from fsi.scene.geometry import incident_waves
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

PERIOD, HEIGHT, DEPTH, DR = 1.2, 0.1, 0.5, 0.04
OFF = 1e-9  # rate of zones that do nothing


def box(current, height=HEIGHT, periods=3.0, count=2, order=2, **parts):
    """Of `count` wave lengths to the nearest spacing."""

    def scene(half):
        data = {
            "spacing": DR,
            "duration": periods * PERIOD,
            "tank": {"min": [-half, -DEPTH], "max": [half, 0.2], "periodic": ["x"]},
            "sea": {"current": current, "waves": {"wave_height": height, "period": PERIOD, "order": order}},
            "output": {"series": 0, "particles": 0},
        }
        return Scene.model_validate(data | {key: data[key] | part for key, part in parts.items() if key in data})

    length = 2 * math.pi / incident_waves(scene(50 * DR)).k[0]
    return scene(round(0.5 * count * length / DR) * DR)


@pytest.mark.parametrize("rate", [OFF, 7.5])
def test_a_uniform_current_keeps_its_speed_and_the_level(rate):
    scene = box(0.3, height=1e-6, periods=2.0, count=1, order=1, sea={"rate": rate, "zone": 0.4})
    sim = Simulation(scene, threads=1)
    top = sim.fluid.position[:, 1].max()
    sim.run()
    u = sim.fluid.velocity[: sim.fluid.count]
    assert u[:, 0].mean() == pytest.approx(0.3, rel=1e-3)
    assert u.std(0).max() < 0.02 * 0.3
    assert sim.fluid.position[:, 1].max() == pytest.approx(top, abs=0.1 * DR)
    assert sim.fluid.lost == 0


@pytest.mark.parametrize("current", [0.3, -0.3])
def test_waves_run_freely_at_the_frequency_of_doppler_and_keep_their_height(current):
    """In a tank without zones the length is given, and the frequency at which the surface passes a fixed place free."""
    scene = box(current, sea={"rate": OFF})
    length = scene.tank.max[0] - scene.tank.min[0]
    k = 4 * math.pi / length
    sim, time, mode = Simulation(scene, threads=1), [], []
    x = np.linspace(scene.tank.min[0], scene.tank.max[0], 16, endpoint=False)

    def look(sim):
        own, shift = sim.fluid.position[: sim.fluid.count], np.array([length, 0.0])
        around = np.concatenate([own - shift, own, own + shift])
        eta = [elevation(around, np.array([place]), DR, scene.smoothing_length) for place in x]
        time.append(sim.time)
        mode.append(2 * np.mean(eta * np.exp(-1j * k * x)))

    sim.run(on_step=look)
    omega = -np.polyfit(time, np.unwrap(np.angle(mode)), 1)[0]
    assert omega == pytest.approx(2 * math.pi / PERIOD, rel=0.01)
    late = np.abs(mode)[np.array(time) > 2 * PERIOD].mean()
    exact = incident_waves(scene).elevation_amplitude[0]
    assert late == pytest.approx(exact, rel=0.1)  # an eighth of a spacing


def test_a_body_that_comes_to_the_end_of_the_periodic_axis_ends_the_run(tmp_path):
    body = (
        '<mujoco><worldbody><body name="buoy"><joint type="slide" axis="1 0 0"/>'
        '<geom type="box" size=".1 .5 .1" density="500"/></body></worldbody></mujoco>'
    )
    (tmp_path / "buoy.xml").write_text(body)
    data = box(0.5, height=0.01, periods=2, order=1).model_dump(exclude_unset=True)
    data["sea"]["zone"] = 0.2
    place = data["tank"]["max"][0] - 0.1 - 0.22
    data["bodies"] = {"buoy": {"mjcf": str(tmp_path / "buoy.xml"), "position": [place, 0.0, 0.0]}}
    sim = Simulation(Scene.model_validate(data), threads=1)
    with pytest.raises(RunError, match=r"body 'buoy' has come to .* m from the end of the x axis.*moor it"):
        sim.run()
