"""Boundary particles: as much volume as they stand for, evenly spread, half a spacing under the surface."""

import math

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from bodies.shapes.meshes import mesh, polygon, section
from bodies.shapes.primitives import Box, Capsule, Cylinder, Disc, Placed

S, LAYERS = 0.02, 3
DEEP = S * LAYERS


def ball(radius):
    return 4 / 3 * math.pi * radius**3


def rod(radius, length):
    return math.pi * radius**2 * length


def rotated(shape, angle=0.6, axis=(1, 2, 3)):
    surface = shape.copy()
    surface.apply_transform(trimesh.transformations.rotation_matrix(angle, axis))
    return mesh(np.array(surface.vertices), np.array(surface.faces))


BLOCK = trimesh.creation.box(extents=[0.4, 0.3, 0.2])
GLOBE = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
SHELLS = {
    "rectangle": (Box(np.array([0.2, 0.1])), 0.4 * 0.2 - 0.28 * 0.08),
    "disc": (Disc(0.3), math.pi * (0.3**2 - (0.3 - DEEP) ** 2)),
    "box": (Box(np.array([0.2, 0.15, 0.1])), 0.4 * 0.3 * 0.2 - 0.28 * 0.18 * 0.08),
    "sphere": (Capsule(0.3), ball(0.3) - ball(0.3 - DEEP)),
    "capsule": (Capsule(0.2, 0.3), ball(0.2) - ball(0.14) + rod(0.2, 0.6) - rod(0.14, 0.6)),
    "cylinder": (Cylinder(0.2, 0.3), rod(0.2, 0.6) - rod(0.14, 0.6 - 2 * DEEP)),
    "mesh of a box": (mesh(np.array(BLOCK.vertices), np.array(BLOCK.faces)), 0.4 * 0.3 * 0.2 - 0.28 * 0.18 * 0.08),
    "mesh of a turned box": (rotated(BLOCK), 0.4 * 0.3 * 0.2 - 0.28 * 0.18 * 0.08),
    "mesh of a sphere": (mesh(np.array(GLOBE.vertices), np.array(GLOBE.faces)), ball(0.3) - ball(0.3 - DEEP)),
    "section of a sphere": (
        polygon(*section(np.array(GLOBE.vertices), np.array(GLOBE.faces))),
        math.pi * (0.3**2 - (0.3 - DEEP) ** 2),
    ),
}


@pytest.mark.parametrize("name", SHELLS)
def test_shells_fill_their_volume_evenly(name):
    shape, volume = SHELLS[name]
    points = shape.sample(S, LAYERS)
    assert len(points) * S ** points.shape[1] == pytest.approx(volume, rel=0.02)
    depth = -shape.distance(points) / S
    assert depth.min() == pytest.approx(0.5, abs=0.05)
    assert depth.max() == pytest.approx(LAYERS - 0.5, abs=0.05)
    tree = cKDTree(points)
    nearest = tree.query(points, k=2)[0][:, 1] / S
    assert nearest.min() > 0.7 and nearest.max() < 1.5
    assert np.percentile(nearest, 99) < 1.25


@pytest.mark.parametrize("name", SHELLS)
def test_outer_layer_leaves_no_holes(name):
    """Any place under the surface has a particle within a spacing and a half."""
    shape, _ = SHELLS[name]
    points = shape.sample(S, LAYERS)
    grid = np.stack(np.meshgrid(*[np.arange(-0.5, 0.5, 0.017)] * points.shape[1], indexing="ij"), -1)
    grid = grid.reshape(-1, points.shape[1])
    near = grid[np.abs(shape.distance(grid)) < 0.25 * S]
    assert cKDTree(points).query(near)[0].max() < 1.5 * S


@pytest.mark.parametrize("length", [0.13, 0.15, 0.161, 0.2])
def test_lattice_is_stretched_to_keep_half_a_spacing(length):
    points = Box(np.array([length / 2, 0.1])).sample(S, LAYERS)
    assert points[:, 0].max() == pytest.approx(length / 2 - S / 2)
    gaps = np.diff(np.unique(points[:, 0].round(9)))
    assert abs(gaps / S - 1).max() < 0.101


