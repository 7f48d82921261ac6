"""Fluid of any shape: polygons and meshes, along slopes, beside other liquids, at its hydrostatic pressure."""

import tomllib

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.particles.layout import build
from fsi.scene.check import check_scene
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene
from fsi.scene.region import volume

DR, G, WATER, SAND = 0.05, 9.81, 1000.0, 1950.0
TRIANGLE = [[0.2, -0.1], [0.85, -0.1], [0.85, -0.75]]
BELOW = {2: ([0.0, -1.0], [2.0, 0.4]), 3: ([0.0, -0.2, -1.0], [2.0, 0.2, 0.4])}


def scene(*blocks, dimension=2, fluid=None):
    low, high = BELOW[dimension]
    data = {
        "spacing": DR, "duration": 1.0, "dimension": dimension, "tank": {"min": low, "max": high}, "fluid": fluid or {},
        "liquids": {"sand": {"density": SAND, "blocks": list(blocks)}} if blocks else {},
    }  # fmt: skip
    made = Scene.model_validate(data)
    check_scene(made)
    return made


def ball(folder, holes=0):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(3, 0.3)
    mesh.apply_translation([1.0, 0.0, -0.5])
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces[holes:])
    mesh.export(folder / "ball.stl")
    return str(folder / "ball.stl")


@pytest.mark.parametrize("angle", [None, -45.0, 20.0])
def test_a_triangle_of_sand_takes_the_place_of_water_at_its_own_pressure(angle):
    """Its faces run through the middles of the tank's cells: each of these is either sand or water."""
    layout = build(scene({"polygon": TRIANGLE, "angle": angle}))
    sand, (x, z) = layout.liquid == 1, layout.position.T
    assert len(layout.position) == 40 * 20
    assert layout.volume == DR**2
    assert abs(sand.sum() * DR**2 / (0.65**2 / 2) - 1) < (0.08 if angle is None else 0.01)
    exact = -z * WATER * G
    below = (x > 0.2) & (x < 0.85) & (z < -0.1)
    inside = below & (z > 0.1 - x)  # where particles of both may be on its edges
    exact[inside] = G * (0.1 * WATER + SAND * (-0.1 - z[inside]))
    under = below & ~inside
    exact[under] += G * (SAND - WATER) * (x[under] - 0.2)
    assert np.allclose(layout.pressure, exact, atol=1e-6 * exact.max())


@pytest.mark.parametrize("cells", [4.4, 4.6])
def test_a_slab_of_no_whole_number_of_rows_holds_its_volume_evenly(cells):
    up = np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    across = np.array([-up[1], up[0]])
    corners = [np.array([0.5, -0.9]) + a * up + b * DR * across for a, b in ((0, 0), (1, 0), (1, cells), (0, cells))]
    layout = build(scene({"polygon": [list(map(float, corner)) for corner in corners], "angle": 30.0}))
    sand = layout.position[layout.liquid == 1] - corners[0]
    assert abs(len(sand) - cells / DR) < 1.5 and len(layout.position) == 40 * 20
    top = np.sort((sand @ up)[sand @ across > 4 * DR])
    assert abs(len(top) - (cells - 4) / DR) < 1.5 and np.diff(top).max() < 5.5 * DR


def test_a_slab_along_a_slope_has_rows_and_no_steps():
    up = np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    across = np.array([-up[1], up[0]])
    along, over = np.array([[0.0], [1.0], [1.0], [0.0]]), np.array([[0.0], [0.0], [0.2], [0.2]])
    corners = np.array([0.5, -0.9]) + along * up + over * across
    layout = build(scene({"polygon": corners.tolist(), "angle": 30}))
    height = (layout.position[layout.liquid == 1] - corners[0]) @ across
    assert np.unique(np.round(height / DR, 6)).tolist() == [0.5, 1.5, 2.5, 3.5]
    assert (layout.liquid == 1).sum() == 20 * 4


def test_shapes_in_three_dimensions(tmp_path):
    box = {"min": [0.0, -0.1, -1.0], "max": [2.0, 0.1, 0.0]}
    layout = build(scene(box | {"polygon": TRIANGLE, "angle": -45}, dimension=3))
    assert np.allclose(np.unique(layout.position[layout.liquid == 1, 1]), [-0.075, -0.025, 0.025, 0.075])
    assert (layout.liquid == 1).sum() * DR**3 == pytest.approx(0.2 * 0.65**2 / 2, rel=0.1)
    mesh = {"mesh": ball(tmp_path), "min": [0.7, -0.2, -0.8], "max": [1.3, 0.2, -0.2]}
    whole = scene(mesh, dimension=3)
    exact = np.pi * (0.09 * 0.4 - 2 * 0.2**3 / 3)
    assert (build(whole).liquid == 1).sum() * DR**3 == pytest.approx(exact, rel=0.03)
    assert volume(whole.liquids["sand"].blocks[0]) == pytest.approx(exact, rel=0.01)


