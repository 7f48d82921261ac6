from pathlib import Path

import pytest

from fsi.scene.file import load_scene
from fsi.trust import trusting

TANK = """
spacing = 0.1
duration = 0.2
[tank]
min = [0.0, -0.5]
max = [1.0, 0.5]
[gauges.middle]
x = 0.5
"""

STUDY = """
scene = "tank.toml"
[parameters.width]
key = "tank.max[0]"
values = [1.0, 1.2, 1.4]
units = "m"
"""


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    """An empty working directory with a small tank and a study of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tank.toml").write_text(TANK)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


@pytest.fixture
def flap_scene():
    return load_scene(Path(__file__).parents[2] / "examples/studies/flap_tank.toml")


@pytest.fixture
def trusted():
    """Code that a study or a scene names may run."""
    with trusting():
        yield
