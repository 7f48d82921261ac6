"""From a point of a study to a scene: keys of the scene, of MJCF elements, of a script; and the hash of it."""

from xml.etree import ElementTree

import pytest

from cases.study import mjcf_edit
from cases.study.design import design, digest
from cases.study.plan import Parameter, Study
from fsi.errors import SceneError
from fsi.scene.file import load_scene

HINGE = "bodies.flap.mjcf.joint.hinge.damping"


def study(here, scene="tank.toml", **keys):
    parameters = {name: Parameter(key=key, values=(1,)) for name, key in keys.items()}
    return Study(scene=str(here / scene) if scene.endswith(".toml") else scene, parameters=parameters)


def test_keys_of_the_scene_are_set_and_name_the_run(here):
    made = design(study(here, width="tank.max[0]"), {"width": 1.5}, here / "runs")
    assert made.scene.tank.max == (1.5, 0.5) and not made.scene.output.timeline
    assert made.folder == here / "runs" / digest(made.scene) and not made.folder.exists()
    other = design(study(here, width="tank.max[0]"), {"width": 1.6}, here / "runs")
    same = design(study(here, width="tank.max[0]"), {"width": 1.5}, here / "elsewhere")
    assert other.hash != made.hash == same.hash


def test_set_takes_lists_and_tables_and_takes_keys_out(here):
    zones = [{"start": 0.6, "end": 1.0, "rate": 5.0}]
    made = design(Study(scene=str(here / "tank.toml"), set={"damping": zones, "gauges": ""}), {}, here / "runs")
    assert made.scene.damping[0].end == 1.0 and made.scene.gauges == {}


def test_an_attribute_of_an_mjcf_element_is_set_in_a_file_of_the_run(here):
    made = design(study(here, "flap", damping=HINGE), {"damping": 7.5}, here / "runs")
    file = made.scene.bodies["flap"].mjcf
    assert file == made.folder / "inputs" / "flap.xml"
    assert ElementTree.parse(file).find(".//joint").get("damping") == "7.5"
    assert not list((here / "runs").glob(".staging-*"))
    again = design(study(here, "flap", damping=HINGE), {"damping": 7.5}, here / "other")
    assert again.hash == made.hash and again.folder != made.folder
    assert design(study(here, "flap", damping=HINGE), {"damping": 8.0}, here / "runs").hash != made.hash


def test_the_hash_sees_the_contents_of_files_not_where_they_are(here):
    text = '<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody/></mujoco>'
    hashes = []
    for folder, mesh in (("a", "v 0 0 0"), ("b", "v 0 0 0"), ("c", "v 0 0 1")):
        (here / folder).mkdir()
        (here / folder / "body.xml").write_text(text)
        (here / folder / "m.obj").write_text(mesh)
        scene = load_scene("tank.toml", [f"bodies.x.mjcf={here / folder / 'body.xml'}"])
        hashes.append(digest(scene))
    assert hashes[0] == hashes[1] != hashes[2]


def test_a_script_makes_geometry(here, trusted):
    (here / "make.py").write_text(
        "def build(folder, height):\n"
        '    body = f\'<body name="b" pos="0 0 {height}"/>\'\n'
        "    (folder / 'flap.xml').write_text(f'<mujoco><worldbody>{body}</worldbody></mujoco>')\n"
        "    return {'bodies.b.mjcf': folder / 'flap.xml', 'tank.max[0]': 2 + height}\n"
    )
    made = design(
        Study(scene=str(here / "tank.toml"), script=here / "make.py",
              parameters={"h": Parameter(key="script.height", values=(1,))}),
        {"h": 0.5}, here / "runs",
    )  # fmt: skip
    assert 'pos="0 0 0.5"' in made.scene.bodies["b"].mjcf.read_text()
    assert made.scene.bodies["b"].mjcf.parent == made.folder / "inputs" and made.scene.tank.max[0] == 2.5


@pytest.mark.parametrize(
    "key, fault",
    [
        ("bodies.flap.mjcf.joint.hing.damping", "no element 'joint.hing'; did you mean joint.hinge?"),
        ("bodies.flap.mjcf.flap.density", "'flap' is a body and a geom; say which: body.flap.ATTRIBUTE"),
        ("bodies.flap.mjcf.geom.flap.size[3]", "geom 'flap' has 3 numbers in 'size', none of index 3"),
        ("bodies.flop.mjcf.joint.hinge.damping", "the scene has no body file 'flop'; it has flap"),
        ("bodies.flap.mjcf.joint", "'joint' names no attribute; write e.g. joint.hinge.damping"),
        ("waves.perod", "waves.perod: unknown key; did you mean period?"),
    ],
)
def test_a_key_that_leads_nowhere_says_so(here, key, fault):
    with pytest.raises(SceneError) as error:
        design(study(here, "flap", a=key), {"a": 1.0}, here / "runs")
    assert fault in str(error.value)


def test_a_script_that_fails_says_where(here, trusted):
    for text, fault in (("x = 1", "no function build"), ("def build(folder):\n    return 1", "no table of keys"),
                        ("def build(folder):\n    1 / 0", "build failed: ZeroDivisionError")):  # fmt: skip
        (here / "make.py").write_text(text)
        with pytest.raises(SceneError, match=fault):
            design(Study(scene=str(here / "tank.toml"), script=here / "make.py"), {}, here / "runs")


def test_includes_and_asset_folders_survive_a_move(here):
    (here / "part.xml").write_text('<mujoco><worldbody><body name="inner"/></worldbody></mujoco>')
    (here / "main.xml").write_text('<mujoco><compiler meshdir="m"/><include file="part.xml"/></mujoco>')
    root = mjcf_edit.read(here / "main.xml")
    assert root.find("compiler").get("meshdir") == str(here / "m")
    mjcf_edit.change(root, "body.inner.pos", [1, 2, 3], "main.xml")
    assert root.find(".//body").get("pos") == "1 2 3" and root.find("include") is None


def test_an_energy_period_becomes_a_peak_period(here):
    waves = '[waves]\nkind = "irregular"\nHm0 = 0.05\npeak_period = 1.0\nspectrum = "pierson_moskowitz"\n'
    (here / "sea.toml").write_text((here / "tank.toml").read_text() + waves + "highest = 6.0\n")
    made = design(study(here, "sea.toml", Te="waves.Te"), {"Te": 1.5}, here / "runs")
    assert made.scene.waves.peak_period == pytest.approx(1.5 / 0.857, rel=2e-3)  # m-1/m0 of Pierson-Moskowitz
