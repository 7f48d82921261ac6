"""A package of someone else adds a wave kind, an output field, a coupler, a validation case, a command and a scene, without an
edit of ours; and one that is broken is named."""

import json
import os
import subprocess
import sys
from textwrap import dedent

import pytest
from typer.testing import CliRunner

from fsi.command import app

pytest.importorskip("mujoco")

KIND = '''
    import math
    from typing import Literal

    from fsi.parts import Positive
    from fsi.waves.kind import WaveKind


    class Push:
        """Half a turn of a cosine."""

        def __init__(self, stroke, time):
            self.excursion, self.end = (0.0, stroke), time

        def __call__(self, t):
            if t >= self.end:
                return self.excursion[1], 0.0, 0.0
            w, half = math.pi / self.end, 0.5 * self.excursion[1]
            return half * (1 - math.cos(w * t)), half * w * math.sin(w * t), half * w * w * math.cos(w * t)


    class Waves(WaveKind):
        """One push."""

        kind: Literal["push"]
        stroke: Positive

        def piston(self, depth, g):
            return Push(self.stroke, 0.5)

        def faults(self, water):
            if self.stroke > water.depth:
                yield "waves.stroke", f"{self.stroke:g} m is more than the depth", "push less"
'''
FIELD = """
    import numpy as np

    from fsi.scene.fields import ParticleField

    HEAD = ParticleField("m", lambda frame: 0.05 * (frame.velocity**2).sum(1), lambda scene, depth: depth)
"""
COUPLER = '''
    from typing import Literal

    import numpy as np

    from fsi.parts import Positive
    from fsi.scene.coupler import CouplerSettings


    class HeldSettings(CouplerSettings):
        """Bodies that stay."""

        scheme: Literal["held"] = "held"
        firmness: Positive = 1.0

        def make(self, bodies, source="scene.toml"):
            return Held(self.firmness)

        def faults(self, scene):
            if self.firmness > 5:
                yield "coupler.firmness", f"{self.firmness:g} is too firm", "use less"


    class Held:
        advice, notes = "", ("held: the bodies stay",)

        def __init__(self, firmness):
            self.firmness = firmness

        def step(self, fluid, bodies, time, dt):
            return fluid.pressure(np.zeros_like(bodies.motion().bias))

        def mass_ratio(self, bodies):
            return None
'''
CASE = """
    from cases.validation.engine.case import Case, Measure
    from cases.validation.engine.scenes import builder, spacings


    class Stays(Measure):
        def begin(self, sim):
            self.sim, self.start = sim, sim.bodies.motion().position[0, 2]

        def errors(self):
            return {"height": self.sim.bodies.motion().position[0, 2] / self.start - 1}


    CASES = {"pond_held": Case("pond_held", "A box is held", "Exact: it stays.", spacings("pond"), builder("pond"), Stays,
                               {"height": 1e-12})}
"""
COMMAND = '''
    from typing import Annotated

    import typer

    from fsi.errors import SceneError


    def greet(name: Annotated[str, typer.Argument(help="Of whom.")], loud: bool = False) -> None:
        """Say hello to someone."""
        if name == "nobody":
            raise SceneError("nobody is there", fix="greet someone")
        print(f"HELLO {name}" if loud else f"hello {name}")
'''
SCENE = """
    description = "2D: a push of the piston passes a box that is held"
    spacing = 0.04
    duration = 0.02
    [tank]
    min = [0.0, -0.4]
    max = [2.0, 0.4]
    width = 0.3
    [waves]
    kind = "push"
    stroke = 0.1
    [bodies.box]
    mjcf = "package://bodies/models/floating_box.xml"
    position = [1.2, 0.0, 0.05]
    [coupler]
    scheme = "held"
    firmness = 2.0
    [output]
    series = 0.005
    particles = 0.01
    fields = ["head", "speed"]
    cloud = true
"""
ENTRIES = """
    [spindrift.waves]
    push = elsewhere.push:Waves
    [spindrift.fields]
    head = elsewhere.head:HEAD
    [spindrift.couplers]
    held = elsewhere.held:HeldSettings
    [spindrift.cases]
    pond_held = elsewhere.pond_held
    [spindrift.commands]
    greet = elsewhere.greet:greet
    broken = elsewhere.broken:broken
    lost = nowhere.at_all:lost
    [spindrift.scenes]
    elsewhere = elsewhere.scenes
"""
FILES = {
    "elsewhere/__init__.py": "",
    "elsewhere/push.py": KIND,
    "elsewhere/head.py": FIELD,
    "elsewhere/held.py": COUPLER,
    "elsewhere/pond_held.py": CASE,
    "elsewhere/greet.py": COMMAND,
    "elsewhere/broken.py": 'import not_there\n\n\ndef broken():\n    """Cannot be imported."""\n',
    "elsewhere/scenes/pond.toml": SCENE,
    "elsewhere-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n",
    "elsewhere-1.0.dist-info/entry_points.txt": ENTRIES,
}


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """The folder of an installed package that is not ours."""
    folder = tmp_path_factory.mktemp("site")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(dedent(text))
    return folder


