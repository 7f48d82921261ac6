"""Every case of the source documents runs at desktop resolution to its end: nothing lost, all finite, no alarm.

`SPINDRIFT_SLOW=1 pytest tests/validation/test_desktop_runs.py` is the one command for all of them, a quarter of an hour on two
cores."""

import numpy as np
import pytest

from fsi.scene.binding import bind
from fsi.scene.file import builtin_scenes, load_scene, scene_levels
from fsi.simulation.loop import Simulation

CASES = [name for name in builtin_scenes() if "paper" in scene_levels(name)]
ALARMS = "did not settle", "through the tank's", "unstable", "not finite"


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_desktop_run_ends_whole(name):
    scene = load_scene(name)
    bodies, coupler, ground = bind(scene, name)
    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground)
    try:
        sim.run()
    finally:
        sim.team.close()
    fluid = sim.fluid
    assert sim.time == pytest.approx(scene.duration)
    assert fluid.lost == 0
    assert np.isfinite(fluid.position).all() and np.isfinite(fluid.velocity).all()
    assert np.isfinite(fluid.pressure_values).all()
    assert not [line for line in sim.warnings if any(alarm in line for alarm in ALARMS)]
