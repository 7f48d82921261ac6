"""Boundary particles reach into convex edges and corners, and carry as much of the kernel as a filled lattice."""

import math

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from bodies import mesh_solid
from bodies.shapes.meshes import mesh, polygon, section
from fsi.errors import SceneError

S, LAYERS = 0.025, 3


def prism(outline, width):
    """Mesh of a polygon (n, 2) in (x, z), convex or star-shaped about its first corner, drawn out over y [m]."""
    n = len(outline)
    ends = [np.column_stack([outline[:, 0], np.full(n, y), outline[:, 1]]) for y in (-width / 2, width / 2)]
    fan = np.array([[0, i, i + 1] for i in range(1, n - 1)])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    sides = np.vstack([np.column_stack([i, i + n, j]), np.column_stack([j, i + n, j + n])])
    return trimesh.Trimesh(np.vstack(ends), np.vstack([fan, fan[:, ::-1] + n, sides]))


def turned(shape):
    return shape.copy().apply_transform(trimesh.transformations.rotation_matrix(0.6, (1, 2, 3)))


STEP = prism(np.array([[0.3, 0.2], [0.0, 0.2], [0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.3, 0.4]]), 0.3)
BODIES = {
    "box": trimesh.creation.box(extents=[0.4, 0.33, 0.21]),
    "turned box": turned(trimesh.creation.box(extents=[0.4, 0.33, 0.21])),
    "wedge": prism(np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.6 * math.tan(math.pi / 6)]]), 0.3),
    "step": STEP,
    "ramp": prism(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.3], [0.5, 0.3], [0.2, 0.15], [0.0, 0.15]]), 0.3),
}


def surface_of(body, dim):
    """The sampled shape, and dense places (n, dim) on its surface, edges and corners included."""
    vertices, faces = np.array(body.vertices), np.array(body.faces)
    if dim == 2:
        start, end = section(vertices, faces)
        share = np.linspace(0, 1, 200)[:, None, None]
        return polygon(start, end), (start + share * (end - start)).reshape(-1, 2)
    share = np.linspace(0, 1, 200)[:, None, None]
    a, b = vertices[body.edges_unique[:, 0]], vertices[body.edges_unique[:, 1]]
    on_faces = trimesh.sample.sample_surface(body, 40000, seed=1)[0]
    return mesh(vertices, faces), np.vstack([on_faces, (a + share * (b - a)).reshape(-1, 3)])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", BODIES)
def test_no_hole_under_faces_edges_and_corners(name, dim):
    shape, places = surface_of(BODIES[name], dim)
    points = shape.sample(S, LAYERS)
    far = cKDTree(points).query(places)[0] / S
    usual, most = (0.95, 1.1) if name != "wedge" else (1.0, 1.2)  # its edges of 60 degrees: a spacing in, half along
    assert np.percentile(far, 99) < usual and far.max() < most
    assert cKDTree(points).query(points, k=2)[0][:, 1].min() > 0.6 * S


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", BODIES)
def test_edges_keep_the_volume(name, dim):
    shape, _ = surface_of(BODIES[name], dim)
    side = 0.0029
    lower, upper = shape._bounds
    axes = [np.arange(a, b, side) for a, b in zip(lower + 0.3 * side, upper, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    depth = -shape.distance(grid.reshape(-1, dim))
    volume = ((depth > 0) & (depth < LAYERS * S)).sum() * side**dim
    assert len(shape.sample(S, LAYERS)) * S**dim == pytest.approx(volume, rel=0.025)


def test_a_tetrahedron_is_filled_to_its_corners():
    corners = 0.3 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    shape, places = surface_of(trimesh.convex.convex_hull(corners), 3)
    points = shape.sample(S, LAYERS)
    assert cKDTree(points).query(places)[0].max() < 1.15 * S
    assert cKDTree(points).query(points, k=2)[0][:, 1].min() > 0.6 * S


def kernel(points, places):
    """Sum over points of W * S**dim at places (n, dim): Wendland C2 of radius 2.6 S."""
    dim, reach = points.shape[1], 2.6 * S
    scale = {2: 7 / math.pi, 3: 21 / (2 * math.pi)}[dim] / reach**dim * S**dim
    q = np.linalg.norm(points[None] - places[:, None], axis=2) / reach
    return (scale * np.clip(1 - q, 0, None) ** 4 * (1 + 4 * q)).sum(axis=1)


@pytest.mark.parametrize("dim", [2, 3])
def test_kernel_sum_outside_faces_and_edges(dim, tmp_path):
    """Half a spacing off the middle of the top, and off its edge diagonally, against lattices that fill the solid."""
    trimesh.creation.box(extents=[0.4, 0.4, 0.4]).export(tmp_path / "box.stl")
    points = mesh_solid(tmp_path / "box.stl", dim).boundary(S, LAYERS)
    lattice = np.stack(np.meshgrid(*[np.arange(-7.5, 8) * S] * dim, indexing="ij"), -1).reshape(-1, dim)
    rest = np.linspace(-0.1, 0.1, 41)
    face, edge = np.full((41, dim), 0.2 + S / 2), np.full((41, dim), 0.2 + S / 2)
    face[:, 0] = rest
    if dim == 3:
        face[:, 1], edge[:, 1] = 0.03, rest
    assert kernel(points, face).mean() == pytest.approx(kernel(lattice, face).mean(), rel=0.04)
    assert kernel(points, face) == pytest.approx(kernel(lattice, face), rel=0.15)
    assert np.all(kernel(points, edge) > 0.9 * kernel(lattice, edge))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_box_has_particles_at_half_a_spacing_from_both_faces(dim):
    shape, _ = surface_of(trimesh.creation.box(extents=[0.4, 0.4, 0.4]), dim)
    tree = cKDTree(shape.sample(S, LAYERS))
    for layer in range(LAYERS):
        corner = np.full(dim, 0.2 - (layer + 0.5) * S)
        assert tree.query(corner)[0] < 0.02 * S


@pytest.mark.parametrize("dim", [2, 3])
def test_crop_leaves_out_what_lies_far_from_the_tank(dim, tmp_path):
    trimesh.creation.box(extents=[2.0, 0.4, 0.4]).export(tmp_path / "bed.stl")
    low, high = np.full(dim, -0.3), np.full(dim, 0.3)
    whole = mesh_solid(tmp_path / "bed.stl", dim).boundary(S, LAYERS)
    solid = mesh_solid(tmp_path / "bed.stl", dim, crop=(low, high))
    points = solid.boundary(S, LAYERS)
    within = np.all((whole > low) & (whole < high), axis=1)
    assert np.all((points >= low) & (points <= high)) and len(points) == pytest.approx(within.sum(), rel=0.03)
    assert cKDTree(points).query(whole[within])[0].max() < S
    assert solid.clearance(np.full((1, dim), 0.1)) == pytest.approx(-0.1)
    with pytest.raises(
        SceneError, match=r"lies beside the tank: x = -1 to 1 m where the tank .* 4.7 to 5.3 m; move it"
    ):
        mesh_solid(tmp_path / "bed.stl", dim, crop=(low + 5, high + 5))
