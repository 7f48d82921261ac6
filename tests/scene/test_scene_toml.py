"""Scene files in and out: overrides, paths, and the resolved scene that gives the same run again."""

import tomllib
from pathlib import Path

import pytest

from fsi.errors import SceneError
from fsi.scene_file import builtin_scenes, load_scene, resolved_toml
from fsi.toml_text import dumps

MODEL = "<mujoco><worldbody/></mujoco>"


@pytest.mark.parametrize(
    "override, value",
    [
        ("spacing=0.05", 0.05),
        ("name=deep-pool", "deep-pool"),
        ('name="pool"', "pool"),
        ("dimension=2", 2),
        ("output.mcap=false", False),
        ("output.colour=speed", "speed"),
        ("tank.max=[8, 0.6]", (8.0, 0.6)),
        ("tank.walls[1]=z+", "z+"),
        ("gauges.near.x=0.25", 0.25),
        ("waves={wave_height=0.1, period=2}", 2.0),
        ("numerics.viscosity=none", "none"),
    ],
)
def test_override_is_typed(scene_file, override, value):
    scene = load_scene(scene_file(), [override])
    key = override.partition("=")[0]
    place = {
        "tank.walls[1]": "scene.tank.walls[1]",
        "waves": "scene.waves.period",
        "gauges.near.x": "scene.gauges['near'].x",
    }
    assert eval(place.get(key, f"scene.{key}")) == value


def test_empty_override_restores_the_default(scene_file):
    path = scene_file("[numerics]\nsweeps = 8\n[waves]\nwave_height = 0.1\nperiod = 2")
    scene = load_scene(path, ["numerics.sweeps=", "waves="])
    assert scene.numerics.sweeps == 4
    assert scene.waves is None


@pytest.mark.parametrize("override", ["spacing", "=3", "spacing.fine=2", "tank.min[7]=1"])
def test_override_that_fits_nowhere(scene_file, override):
    with pytest.raises(SceneError, match="^--set: "):
        load_scene(scene_file(), [override])


def test_override_with_a_fault_names_its_key(scene_file):
    with pytest.raises(SceneError, match="pool.toml: output.serie: unknown key; did you mean series?"):
        load_scene(scene_file(), ["output.serie=1"])


def test_resolved_scene_loads_as_the_same_scene(scene_file, tmp_path):
    (tmp_path / "flap.xml").write_text(MODEL)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/motion.csv").write_text("t,x\n0,0\n1,0.1\n2,0\n")
    scene = load_scene(
        scene_file(
            """
            [fluid]
            blocks = [{min = [0.0, -0.5], max = [1.0, 0.0], velocity = [0.1, 0.0]}]
            [gauges."near the wall"]
            x = 0.5
            [[damping]]
            start = 4.0
            end = 6.0
            [waves]
            kind = "table"
            file = "sub/motion.csv"
            [bodies.flap]
            mjcf = "flap.xml"
            [coupler]
            scheme = "prescribed"
            motion.hinge = {amplitude = 0.1, omega = 2.0}
            motion.heave = {file = "sub/motion.csv"}
            """
        )
    )
    text = resolved_toml(scene)
    elsewhere = tmp_path / "sub" / "resolved.toml"
    elsewhere.write_text(text)
    assert load_scene(elsewhere) == scene
    assert scene.waves.file == tmp_path / "sub/motion.csv"
    for default in (
        "smoothing_ratio = 1.5",
        "kinematic_viscosity = 1e-06",
        "# max_time_step is not set",
        "width = 1.0",
    ):
        assert default in text


def test_toml_text_round_trip():
    table = {
        "text": 'a "quoted" \\ line\nbreak\ttab é',
        "numbers": [1, 2.5, 1e-300, -0.0],
        "nested": {"empty": {}, "list": [], "deep key!": {"flag": True}},
        "tables": [{"a": 1, "b": {"c": [[1, 2], [3]]}}, {"a": 2}],
    }
    assert tomllib.loads(dumps(table)) == table
    assert tomllib.loads(dumps({"nothing": None, "a": 1})) == {"a": 1}


def test_paths_of_packages_and_home(scene_file):
    import bodies

    path = scene_file(
        '[tank]\nmin = [0, -0.5]\nmax = [6, 0.5]\nbathymetry = "package://bodies/__init__.py"',
        instead="""
        spacing = 0.02
        duration = 1.0
    """,
    )
    assert load_scene(path).tank.bathymetry == Path(bodies.__file__)


@pytest.mark.parametrize("name", builtin_scenes())
def test_builtin_scene_is_sound(name):
    scene = load_scene(name)
    assert scene.name == name
    assert scene.description
    assert load_scene(scene) == scene
