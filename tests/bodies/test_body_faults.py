"""What is wrong with bodies is said with file, place, fault and way out; what is decided for the user is noted."""

import numpy as np
import pytest
import trimesh

import bodies
from bodies import load, mesh_solid
from fsi.errors import SceneError
from fsi.scene.model import BodyFile, Scene, Tank

SLAB = '<body name="slab"><freejoint/><geom name="slab" type="box" size="0.2 0.1 {half}" density="500"/></body>'


def wet(*names):
    elements = "".join(f'<element objtype="geom" objname="{name}"/>' for name in names)
    return f'<custom><tuple name="wet">{elements}</tuple></custom>'


def two_boxes(gap, *, apart=True):
    second = f'<geom name="right" type="box" size="0.1 0.1 0.1" pos="{0.2 + gap} 0 0"/>'
    first = '<body name="one"><freejoint/><geom name="left" type="box" size="0.1 0.1 0.1"/>'
    return first + (f'</body><body name="two"><freejoint/>{second}' if apart else second) + "</body>"


@pytest.mark.parametrize(
    "world, settings, message",
    [
        (
            '<body name="b"><joint/><geom sze="1"/></body>',
            {},
            r"body.xml: .*unrecognized attribute: 'sze'.*line 1; correct",
        ),
        ('<body name="b"><joint/></body>', {}, r"body.xml: mass and inertia of moving bodies .*'b'.*line 1"),
        (SLAB.format(half=0.1), {"head": wet("hul")}, r"body.xml: unrecognized object 'hul' in tuple"),
        (
            SLAB.format(half=0.1),
            {"option": 'density="1000"'},
            "body.xml: option: MuJoCo's own fluid model is on; remove",
        ),
        (
            SLAB.format(half=0.1),
            {"gravity": 3.7},
            "option: gravity is 0 0 -9.81 m/s2 where the scene has 0 0 -3.7; make",
        ),
        (
            SLAB.format(half=0.1),
            {"position": (1.9, 0, 0)},
            "body 'slab' reaches x = 2.1 m, beyond the tank's x = 2 m; move",
        ),
        (
            SLAB.format(half=0.1),
            {"spacing": 0.15},
            "test.toml: spacing: body 'slab' is .* particles across .*; set spacing",
        ),
        (two_boxes(-0.05), {}, r"geom 'right' \(body 'two'\) overlaps geom 'left' \(body 'one'\); move them apart"),
        (
            SLAB.format(half=0.1) + '<geom name="ramp" type="box" size="1 1 0.1" pos="0 0 -0.193"/>',
            {"head": wet("slab")},
            r"geoms 'ramp' and 'slab' stand 0.007 m in each other at the start; move them apart, or switch",
        ),
        (
            '<body name="hand" mocap="true"><geom name="h" size="0.2"/></body>' + SLAB.format(half=0.1),
            {"head": wet("h")},
            "geom 'h': belongs to a mocap body, .* fixed wall; give its body a joint",
        ),
        (
            '<body name="b"><freejoint/><geom name="p" type="plane" size="1 1 1" mass="1"/></body>',
            {},
            "plane.*world|plane",
        ),
        (
            '<body ><freejoint/><geom size="1"/><body name="b"><geom name="w" size="1" mass="0"/></body></body>',
            {"head": wet("w")},
            "wet body 'b' has no mass; give its geoms mass",
        ),
        (
            SLAB.format(half=0.1),
            {"dimension": 2, "position": (0, 0.5, 0)},
            "geom 'slab': does not meet the plane y = 0",
        ),
    ],
)
def test_faults(make_bodies, world, settings, message):
    with pytest.raises(SceneError, match=message):
        make_bodies(world, **settings)


def test_a_missing_file_and_where_models_are(tmp_path):
    tank = Tank(min=(-1, -1), max=(1, 1))
    scene = Scene(spacing=0.02, duration=1, tank=tank, bodies={"flap": BodyFile(mjcf=tmp_path / "none.xml")})
    with pytest.raises(
        SceneError, match=r"scene.toml: bodies.flap.mjcf: no file .*none.xml.*; .*package://bodies/models"
    ):
        load(scene)


def test_an_open_mesh_body(make_bodies, tmp_path):
    box = trimesh.creation.box(extents=[0.4, 0.4, 0.4])
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(tmp_path / "open.stl")
    world = '<body name="b"><freejoint/><geom name="hull" type="mesh" mesh="hull"/></body>'
    head = '<asset><mesh name="hull" file="open.stl" inertia="convex"/></asset>'
    with pytest.raises(SceneError, match=r"geom 'hull': mesh is not watertight \(3 open edges\); repair it"):
        make_bodies(world, head=head)


def test_a_missing_mesh_of_a_body(make_bodies):
    world = '<body name="b"><freejoint/><geom type="mesh" mesh="hull"/></body>'
    with pytest.raises(SceneError, match=r"body.xml: Error opening file .*none.stl"):
        make_bodies(world, head='<asset><mesh name="hull" file="none.stl"/></asset>')


