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
