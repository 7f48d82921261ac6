import pytest

from bodies import load
from fsi.scene.model import BodyFile, Scene, Tank

BOX = '<body name="box"><freejoint/><geom name="hull" type="box" size="0.2 0.1 0.1" density="500"/></body>'


@pytest.fixture
def make_bodies(tmp_path):
    """MJCF of a world (and what stands before it) to a loaded BodySet in a tank of 4 m around the origin."""

    def make(world=BOX, *, head="", dimension=3, spacing=0.02, position=(0, 0, 0), option='timestep="0.01"', **scene):
        path = tmp_path / "body.xml"
        path.write_text(f"<mujoco>{head}<option {option}/><worldbody>{world}</worldbody></mujoco>")
        tank = Tank(min=(-2,) * dimension, max=(2,) * dimension)
        file = BodyFile(mjcf=path, position=position)
        settings = {"tank": tank, "bodies": {"body": file}} | scene
        return load(Scene(spacing=spacing, duration=1, dimension=dimension, **settings), "test.toml")

    return make