@pytest.mark.parametrize("thickness", [0.008, 0.01, 0.018])
@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_thin_mesh_plate_gets_a_middle_layer(thickness, turn):
    plate = trimesh.creation.box(extents=[0.3, 0.2, thickness])
    shape = rotated(plate, turn)
    points = shape.sample(S, LAYERS)
    depth = -shape.distance(points)
    assert np.median(depth) == pytest.approx(thickness / 2, rel=0.01) and depth.min() > 0.35 * thickness
    assert len(points) * S**2 == pytest.approx(0.06, rel=0.15)
    assert shape.thickness(S) == pytest.approx(thickness, rel=0.02)


def test_box_thinner_than_a_spacing_gets_a_middle_layer():
    points = Box(np.array([0.1, 0.1, 0.004])).sample(S, LAYERS)
    assert len(points) == 100 and np.all(points[:, 2] == 0)


def test_thickness_of_a_thick_mesh_passes_for_thick():
    assert SHELLS["mesh of a sphere"][0].thickness(S) > 2 * S


@pytest.mark.parametrize(
    "shape, reference",
    [
        (rotated(BLOCK, 0.0), Box(np.array([0.2, 0.15, 0.1]))),
        (mesh(np.array(GLOBE.vertices), np.array(GLOBE.faces)), Capsule(0.3)),
        (
            polygon(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1.0]]), np.array([[1, -1], [1, 1], [-1, 1], [-1, -1.0]])),
            Box(np.ones(2)),
        ),
    ],
)
def test_surface_distance_against_the_formula(shape, reference):
    dim = 2 if isinstance(reference, Box) and reference.half.size == 2 else 3
    reach = 0.3 if dim == 3 else 1.5
    points = np.random.default_rng(1).uniform(-reach, reach, (4000, dim))
    assert shape.distance(points) == pytest.approx(reference.distance(points), abs=1e-3 if dim == 3 else 1e-12)


def test_cylinder_distance():
    shape = Cylinder(0.2, 0.3)
    points = np.array([[0, 0, 0], [0.15, 0, 0], [0, 0, 0.29], [0.3, 0, 0.0], [0.23, 0, 0.34], [0, 0.2, 0]])
    assert shape.distance(points) == pytest.approx([-0.2, -0.05, -0.01, 0.1, 0.05, 0])


def test_section_has_holes():
    """A ring cut across its axis is two circles, along it an annulus."""
    ring = trimesh.creation.annulus(r_min=0.1, r_max=0.3, height=0.2, sections=64)
    vertices, faces = np.array(ring.vertices), np.array(ring.faces)
    lying = polygon(*section(vertices[:, [0, 2, 1]], faces[:, ::-1]))
    assert lying.distance(np.array([[0.0, 0.0], [0.2, 0.0], [0.4, 0.0]])) == pytest.approx([0.1, -0.1, 0.1], abs=2e-3)
    standing = polygon(*section(vertices, faces))
    assert standing.distance(np.array([[0.0, 0.0], [0.2, 0.0], [-0.2, 0.0]])) == pytest.approx([0.1, -0.1, -0.1])


def test_placed_shape_turns_with_its_axes():
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    solid = Placed(Box(np.array([0.2, 0.1])), np.array([1.0, 2.0]), turn)
    points = solid.boundary(S, LAYERS)
    assert np.ptp(points, axis=0) == pytest.approx([0.2 - S, 0.4 - S])
    assert solid.clearance(np.array([[1.0, 2.0], [1.0, 2.3]])) == pytest.approx([-0.1, 0.1])


def test_a_fine_mesh_of_many_particles():
    """20,480 triangles, finer than the particles."""
    globe = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    points = mesh(np.array(globe.vertices), np.array(globe.faces)).sample(0.025, LAYERS)
    volume = ball(0.5) - ball(0.5 - 0.025 * LAYERS)
    assert len(points) * 0.025**3 == pytest.approx(volume, rel=0.02)
    assert cKDTree(points).query(points, k=2)[0][:, 1].min() > 0.7 * 0.025
