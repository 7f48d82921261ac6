"""Fields of the particles, from the solver to the timeline, the log and back."""

import numpy as np
import pytest

import fsi
from fsi.errors import SceneError
from fsi.record.fields import CATEGORIES
from fsi.record.timeline_reader import read_snapshots
from fsi.scene.file import load_scene
from fsi.simulation.loop import Simulation

LAYERS = {
    "name": "layers",
    "spacing": 0.05,
    "duration": 0.05,
    "tank": {"min": (0.0, -0.5), "max": (1.0, 0.2)},
    "fluid": {"kinematic_viscosity": 1e-4},
    "liquids": {
        "oil": {"density": 1000.0, "kinematic_viscosity": 1e-3, "blocks": [{"min": (0.0, -0.25), "max": (1.0, 0.0)}]}
    },
}


class Kept:
    """Keeps the last frame of particles."""

    def begin(self, scene, bodies): ...

    def series(self, frame): ...

    def event(self, event): ...

    def particles(self, frame):
        self.frame = frame


def test_liquids_and_viscosities_reach_the_recorders():
    scene = fsi.Scene(**LAYERS, numerics={"turbulence": "smagorinsky"}, output={"particles": 0.05})
    kept = Kept()
    Simulation(scene, recorders=[kept], threads=1).run()
    frame = kept.frame
    assert set(frame.fields) == {"liquid", "viscosity", "eddy_viscosity"}
    assert {name: len(field) for name, field in frame.fields.items()} == dict.fromkeys(frame.fields, 200)
    upper = frame.position[:, 1] > -0.25
    np.testing.assert_array_equal(frame.fields["liquid"], upper)
    least = np.where(upper, 1.0, 0.1)
    assert (frame.fields["viscosity"] >= 0.999 * least).all()
    assert (frame.fields["eddy_viscosity"] >= 0).all()


def test_images_across_a_periodic_boundary_are_not_fields_of_their_own():
    tank = {"min": (0.0, -0.5), "max": (1.0, 0.2), "walls": ("z-",), "periodic": ("x",)}
    scene = fsi.Scene(**LAYERS | {"tank": tank}, output={"particles": 0.05})
    kept = Kept()
    Simulation(scene, recorders=[kept], threads=1).run()
    assert {len(kept.frame.position)} | {len(f) for f in kept.frame.fields.values()} == {200}
    assert (kept.frame.label >= 0).all()


def test_categories_are_drawn_and_read_back(tmp_path):
    pytest.importorskip("rerun")
    scene = fsi.Scene(**LAYERS, output={"fields": ("liquid", "pressure", "viscosity"), "particles": 0.05})
    run = fsi.run(scene, out=tmp_path / "run", quiet=True, threads=1)
    shot = read_snapshots(run.folder / "run.rrd", [0.05])[0]
    assert set(shot.level) == {256, 257} and len(CATEGORIES) > 2
    assert (shot.position[shot.level == 257, 2] > shot.position[shot.level == 256, 2].mean()).all()


@pytest.mark.parametrize("field", ["liquid", "viscosity", "eddy_viscosity"])
def test_field_that_the_scene_does_not_have_is_refused(field):
    with pytest.raises(SceneError, match=f"output.fields: particles of this scene have no field '{field}'; remove it"):
        load_scene("dam_break", [f"output.fields=['{field}']"])
