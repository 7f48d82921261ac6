"""Water that comes to rest before the run, and alarms of water where none can be."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fsi
from cases.validation.fluid import still_beds
from cases.validation.fluid.still_beds import SETUPS, TARGET, measure, scene
from fsi.errors import RunError, SceneError
from fsi.scene.binding import bind
from fsi.scene.geometry import start
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.simulation.slipped import Slipped

SHORES = ("steep", "shore", "flat_shore", "islet")


def simulation(it: Scene) -> Simulation:
    bodies, coupler, ground = bind(it, "test")
    return Simulation(it, bodies=bodies, coupler=coupler, ground=ground)


@pytest.mark.parametrize("name", SHORES)
def test_water_at_a_shore_is_at_rest(name, tmp_path):
    for error, value in measure(name, tmp_path).items():
        assert value <= TARGET[error], (error, value)


def shore(folder: Path, **fluid) -> Scene:
    return Scene.model_validate(scene(0.02, folder, **SETUPS["shore"]) | {"fluid": fluid})


def test_it_starts_at_rest_and_a_reset_goes_back_to_that(tmp_path):
    limit = 0.02 * np.sqrt(9.81 * still_beds.DEPTH)
    with fsi.open(shore(tmp_path)) as sim:
        at_start = np.sort(sim.simulation.fluid.position, axis=0)
        sim.run(0.1)
        assert np.linalg.norm(sim.simulation.fluid.velocity, axis=1).max() < limit
        sim.reset()
        assert np.array_equal(np.sort(sim.simulation.fluid.position, axis=0), at_start)
    with fsi.open(shore(tmp_path, start="hydrostatic")) as sim:
        sim.run(0.1)
        assert np.linalg.norm(sim.simulation.fluid.velocity, axis=1).max() > limit  # what settling is for


def test_bodies_are_held_while_the_water_settles():
    with fsi.open("floating_box_2d", overrides=["spacing=0.05", "fluid.start=settled"]) as sim:
        loose = fsi.open("floating_box_2d", overrides=["spacing=0.05"])
        assert np.array_equal(sim.data.qpos, loose.data.qpos)
        assert sim.time == 0.0
        loose.close()


@pytest.mark.parametrize(
    "fluid, key",
    [
        ({"acceleration": [0.1, 0.0]}, "fluid.acceleration"),
        ({"blocks": [{"min": [0.0, -0.1], "max": [0.2, 0.1]}]}, "fluid.blocks"),
        ({"blocks": [{"min": [0.0, -0.5], "max": [0.6, 0.0], "velocity": [1.0, 0.0]}]}, "fluid.blocks[0].velocity"),
    ],
)
def test_fluid_that_does_not_come_to_rest_cannot_settle(tmp_path, fluid, key):
    with pytest.raises(SceneError, match="to rest") as fault:
        fsi.open(shore(tmp_path, start="settled", **fluid))
    assert key in str(fault.value)
    assert start(shore(tmp_path, **fluid), fixed=True) != "settled"


def test_no_water_slips_between_a_bed_and_the_side_walls(tmp_path):
    """Particles that began in the edge, closer to both than the wall guard lets water come, went through."""
    data = scene(0.02, tmp_path, **SETUPS["shore_3d"])
    it = Scene.model_validate(data | {"fluid": {"start": "hydrostatic"}})
    sim = simulation(it)
    sim.run(0.6)
    _, _, ground = bind(it, "test")
    assert ground.clearance(sim.fluid.position).min() > 0.0
    assert sim.alarms.audit()["slipped_particles"] == 0
    sim.close()


@pytest.mark.parametrize("limit, ends", [(0.5, False), (0.01, True)])
def test_water_inside_solids_is_warned_of_and_ends_the_run(tmp_path, limit, ends):
    it = Scene.model_validate(scene(0.02, tmp_path, **SETUPS["shore"]) | {"alarms": {"lost_particles": limit}})
    sim = simulation(it)
    sim.run(0.01)
    sim.fluid.position[0] = [0.3, -0.4]  # 0.35 m under the bed
    told = "1 of 75 particles .* slipped between boundary particles"
    if ends:
        with pytest.raises(RunError, match=told):
            sim.run(0.21)
    else:
        sim.run(0.21)
        assert any(re.search(told, note) for note in sim.warnings)
    assert sim.alarms.audit()["slipped_particles"] == 1
    sim.close()


def test_water_that_went_over_a_wall_has_not_slipped_through_it(tmp_path):
    it = Scene.model_validate(scene(0.02, tmp_path))
    over, behind = [0.7, 0.25], [0.7, -0.1]  # the wall at x = 0.6 ends with the tank, at z = 0.2
    slipped = Slipped(it, None, None)
    depth = slipped.depth(SimpleNamespace(position=np.array([over, behind])))
    assert (depth > slipped.limit).tolist() == [False, True]