def test_in_two_dimensions_a_mesh_is_its_section(tmp_path):
    layout = build(scene({"mesh": ball(tmp_path), "min": [0.7, -0.8], "max": [1.3, -0.2]}))
    assert (layout.liquid == 1).sum() * DR**2 == pytest.approx(np.pi * 0.09, rel=0.03)


def test_a_liquid_in_a_pocket_of_another_starts_at_rest():
    """Three liquids: a wedge under a slab, both cut slantwise."""
    data = scene({"polygon": [[0, -1], [2, -1], [2, -0.4], [0, -0.8]]}).model_dump(mode="json", exclude_none=True)
    data["liquids"]["mud"] = {"density": 1200.0, "blocks": [{"polygon": [[0, -0.8], [2, -0.4], [2, -0.2], [0, -0.2]]}]}
    layout = build(Scene.model_validate(data))
    x, z = layout.position.T
    floor = -0.8 + 0.2 * x
    over = np.clip(-0.2 - z, 0, -0.2 - floor), np.maximum(0, floor - z)
    exact = G * (WATER * np.minimum(-z, 0.2) + 1200 * over[0] + SAND * over[1])
    assert np.allclose(layout.pressure, exact, atol=1e-6 * exact.max())


def test_water_alone_in_a_polygon_is_hydrostatic():
    basin = [[0.0, -0.5], [1.0, -1.0], [2.0, -0.5], [2.0, 0.0], [0.0, 0.0]]
    layout = build(scene(fluid={"blocks": [{"polygon": basin}], "start": "hydrostatic"}))
    assert np.allclose(layout.pressure, -WATER * G * layout.position[:, 1])
    assert len(layout.position) * DR**2 == pytest.approx(1.5, rel=0.02)


def test_a_scene_with_shapes_reads_as_it_is_written():
    made = scene({"polygon": TRIANGLE, "angle": -45.0})
    assert Scene.model_validate(tomllib.loads(resolved_toml(made))) == made
    assert made.liquids["sand"].blocks[0].max == (0.85, -0.1)


@pytest.mark.parametrize(
    ("block", "said"),
    [
        ({"polygon": [[0, 0], [1, -1], [1, 0], [0, -1]]}, "sides 0 and 2 of the polygon cross"),
        ({"polygon": [[0, -1], [1, -1], [0.5, -1], [0.5, 0]]}, "sides 0 and 1 of the polygon cross"),
        ({"polygon": [[0, 0], [1, -1]]}, "2 corners"),
        ({"polygon": [[0, 0], [1, "a"], [1, -1]]}, "number"),
        ({"polygon": [[-1, 0], [1, -1], [1, 0]]}, "leaves the tank"),
        ({"polygon": TRIANGLE, "mesh": "ball.stl"}, "a polygon and a mesh"),
        ({"mesh": "none.stl", "min": [0, -1], "max": [1, 0]}, "no such file"),
        ({}, "required"),
    ],
)
def test_wrong_shapes_are_refused(block, said):
    with pytest.raises((SceneError, ValueError), match=said):
        scene(block)


def test_shapes_that_overlap_are_refused_and_those_that_touch_are_not():
    other = [[0.2, -0.1], [0.85, -0.75], [0.2, -0.75]]
    scene({"polygon": TRIANGLE}, {"polygon": other})
    with pytest.raises(SceneError, match="overlaps"):
        scene(
            {"polygon": TRIANGLE}, {"polygon": [[0.2, -0.1], [0.85, -0.65], [0.85, -0.75], [0.2, -0.75], [0.1, -0.2]]}
        )


def test_an_open_mesh_and_a_polygon_without_width_are_refused(tmp_path):
    with pytest.raises(SceneError, match="not closed"):
        build(scene({"mesh": ball(tmp_path, 400), "min": [0.7, -0.8], "max": [1.3, -0.2]}))
    with pytest.raises(SceneError, match="extent along y"):
        scene({"polygon": TRIANGLE}, dimension=3)
