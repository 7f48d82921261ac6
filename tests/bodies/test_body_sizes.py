"""MJCF files that would grow beyond measure, and bodies of too many particles: refused before they are made."""

import pytest

from fsi.errors import SceneError
from fsi.scene.binding import bind
from fsi.scene.model import Scene

FLOAT = '<body><joint name="heave" type="slide" axis="0 0 1"/><geom name="hull" size="0.2" density="500"/></body>'
TWICE = FLOAT.replace("<geom", '<joint name="again" type="slide" axis="0 0 1"/><geom')
SCENE = {"spacing": 0.05, "duration": 0.1, "tank": {"min": (0, -0.6), "max": (2, 0.5)}}


@pytest.mark.parametrize(
    "parts, fault",
    [
        (
            '<worldbody><replicate count="1000000"><geom size="0.1"/></replicate></worldbody>',
            "replicate: more than 20000",
        ),
        (
            '<worldbody><replicate count="200"><replicate count="200"><geom size="1"/></replicate></replicate></worldbody>',
            "replicate: more than 20000 elements",
        ),
        (
            "<worldbody>" + "<body>" * 5000 + "</body>" * 5000 + "</worldbody>",
            "body: elements stand more than 400 deep",
        ),
        ("<worldbody>" + "<body><freejoint/><geom size='1'/></body>" * 200 + "</worldbody>", "more than 1000 degrees"),
        ('<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>', "hfield 'h': 1e+10 values"),
        (
            '<asset><texture name="t" type="2d" builtin="flat" width="1000000" height="99999"/></asset>',
            "texture 't': 1e+11",
        ),
        (f'<size nkey="2000000000"/><worldbody>{FLOAT}</worldbody>', "size nkey: 2000000000 values"),
        (f'<size nuser_geom="2000000000"/><worldbody>{FLOAT}</worldbody>', "size nuser_geom: 2000000000 values"),
        (f'<size memory="1000000G"/><worldbody>{FLOAT}</worldbody>', "Could not allocate memory"),
        (
            '<custom><tuple name="wet"><element objtype="geom" objname="quay"/></tuple></custom>'
            '<worldbody><geom name="quay" type="box" size="1e7 1 1e7"/></worldbody>',
            "geom 'quay' takes about 6.4e+09 boundary particles",
        ),
    ],
)
def test_sizes_of_files_are_refused(tmp_path, parts, fault):
    file = tmp_path / "b.xml"
    file.write_text(f"<mujoco>{parts}</mujoco>")
    with pytest.raises(SceneError) as caught:
        bind(Scene.model_validate(SCENE | {"bodies": {"b": {"mjcf": file, "position": (1, 0, 0)}}}), "s.toml")
    assert fault in str(caught.value)


def test_joints_that_move_a_body_the_same_way_are_refused(tmp_path):
    """Two slides along one axis: the mass matrix is singular, and the first step would fail."""
    file = tmp_path / "b.xml"
    file.write_text(f"<mujoco><worldbody>{TWICE}</worldbody></mujoco>")
    with pytest.raises(SceneError, match="joints 'heave' and 'again' move a body the same way at the start"):
        bind(Scene.model_validate(SCENE | {"bodies": {"b": {"mjcf": file, "position": (1, 0, 0)}}}), "s.toml")


def test_bodies_too_far_apart_in_mass_are_told(tmp_path):
    """A hull in millimetres on a slide of a spar: the mass matrix is singular to round-off."""
    float_ = '<body name="float"><joint name="slide" type="slide" axis="0 0 1"/><geom size="300" density="500"/></body>'
    spar = '<body name="spar"><joint name="heave" type="slide" axis="0 0 1"/><geom size="0.2" mass="70"/>{}</body>'
    file = tmp_path / "b.xml"
    file.write_text(f"<mujoco><worldbody>{spar.format(float_)}</worldbody></mujoco>")
    with pytest.raises(SceneError, match=r"body 'float' weighs 5.65e\+10 kg and another 70 kg.*MJCF is in metres"):
        bind(Scene.model_validate(SCENE | {"bodies": {"b": {"mjcf": file, "position": (1, 0, 0)}}}), "s.toml")