@pytest.fixture
def fsi(elsewhere, tmp_path, monkeypatch):
    """Run `fsi` where that package is installed: in this process, or in one of its own."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments, code=0, alone=False):
        if alone:
            path = os.pathsep.join([str(elsewhere), *filter(None, [os.environ.get("PYTHONPATH")])])
            command = [sys.executable, "-m", "fsi", *arguments]
            environment = os.environ | {"PYTHONPATH": path}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
            found, said = done.returncode, done.stdout + done.stderr
        else:
            monkeypatch.syspath_prepend(str(elsewhere))
            wide = {"COLUMNS": "200", "TERMINAL_WIDTH": "200"}
            done = CliRunner().invoke(app, arguments, env=wide)
            found, said = done.exit_code, done.output
        assert found == code, said
        return said

    return run


def test_a_scene_with_all_of_them_runs(fsi, tmp_path):
    pytest.importorskip("rerun")
    out = json.loads(
        fsi("run", "pond", "--out", "out", "--threads", "1", "--quiet", "--json", alone=True).splitlines()[0]
    )
    assert (
        out["status"] == "done" and out["coupling"]["scheme"] == "held" and "held: the bodies stay" in out["warnings"]
    )
    text = (tmp_path / "out" / "scene.toml").read_text()
    assert all(line in text for line in ('kind = "push"', "firmness = 2.0", 'fields = ["head", "speed"]'))
    assert b"head" in (tmp_path / "out" / "run.mcap").read_bytes()
    assert (tmp_path / "out" / "run.rrd").stat().st_size > 0


def test_its_faults_are_told(fsi):
    told = fsi("check", "pond", "--set", "waves.stroke=0.5", "--set", "coupler.firmness=9", code=2)
    assert "pond.toml: waves.stroke: 0.5 m is more than the depth; push less" in told
    assert "pond.toml: coupler.firmness: 9 is too firm; use less" in told
    assert (
        "one of focused, irregular, measured, nonlinear, packet, regular, shallow, solitary, spectrum, table, push"
        in fsi("check", "pond", "--set", "waves.kind=pull", code=2)
    )
    assert "liquid, head; did you mean head?" in fsi("check", "pond", "--set", 'output.fields=["heat"]', code=2)
    assert "it belongs to kind = 'push'" in fsi(
        "check", "flap", "--set", "waves.stroke=1", code=2
    )  # a key of another's kind in a scene of ours


def test_its_case_is_validated(fsi, tmp_path):
    told = fsi("validate", "pond_held", "--out", "rows", "--threads", "1", "--quiet", "--json", alone=True)
    assert json.loads(told.splitlines()[-1])[0]["passed"]
    assert "[pond_held](elsewhere/pond_held.py)" in (tmp_path / "rows" / "VALIDATION.md").read_text()


def test_its_command_is_listed_and_runs(fsi):
    assert "pond" in fsi("cases")
    told = fsi("--help")
    for line in ("greet     Say hello to someone.", "broken    Cannot be imported.", "From the package elsewhere."):
        assert line in told
    assert fsi("greet", "Ada", "--loud") == "HELLO Ada\n"
    assert fsi("greet", "nobody", code=2) == "nobody is there; greet someone\n"
    assert "Of whom." in fsi("greet", "--help")


def test_a_broken_package_is_named(fsi):
    told = fsi("broken", code=2)
    assert told.startswith(
        "the command 'broken' of the package 'elsewhere' (elsewhere.broken:broken) cannot be loaded: "
    )
    assert told.endswith("No module named 'not_there'; repair or uninstall elsewhere\n")
    assert "No module named 'nowhere'" in fsi("lost", code=2)


def test_two_packages_with_one_name_are_refused(tmp_path, monkeypatch):
    from fsi import plugins
    from fsi.errors import SceneError

    for package in ("one", "two"):
        info = tmp_path / f"{package}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[spindrift.couplers]\nsame = {package}:Settings\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(
        SceneError, match=r"several packages bring the coupler 'same': (one, two|two, one); uninstall all but"
    ):
        plugins.find("couplers", "same")
    with pytest.raises(SceneError, match="no package brings the coupler 'none'; known are added_mass, fixed_point"):
        plugins.find("couplers", "none")


def test_a_name_of_ours_is_told_and_not_passed_over(tmp_path, monkeypatch):
    from fsi.errors import SceneError
    from fsi.scene.fields import field_of
    from fsi.waves import load_kind

    info = tmp_path / "again-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: again\nVersion: 1.0\n")
    groups = {"waves": "regular", "fields": "pressure", "commands": "run"}
    text = "\n".join(f"[spindrift.{group}]\n{name} = again:thing" for group, name in groups.items())
    (info / "entry_points.txt").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    for find, name in ((load_kind, "regular"), (field_of, "pressure")):
        with pytest.raises(SceneError, match=f"'{name}' is one of ours, and again brings another by that name; rename"):
            find(name)
    told = CliRunner().invoke(app, ["run", "flap"])
    assert told.exit_code == 2 and "the command 'run' is one of ours, and again brings another" in told.output


@pytest.mark.parametrize(
    "name, command", [("bodies", ["check", "flap"]), ("bodies", ["check", "own.toml"]), ("cases", ["report", "x"])]
)
def test_a_folder_by_the_name_of_a_package_of_ours_is_named(tmp_path, name, command):
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").touch()
    (tmp_path / "own.toml").write_text(
        'spacing = 0.1\nduration = 1\ntank = {min = [0, -1], max = [3, 1]}\nbodies.b.mjcf = "b.xml"\n'
    )
    (tmp_path / "b.xml").write_text("<mujoco/>")
    done = subprocess.run(
        [sys.executable, "-m", "fsi", *command], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert f"{tmp_path / name} hides Spindrift's package {name!r}: rename it" in done.stderr
