"""A scene or a study from someone else: no code of it runs before the user says so, and no file is read unnoticed."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import fsi
from cases.study.engine import sweep
from fsi import trust
from fsi.command import app
from fsi.errors import SceneError

FLAP = """
spacing = 0.1
duration = 0.02
[tank]
min = [0.0, -0.7]
max = [3.0, 0.3]
[bodies.flap]
mjcf = "package://bodies/models/surge_flap.xml"
position = [1.5, 0.0, 0.0]
pto = {kind = "python", function = "mine.py:brake"}
"""
TANK = "spacing = 0.1\nduration = 0.05\n[tank]\nmin = [0.0, -0.5]\nmax = [1.0, 0.5]\n"
CODE = "from pathlib import Path\nPath(__file__).with_name('ran').touch()\n"


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    """A folder with a scene that names code, which leaves a file `ran` where it runs; the user has no configuration."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(trust, "config_file", lambda: tmp_path / "config.toml")
    (tmp_path / "flap.toml").write_text(FLAP)
    (tmp_path / "mine.py").write_text(CODE + "def brake(t, x, v):\n    return -v\n")
    (tmp_path / "tank.toml").write_text(TANK)
    (tmp_path / "study.toml").write_text('scene = "tank.toml"\nscript = "make.py"\n')
    (tmp_path / "make.py").write_text(CODE + "def build(folder):\n    return {'tank.max[0]': 1.2}\n")
    return tmp_path


def command(*words):
    return CliRunner().invoke(app, list(words))


def test_a_check_runs_no_code(here):
    for words in (("check", "flap.toml"), ("check", "flap.toml", "--json"), ("check", "flap.toml", "--measure", "1")):
        result = command(*words)
        assert result.exit_code == 0, result.output
        assert "mine.py:brake is not run by a check" in result.stderr + result.stdout
    assert not (here / "ran").exists()


@pytest.mark.parametrize("words", [("run", "flap.toml"), ("sweep", "study.toml", "--workers", "0")])
def test_code_is_refused_with_the_way_out(here, words):
    result = command(*words)
    assert result.exit_code == 2 and not (here / "ran").exists()
    key, file = {"run": ("bodies.flap.pto.function", "mine.py"), "sweep": ("script", "make.py")}[words[0]]
    for part in (f"{key}: names code to run, {file}", "--trust", "trust=True", str(here / "config.toml")):
        assert part in result.stderr
    assert not (here / "runs").exists() and not list(here.glob("studies/study/runs/*"))


def test_every_python_door_is_shut(here):
    scene = fsi.load_scene("flap.toml")
    for door in (fsi.run, fsi.open, fsi.Simulation, sweep):
        with pytest.raises(SceneError, match=r"names code to run"):
            door("study.toml" if door is sweep else scene)
    assert not (here / "ran").exists()


def test_trust_lets_it_run_and_a_resumed_run_asks_again(here):
    assert command("sweep", "study.toml", "--workers", "0", "--trust", "--quiet").exit_code == 0
    assert (here / "ran").exists()
    (here / "ran").unlink()
    result = command("run", "flap.toml", "--trust", "--quiet", "--out", "night", "--set", "output.checkpoint=1e-6",
                     "--set", "output.timeline=false", "--threads", "1")  # fmt: skip
    assert result.exit_code == 0 and (here / "ran").exists(), result.output
    (here / "ran").unlink()
    with pytest.raises(SceneError, match=r"names code to run, mine.py"):
        fsi.resume("night", until=0.03)
    assert not (here / "ran").exists() and json.loads((here / "night/run.json").read_text())["status"] == "done"
    assert fsi.resume("night", until=0.03, trust=True, quiet=True).status == "done"


def test_the_users_configuration_lists_folders(here):
    for text, fault in (
        ("trust = [", "config.toml: cannot be read"),
        ("trust = 3", "config.toml: trust: is neither true nor a list"),
        ('trust = ["scenes"]', "config.toml: trust: 'scenes' is relative to no folder"),
        ("trust = false", "names code to run"),
        ('trust = ["/elsewhere"]', "names code to run"),
    ):
        (here / "config.toml").write_text(text)
        with pytest.raises(SceneError) as error:
            trust.may_run(here / "mine.py", "key", "scene.toml")
        assert fault in str(error.value)
    for text in ("trust = true", f"trust = ['/elsewhere', '{here}']"):
        (here / "config.toml").write_text(text)
        assert trust.may_run(here / "mine.py", "key", "scene.toml")