def test_ground_meshes(tmp_path):
    with pytest.raises(SceneError, match=r"tank.bathymetry: no file .*none.stl'; give"):
        mesh_solid(tmp_path / "none.stl", 3)
    (tmp_path / "text.stl").write_text("not a mesh")
    with pytest.raises(SceneError, match=r"text.stl: (cannot be read as a mesh|holds no triangles)"):
        mesh_solid(tmp_path / "text.stl", 3)
    box = trimesh.creation.box(extents=[1, 1, 1])
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(tmp_path / "open.stl")
    with pytest.raises(SceneError, match=r"open.stl: mesh is not watertight \(3 open edges\); repair it"):
        mesh_solid(tmp_path / "open.stl", 3)
    faces = box.faces.copy()
    faces[0] = faces[0, ::-1]
    trimesh.Trimesh(box.vertices, faces, process=False).export(tmp_path / "turned.stl")
    with pytest.raises(SceneError, match=r"turned.stl: triangles face different ways \(across 3 edges\)"):
        mesh_solid(tmp_path / "turned.stl", 3)
    box.invert()
    box.apply_translation([0, 2, 0])
    box.export(tmp_path / "aside.stl")
    with pytest.raises(SceneError, match=r"aside.stl: does not meet the plane y = 0"):
        mesh_solid(tmp_path / "aside.stl", 2)
    solid = mesh_solid(tmp_path / "aside.stl", 3)
    assert solid.clearance(np.array([[0.0, 2.0, 0.0], [0.0, 2.0, 0.6]])) == pytest.approx([-0.5, 0.1])


def test_a_thin_plate_is_noted(make_bodies):
    made = make_bodies(SLAB.format(half=0.004))
    assert any(
        "0.008 m thick, under two spacings (0.04 m)" in note and "0.004 m resolves" in note for note in made.notes
    )
    assert not make_bodies(SLAB.format(half=0.02)).notes


def test_width_in_two_dimensions_is_noted(make_bodies):
    assert any("0.2 m wide along y" in note for note in make_bodies(SLAB.format(half=0.1), dimension=2).notes)
    tank = Tank(min=(-2, -2), max=(2, 2), width=0.2)
    assert not make_bodies(SLAB.format(half=0.1), dimension=2, tank=tank).notes


def test_overlap_within_a_body_is_trimmed_and_noted(make_bodies):
    made = make_bodies(two_boxes(-0.05, apart=False))
    (_, left), (_, right) = made.solids()
    points = right.boundary(0.02, 3)
    assert (left.clearance(points) > 0).all() and len(points) < len(right.sampled(0.02, 3))
    assert any("geom 'right' overlaps others of its body" in note for note in made.notes)
    assert not make_bodies(two_boxes(0.05, apart=False)).notes


def test_a_missing_extra_is_one_line(monkeypatch, tmp_path):
    import sys

    monkeypatch.setitem(sys.modules, "trimesh", None)
    (tmp_path / "bed.stl").write_text("solid")
    with pytest.raises(SceneError, match=r"needs the package 'trimesh'.*pip install 'spindrift\[bodies\]'"):
        bodies.mesh_solid(tmp_path / "bed.stl", 3)


def test_unknown_joint_lists_the_known(make_bodies):
    made = make_bodies('<body name="b"><joint name="surge" type="slide" axis="1 0 0"/><geom size="0.1"/></body>')
    with pytest.raises(SceneError, match="no hinge or slide joint 'heave'; known: surge"):
        made.place({"heave": 1.0}, {})


def test_a_range_through_a_wall_is_noted(make_bodies):
    joint = '<body name="b"><joint name="heave" type="slide" axis="0 0 1" limited="true" range="-{0} {0}"/>'
    world = joint + '<geom name="hull" type="box" size="0.2 0.1 0.1"/></body>'
    (note,) = make_bodies(world.format(1.95)).notes
    assert "joint 'heave': its range lets body 'b' through the tank's z- wall" in note and "narrow the range" in note
    assert not make_bodies(world.format(1.9)).notes


def test_a_body_that_leaves_through_a_wall_is_noted(make_bodies):
    made = make_bodies()
    for _ in range(60):
        made.advance(0.01, np.zeros((1, 6)), np.zeros((6, 6)), np.zeros(6))
    assert not made.notes
    for _ in range(5):
        made.advance(0.01, np.zeros((1, 6)), np.zeros((6, 6)), np.zeros(6))
    assert any("body 'box' went through the tank's z- wall at t = 0.62 s" in note for note in made.notes)


def test_contact_without_friction_is_made_one_dimensional(make_bodies):
    made = make_bodies(
        '<body name="b"><freejoint/><geom name="hull" type="box" size="0.2 0.1 0.1" friction="0 0 0"/></body>'
    )
    assert made.notes == ("contact of geoms without friction: condim 1 ('hull')",) and made.model.geom_condim[0] == 1
