"""Scene files in and out: overrides, paths, and the resolved scene that gives the same run again."""

import tomllib
from pathlib import Path

import pytest

from fsi.errors import SceneError
from fsi.scene.file import builtin_scenes, load_scene, resolved_toml, scene_levels
from fsi.scene.numerics import Numerics
from fsi.scene.toml import dumps

MODEL = "<mujoco><worldbody/></mujoco>"


OVERRIDES = {
    "spacing=0.05": lambda scene: scene.spacing == 0.05,
    "name=deep-pool": lambda scene: scene.name == "deep-pool",
    'name="deep.pool"': lambda scene: scene.name == "deep.pool",
    "output.mcap=false": lambda scene: scene.output.mcap is False,
    "output.fields = ['speed']": lambda scene: scene.output.fields == ("speed",),
    "tank.max=[8, 0.6]": lambda scene: scene.tank.max == (8.0, 0.6),
    "tank.max[1]=0.6": lambda scene: scene.tank.max == (6.0, 0.6),
    "gauges.near.x=0.25": lambda scene: scene.gauges["near"].x == 0.25,
    'gauges."no. 1".x=0.25': lambda scene: scene.gauges["no. 1"].x == 0.25,
    "waves={wave_height=0.1, period=2}": lambda scene: scene.waves.period == 2.0,
    "numerics.viscosity=none": lambda scene: scene.numerics.viscosity == "none",
}


@pytest.mark.parametrize("override, holds", OVERRIDES.items(), ids=OVERRIDES)
def test_override_is_typed(scene_file, override, holds):
    assert not holds(
        load_scene(scene_file(), ["gauges.near.x=0.5", 'gauges."no. 1".x=1', "waves={wave_height=1, period=1}"])
    )
    assert holds(load_scene(scene_file(), [override]))


def test_empty_override_restores_the_default(scene_file):
    path = scene_file("[numerics]\nsweeps = 8\n[waves]\nwave_height = 0.1\nperiod = 2")
    scene = load_scene(path, ["numerics.sweeps=", "waves="])
    assert scene.numerics.sweeps == type(scene.numerics)().sweeps != 8
    assert scene.waves is None


@pytest.mark.parametrize(
    "override", ["spacing", "=3", "spacing.fine=2", "tank.min[7]=1", "tank.walls[0]=z+", "tank.min.x=0"]
)
def test_override_that_fits_nowhere(scene_file, override):
    with pytest.raises(SceneError, match=r"^--set: "):
        load_scene(scene_file(), [override])


def test_override_with_a_fault_names_its_key(scene_file):
    with pytest.raises(SceneError, match=r"pool.toml: output.serie: unknown key; did you mean series\?"):
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
        "smoothing_ratio = 2.0",
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


def test_a_level_changes_the_scene_before_the_overrides(tmp_path):
    file = tmp_path / "tank.toml"
    file.write_text(
        "spacing = 0.1\nduration = 1.0\n[tank]\nmin = [0.0, -1.0]\nmax = [2.0, 1.0]\n"
        '[levels.paper]\nspacing = 0.05\n"tank.max" = [4.0, 1.0]\n'
    )
    assert load_scene(file).spacing == 0.1
    assert load_scene(file, level="paper").spacing == 0.05
    assert load_scene(file, level="paper").tank.max == (4.0, 1.0)
    assert load_scene(file, ["spacing=0.2"], level="paper").spacing == 0.2
    assert scene_levels(file) == {"paper": {"spacing": 0.05, "tank.max": [4.0, 1.0]}}
    with pytest.raises(SceneError, match=r"tank.toml: --level: no level 'fine'; choose from paper"):
        load_scene(file, level="fine")


def test_accuracy_sets_defaults_and_gives_way_to_what_is_given():
    draft = Numerics(accuracy="draft")
    assert (draft.smoothing_ratio, draft.mach, draft.courant) == (1.5, 0.3, 0.2)
    fine = Numerics.model_validate({"accuracy": "fine", "mach": 0.15})
    assert (fine.mach, fine.courant, fine.smoothing_ratio) == (0.15, 0.1, 2.0)
    with pytest.raises(ValueError, match="accuracy"):
        Numerics(accuracy="good")


def test_of_two_scenes_of_one_name_it_is_said_which_is_meant(tmp_path, monkeypatch):
    from fsi import plugins
    from fsi.scene.file import namesakes

    monkeypatch.chdir(tmp_path)
    assert namesakes("tank_still") == []
    (tmp_path / "tank_still.toml").write_text("spacing = 1\n")
    (told,) = namesakes("tank_still")
    assert "tank_still is the built-in scene" in told and told.endswith("name it tank_still.toml to run it")
    assert namesakes("tank_still.toml") == []
    ours = plugins.folders("scenes")
    monkeypatch.setattr(plugins, "folders", lambda group: [*ours, tmp_path])
    with pytest.raises(SceneError, match=r"tank_still: several packages bring a scene by that name: .*; give the path"):
        load_scene("tank_still")
    assert builtin_scenes()["tank_still"].parent != tmp_path