def test_files_outside_the_scenes_folder_are_named(here, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    (other / "part.xml").write_text('<mujoco><asset><texture type="2d" file="pic.png"/></asset></mujoco>')
    (other / "waves.csv").write_text("time,position\n0,0\n0.1,0.001\n0.2,0\n")
    (here / "box.xml").write_text(
        f'<mujoco><include file="{other}/part.xml"/><worldbody><body><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
        "</worldbody></mujoco>"
    )
    from bodies.assets import assets
    from fsi.scene.paths import outside_notes

    assert set(assets(here / "box.xml")) == {other / "part.xml", here / "pic.png"}
    waves = f'[waves]\nkind = "table"\nfile = "{other}/waves.csv"\n'
    bodies = '[bodies.box]\nmjcf = "box.xml"\n[bodies.flap]\nmjcf = "package://bodies/models/surge_flap.xml"\n'
    (here / "scene.toml").write_text(TANK + waves + bodies)
    scene = fsi.load_scene("scene.toml")
    assert outside_notes(scene, here, assets(here / "box.xml")) == [
        f"waves.file: {other}/waves.csv lies outside the scene's folder, {here}",
        f"bodies: {other}/part.xml lies outside the scene's folder, {here}",
    ]
    (here / "outside.toml").write_text(TANK + waves)
    said = f"waves.file: {other}/waves.csv lies outside the scene's folder"
    assert said in command("check", "outside.toml").stderr


def test_files_without_end_are_refused(here, monkeypatch):
    from bodies import reading
    from bodies.shapes import meshes
    from fsi.scene.model import BodyFile

    mesh = '<mujoco><asset><mesh name="m" file="{}"/></asset><worldbody/></mujoco>'
    (here / "hull.stl").write_bytes(bytes(1000))
    (here / "hull.zip").write_bytes(bytes(10))
    monkeypatch.setattr(reading, "MOST_BYTES", 999)
    monkeypatch.setattr(meshes, "MOST_BYTES", 999)
    for file, fault in (("/dev/zero", "/dev/zero: is no file"), ("hull.stl", "more than the 0 MB that are read")):
        (here / "mesh.xml").write_text(mesh.format(file))
        with pytest.raises(SceneError, match=fault):
            reading.read(BodyFile(mjcf=here / "mesh.xml"), 9.81, "key", "scene.toml", [])
    for file, fault in (("hull.stl", "more than the 0 MB"), ("hull.zip", "'.zip' is no mesh format")):
        with pytest.raises(SceneError, match=fault):
            meshes.mesh_solid(here / file, 2)


def test_every_file_is_measured_before_it_is_read(here, monkeypatch):
    """Also one that a file includes, and one that is cut into rows or parsed as code."""
    from bodies import rasters, sizes
    from bodies.sizes import check_file
    from cases.study.study_file import load_study
    from fsi import tables, user_code
    from fsi.scene import file as scenes
    from fsi.waves.kinds import spectrum

    long = here / "long"
    long.write_text("<mujoco>" + " " * 2000 + "</mujoco>")
    (here / "outer.xml").write_text('<mujoco><worldbody/><include file="long"/></mujoco>')
    for module in (rasters, sizes, tables, user_code, scenes, spectrum):
        monkeypatch.setattr(module, "MOST_BYTES", 1000)
    (here / "long.xyz").write_bytes(long.read_bytes())
    readers = (
        lambda: check_file(long),
        lambda: check_file(here / "outer.xml"),
        lambda: rasters.read(here / "long.xyz", None, 1.0),
        lambda: tables.read_table(long, ("t", "x"), 3),
        lambda: user_code.load(f"{long}:law", "control", "scene.toml"),
        lambda: scenes.load_scene(long),
        lambda: load_study(long),
    )
    for read in readers:
        with pytest.raises(SceneError, match=r"long(.xyz)?: 0 MB, more than the 0 MB"):
            read()
    pytest.importorskip("wavespectra")
    sea = spectrum.Waves(kind="spectrum", file=long, format="swan")
    assert "0 MB, more than" in next(sea.faults(None))[1]


def test_copies_of_what_a_file_includes_are_counted(here):
    from bodies.sizes import check_file

    (here / "inner.xml").write_text("<mujoco>" + "<geom/>" * 30 + "</mujoco>")
    (here / "outer.xml").write_text('<mujoco><replicate count="999"><include file="inner.xml"/></replicate></mujoco>')
    with pytest.raises(SceneError, match="more than 20000 elements, copies counted"):
        check_file(here / "outer.xml")


def test_a_study_that_is_no_toml_is_refused(here):
    from cases.study.study_file import load_study

    for text, fault in (("a = " + "9" * 5000, "not TOML"), ("a = " + "[" * 100_000, "nested too deeply")):
        (here / "study.toml").write_text(text)
        with pytest.raises(SceneError, match=fault):
            load_study("study.toml")


def test_a_forged_checkpoint_is_refused(here):
    """One whose checksum is right and whose contents are not: too large, of objects, too deep, not what it says."""
    import hashlib

    from fsi.simulation import checkpoint

    def forge(header: bytes) -> bytes:
        rest = len(header).to_bytes(8, "little") + header
        return checkpoint.MAGIC + hashlib.sha256(rest).digest() + rest

    file = here / "1.checkpoint"
    for state in (b'{"":["<f8",[1000000000000],0,""]}', b'{"":["O",[1],0,""]}', b'{"":["f8,O",[1],0,""]}', b'{"":[1,2]}',
                  b'{"":["<f8",[-1],0,""]}', b"[" * 100_000, b'{"":["<f8","x",0,""]}'):  # fmt: skip
        file.write_bytes(forge(b'{"facts": {}, "state": ' + state + b"}"))
        with pytest.raises(SceneError):
            checkpoint.read(file)
    file.write_bytes(checkpoint.MAGIC + hashlib.sha256(b"").digest())
    with pytest.raises(SceneError, match="header"):
        checkpoint.read(file)
