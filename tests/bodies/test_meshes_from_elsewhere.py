"""Meshes of others: parts that overlap, hulls in hulls, open barges, other units; each is told before anything is sampled."""

import os

import numpy as np
import pytest
import trimesh

from bodies import load, mesh_solid
from bodies.shapes.shells import shells
from fsi.errors import SceneError
from fsi.particles.layout import build
from fsi.scene.model import BodyFile, Scene, Tank

S = 0.04


def box(extents, at=(0, 0, 0), turned=False):
    made = trimesh.creation.box(extents=extents, transform=trimesh.transformations.translation_matrix(at))
    if turned:
        made.invert()
    return made


def both(*parts):
    return trimesh.util.concatenate(list(parts))


HULL = box((0.4, 0.4, 0.4))
SOME = {
    "whole": (HULL, set()),
    "apart": (both(box((0.1, 0.2, 0.3), (-0.2, 0, 0)), box((0.1, 0.2, 0.3), (0.2, 0, 0))), set()),
    "crossing": (both(HULL, box((0.2, 0.2, 0.4), (0.01, 0.02, 0.3))), {"overlap"}),
    "faces in one plane": (both(HULL, box((0.4, 0.4, 0.4), (0.2, 0, 0))), {"overlap"}),
    "hollow": (both(HULL, box((0.2, 0.2, 0.2), turned=True)), {"cavity"}),
    "twice": (both(HULL, box((0.2, 0.2, 0.2))), {"twice"}),
    "one inside out": (both(HULL, box((0.2, 0.2, 0.2), (1, 0, 0), turned=True)), {"mixed"}),
    "all inside out": (box((0.4, 0.4, 0.4), turned=True), set()),
}


@pytest.mark.parametrize("name", SOME)
def test_what_a_mesh_is_made_of(name):
    mesh, wanted = SOME[name]
    found = shells(np.array(mesh.vertices), np.array(mesh.faces))
    said = {"overlap": found.overlap is not None, "mixed": found.mixed, "crossing": found.crossing is not None}
    said |= {"cavity": found.cavity > 0, "twice": found.twice > 0}
    assert {key for key, value in said.items() if value} == wanted
    if found.cavity or found.twice:
        assert found.cavity + found.twice == pytest.approx(0.008)


def knot():
    """A tube about a closed curve that crosses itself: one surface that runs through itself."""
    t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    centre = np.stack([np.sin(t), np.sin(2 * t), 0 * t], 1) * 0.3
    ahead = np.stack([np.cos(t), 2 * np.cos(2 * t), 0 * t], 1)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(ahead, [0, 0, 1.0])
    a = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    rings = centre[:, None] + 0.08 * (
        np.cos(a)[None, :, None] * side[:, None] + np.sin(a)[None, :, None] * np.array([0, 0, 1.0])
    )
    i, j = np.meshgrid(np.arange(48), np.arange(8), indexing="ij")
    at = lambda i, j: (i % 48) * 8 + j % 8  # noqa: E731
    faces = [
        np.stack(x, -1).reshape(-1, 3)
        for x in ((at(i, j), at(i + 1, j), at(i, j + 1)), (at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)))
    ]
    return trimesh.Trimesh(rings.reshape(-1, 3), np.vstack(faces), process=False)


def test_a_surface_through_itself_is_refused(tmp_path):
    knot().export(tmp_path / "knot.stl")
    with pytest.raises(SceneError, match=r"knot.stl: mesh runs through itself near \(.*\) m.*Boolean union"):
        mesh_solid(tmp_path / "knot.stl", 3)


@pytest.fixture
def make(tmp_path):
    def make(mesh, geom='density="500"', dimension=3, body="", name="hull.stl", **file):
        mesh.export(tmp_path / name)
        (tmp_path / "b.xml").write_text(
            f'<mujoco><asset><mesh name="hull" file="{name}"/></asset><worldbody><body name="hull"><freejoint/>{body}'
            f'<geom name="hull" type="mesh" mesh="hull" {geom}/></body></worldbody></mujoco>'
        )
        low, high = (-1.0, -1.0), (1.0, 1.0)
        if dimension == 3:
            low, high = (-0.6, -0.6, -0.6), (0.6, 0.6, 0.6)
        tank = Tank(min=low, max=high)
        scene = Scene(
            spacing=S,
            duration=1,
            dimension=dimension,
            tank=tank,
            bodies={"b": BodyFile(mjcf=tmp_path / "b.xml", **file)},
        )
        return scene, load(scene, "test.toml")

    return make


def water_inside(scene, bodies, *boxes):
    points = build(scene, bodies).position
    inside = [np.all(np.abs(points - at) < np.array(half) - 1e-6, axis=1) for at, half in boxes]
    return int(np.any(inside, axis=0).sum())


