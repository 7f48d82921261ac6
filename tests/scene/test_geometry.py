"""One water depth for a check and a run."""

import pytest

from fsi.scene import geometry
from fsi.scene.check_waves import wave_summary
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

LOW = {
    "spacing": 0.04,
    "duration": 1.0,
    "tank": {"min": [0.0, -0.7], "max": [10.0, 0.5]},
    "fluid": {"blocks": [{"min": [0.0, -0.7], "max": [10.0, -0.3]}]},
    "waves": {"wave_height": 0.05, "period": 1.8},
}


def test_check_and_run_make_the_same_waves_in_a_block_below_the_still_water_level():
    """The check once spoke of 23.5 mm by the tank's depth, the run made 32.8 mm by the block's."""
    scene = Scene.model_validate(LOW)
    assert geometry.wave_depth(scene) == pytest.approx(0.4)
    motion = Simulation(scene, threads=1).movers.piston
    assert motion is geometry.piston_motion(scene)
    assert geometry.piston_path(scene) == motion.excursion
    assert motion.stroke / 2 == pytest.approx(0.0328, abs=1e-4)
    assert any("kd 0.77" in line for line in wave_summary(scene))


def test_the_waves_depth_is_that_at_the_piston():
    blocks = [{"min": [0.0, -0.7], "max": [5.0, -0.2]}, {"min": [5.0, -0.7], "max": [10.0, 0.1]}]
    scene = Scene.model_validate(LOW | {"fluid": {"blocks": blocks}})
    assert geometry.wave_depth(scene) == pytest.approx(0.5)
    assert geometry.fluid_height(scene) == pytest.approx(0.8)
    assert geometry.fluid_volume(scene) == pytest.approx(6.5)
    assert geometry.fluid_depth(scene) == pytest.approx(0.8)


def test_a_changed_table_makes_a_new_piston(tmp_path):
    table = tmp_path / "path.csv"
    table.write_text("time,position\n0,0\n1,0.1\n2,0.0\n")
    scene = Scene.model_validate(LOW | {"waves": {"kind": "table", "file": str(table)}})
    first = geometry.piston_motion(scene)
    table.write_text("time,position\n0,0\n1,0.25\n2,0.0\n")
    assert geometry.piston_motion(scene).excursion[1] > first.excursion[1]


BLOCKS = {  # blocks in a tank from 0 to 1, and the start that they get
    "a column in the corner": ([([0, 0], [0.3, 0.6])], "converged"),
    "a full width": ([([0, 0], [1, 0.4])], "hydrostatic"),
    "a step": ([([0, 0], [0.3, 0.6]), ([0.3, 0], [1, 0.3])], "converged"),
    "side by side": ([([0, 0], [0.3, 0.4]), ([0.3, 0], [1, 0.4])], "hydrostatic"),
    "stacked": ([([0, 0], [1, 0.2]), ([0, 0.2], [0.5, 0.4]), ([0.5, 0.2], [1, 0.4])], "hydrostatic"),
    "a drop over a pool": ([([0, 0], [1, 0.2]), ([0.4, 0.6], [0.6, 0.8])], "converged"),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_water_with_a_free_side_starts_from_a_converged_pressure(name):
    boxes, start = BLOCKS[name]
    fluid = {"blocks": [{"min": low, "max": high} for low, high in boxes]}
    data = {"spacing": 0.02, "duration": 1.0, "tank": {"min": [0, 0], "max": [1, 1]}, "fluid": fluid}
    assert geometry.start(Scene.model_validate(data)) == start
    assert geometry.start(Scene.model_validate(data | {"gravity": 0.0})) == "hydrostatic"
    assert geometry.start(Scene.model_validate(data | {"fluid": fluid | {"start": "zero"}})) == "zero"
    open_end = data | {"tank": data["tank"] | {"walls": ["x-", "z-"]}}
    assert geometry.start(Scene.model_validate(open_end)) == "converged"


def test_water_up_to_the_still_water_level_starts_hydrostatic():
    assert geometry.start(Scene.model_validate(LOW | {"fluid": {}})) == "hydrostatic"
