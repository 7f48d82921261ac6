"""The JSON schema of a scene, and the templates of `fsi new`."""

import json

import pytest
from typer.testing import CliRunner

from fsi.command import app
from fsi.scene.schema import descriptions, scene_schema
from fsi.waves.kinds.regular import Waves

KINDS = ["coast", "flap", "float", "flume"]


def call(*words):
    return CliRunner().invoke(app, [*map(str, words)])


def test_descriptions_are_the_comments_behind_the_keys():
    said = descriptions(Waves)
    assert said["wave_height"] == "crest to trough [m]"
    assert said["absorb"].startswith("the piston also gives way")  # of the model that it extends


def test_the_schema_knows_parts_kinds_and_levels():
    schema = scene_schema()
    assert {"tank", "waves", "bodies", "numerics", "levels"} <= set(schema["properties"])
    assert schema["properties"]["spacing"]["description"] == "particle spacing dr [m]"
    kinds = [part["properties"]["kind"]["const"] for part in schema["properties"]["waves"]["anyOf"][0]["oneOf"]]
    assert {"regular", "irregular", "solitary", "packet", "table"} <= set(kinds)
    assert json.loads(call("schema").output) == schema


def test_the_schema_tells_scenes_from_others():
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(scene_schema())
    scene = {"spacing": 0.1, "duration": 1.0, "tank": {"min": [0, -1], "max": [1, 1]}}
    assert validator.is_valid(scene | {"waves": {"kind": "regular", "wave_height": 0.1, "period": 1.5}})
    assert not validator.is_valid(scene | {"spacing": -1})
    assert not validator.is_valid(scene | {"tanks": {}})


@pytest.mark.parametrize("kind", KINDS)
def test_a_template_is_a_scene_that_checks(kind, tmp_path):
    pytest.importorskip("mujoco")
    made = call("new", kind, "--out", tmp_path / kind)
    assert made.exit_code == 0, made.output
    scene = tmp_path / kind / f"{kind}.toml"
    assert made.output.splitlines()[0] == str(scene)
    checked = call("check", scene)
    assert checked.exit_code == 0, checked.output
    before = scene.read_bytes()
    again = call("new", kind, "--out", tmp_path / kind)
    assert again.exit_code == 2 and "there already" in again.output and scene.read_bytes() == before


def test_an_unknown_template_is_refused(tmp_path):
    refused = call("new", "boat", "--out", tmp_path / "boat")
    assert refused.exit_code == 2 and "choose from coast, flap, float, flume" in refused.output
    assert not (tmp_path / "boat").exists()


def test_help_keeps_units_in_brackets():
    told = call("run", "--help").output
    assert "[s]" in told and "[levels.NAME]" in told