@pytest.mark.parametrize("dimension", [2, 3])
def test_overlapping_parts_are_refused_by_density_and_one_solid_by_mass(make, dimension):
    mesh = both(box((0.4, 0.2, 0.2), (0, 0, -0.05)), box((0.2, 0.2, 0.2), (0, 0, -0.15)))
    with pytest.raises(
        SceneError, match=r"geom 'hull': parts of its mesh overlap near .* twice; unite .* give the geom mass="
    ):
        make(mesh, dimension=dimension)
    scene, bodies = make(mesh, 'mass="7.5"', dimension)
    assert bodies.mass == pytest.approx([7.5])
    assert any("are taken as one solid" in note for note in bodies.notes)
    keep = [0, 2] if dimension == 2 else [0, 1, 2]
    centre = bodies.model.mesh_pos[0] * 0
    parts = [(np.array((0, 0, z)) + centre, half) for z, half in ((-0.05, (0.2, 0.1, 0.1)), (-0.15, (0.1, 0.1, 0.1)))]
    assert water_inside(scene, bodies, *((at[keep], np.array(half)[keep]) for at, half in parts)) == 0
    alone = make(mesh, body='<inertial pos="0 0 -.1" mass="7" diaginertia="1 1 1"/>', dimension=dimension)[1]
    assert alone.mass == pytest.approx([7])


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_hollow_hull_stays_dry(make, dimension):
    scene, bodies = make(SOME["hollow"][0], dimension=dimension)
    assert any("is hollow: its mesh encloses a cavity of 0.008 m3, which stays dry" in note for note in bodies.notes)
    assert bodies.mass == pytest.approx([500 * (0.064 - 0.008)])
    assert water_inside(scene, bodies, (np.zeros(dimension), (0.2,) * dimension)) == 0


def test_millimetres_are_told_before_anything_is_sampled(make):
    big = HULL.copy()
    big.apply_scale(1000)
    for dimension in (2, 3):
        with pytest.raises(
            SceneError, match=r"geom 'hull' is 400 m long: .*millimetres takes scale=\"0.001 0.001 0.001\""
        ):
            make(big, dimension=dimension)


def barge(wall=0.05):
    """A box open at the top, of one mesh."""
    outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    rings = [outline * [0.6, 0.4], outline * [0.6 - 2 * wall, 0.4 - 2 * wall]]
    heights = [(0, -0.2), (0, 0.2), (1, 0.2), (1, -0.2 + wall)]
    points = np.vstack([np.column_stack([rings[r], np.full(4, z)]) for r, z in heights])
    faces = [[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]]
    for level in range(3):
        for k in range(4):
            a, b = 4 * level + k, 4 * level + (k + 1) % 4
            faces += [[a, b, b + 4], [a, b + 4, a + 4]]
    return trimesh.Trimesh(points, faces, process=False)


@pytest.mark.parametrize("dimension, size", [(2, 0.5 * 0.15), (3, 0.5 * 0.3 * 0.15)])
def test_an_open_barge_says_that_it_holds_water(make, dimension, size):
    scene, bodies = make(barge(), dimension=dimension)
    (note,) = (note for note in bodies.notes if "water inside" in note)
    assert "body 'hull' starts with" in note and "bodies.b.dry_inside = true" in note
    assert float(note.split()[4]) == pytest.approx(size, rel=0.25)
    assert water_inside(scene, bodies, (np.zeros(dimension), (0.25, 0.15, 0.19)[:: 2 if dimension == 2 else 1])) > 20
    scene, bodies = make(barge(), dimension=dimension, dry_inside=True)
    assert water_inside(scene, bodies, (np.zeros(dimension), (0.29, 0.19, 0.19)[:: 2 if dimension == 2 else 1])) == 0
    assert not any("water inside" in note for note in bodies.notes)
    # a name of its own: MuJoCo keeps meshes by name and time of change, to the second
    whole = make(HULL, dimension=dimension, dry_inside=True, name="whole.stl")[1]
    assert any("bodies.b.dry_inside has no effect" in note for note in whole.notes)


def test_ground_of_parts_that_overlap_is_one_solid(tmp_path):
    both(box((1, 1, 0.4)), box((0.4, 0.4, 0.6), (0.1, 0, 0.1))).export(tmp_path / "bed.stl")
    solid = mesh_solid(tmp_path / "bed.stl", 3)
    assert solid.clearance(np.array([[0.1, 0, 0.1], [0.1, 0, 0.35], [0.1, 0, 0.5]])) == pytest.approx(
        [-0.1, -0.05, 0.1], abs=0.11
    )
    points = solid.boundary(0.05, 3)
    assert (solid.clearance(points) < 0).all()


def test_a_mesh_that_changes_within_a_second_is_read_anew(tmp_path):
    geom = '<body><freejoint/><geom type="mesh" mesh="m" density="500"/></body>'
    text = f'<mujoco><asset><mesh name="m" file="m.stl"/></asset><worldbody>{geom}</worldbody></mujoco>'
    (tmp_path / "m.xml").write_text(text)
    masses = []
    for size in (0.4, 0.6):
        box((size, size, size)).export(tmp_path / "m.stl")
        os.utime(tmp_path / "m.stl", (1e9, 1e9))
        files = {"m": BodyFile(mjcf=tmp_path / "m.xml")}
        tank = Tank(min=(-1, -1, -1), max=(1, 1, 1))
        masses.append(
            load(Scene(dimension=3, spacing=0.05, duration=1, tank=tank, bodies=files), "s").model.body_mass[1]
        )
    assert masses == pytest.approx([32.0, 108.0])


def test_a_vessel_in_the_ground_holds_water(tmp_path):
    """A cavity of a bathymetry, and a core in it."""
    vessel = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    vessel.invert()
    core = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    file = tmp_path / "vessel.stl"
    trimesh.util.concatenate([trimesh.creation.box(extents=[1, 1, 1]), vessel, core]).export(file)
    ground = mesh_solid(file, 3)
    distance = ground.clearance(np.array([[0.0, 0, 0], [0.2, 0, 0], [0.4, 0, 0], [0.6, 0, 0]]))
    np.testing.assert_array_equal(np.sign(distance), [-1, 1, -1, 1])
