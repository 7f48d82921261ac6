"""Closed triangle meshes and their plane sections as solids."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bodies.shapes import layers as layering
from bodies.shapes.distance import TriangleTree, nearest_segment
from bodies.shapes.primitives import Placed, Together, beyond
from bodies.shapes.shells import Shells, merged, shells
from fsi.errors import SceneError
from fsi.extras import require
from fsi.protocols import Solid
from fsi.trust import check_bytes

BY_HAND = "in a CAD or mesh program (Blender: Mesh > Clean Up, Mesh > Normals, Boolean union)"
READABLE = "export it as STL, OBJ or PLY, or a grid of heights as XYZ, ASC or GeoTIFF"
Crop = tuple[np.ndarray, np.ndarray]  # lowest and highest corner of a box, each (dim,) [m]


class Surface:
    """A closed surface with a distance function. `mean_thickness` is volume over half the surface [m]; particles are
    laid only within `crop`."""

    def __init__(self, nearest: layering.Nearest, vertices: np.ndarray, mean_thickness: float):
        self._nearest, self._finest = nearest, mean_thickness / 3
        self.crop: Crop | None = None
        self._vertices = vertices
        self._bounds = vertices.min(axis=0), vertices.max(axis=0)

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        """Boundary particles (n, dim), as `Solid.boundary`."""
        lower, upper = self._bounds
        if self.crop is None:
            return layering.under(self._nearest, lower, upper, spacing, layers, self._finest)
        low, high = np.maximum(lower, self.crop[0]), np.minimum(upper, self.crop[1])
        if np.any(high <= low):
            return np.empty((0, len(lower)))
        points = layering.under(self._nearest, low, high, spacing, layers, self._finest)
        return points[np.all((points >= low) & (points <= high), axis=1)]

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (n,) of points (n, dim), negative inside; far outside, that to the bounding box."""
        lower, upper = self._bounds
        distance = beyond(points, lower, upper)
        close = distance < 0.25 * (upper - lower).max()
        distance[close] = self._nearest(points[close])[0]
        return distance

    def foot(self, points: np.ndarray) -> np.ndarray:
        """The closest places (n, dim) on the surface to points (n, dim)."""
        return self._nearest(points)[1]

    def support(self, direction: np.ndarray) -> float:
        """How far the surface reaches along a direction (dim,) [m]."""
        return float((self._vertices @ direction).max())

    def thickness(self, spacing: float) -> float:
        """Diameter of the largest ball inside [m], told apart up to two and a half spacings."""
        return 2 * layering.deepest(self._nearest, *self._bounds, spacing, self._finest)


def mesh(vertices: np.ndarray, triangles: np.ndarray) -> Surface:
    """A closed mesh in three dimensions: vertices (n, 3) [m], triangles (m, 3) that all run the same way round. Vertices of
    other shells in the same file do not count."""
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], triangles.reshape(-1, 3)
    corners = vertices[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    volume = np.einsum("tk,tk->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    outward = triangles if volume > 0 else triangles[:, ::-1]
    return Surface(TriangleTree(vertices, outward).nearest, vertices, 2 * abs(volume) / area)


def polygon(start: np.ndarray, end: np.ndarray) -> Surface:
    """Closed polygons in two dimensions by their segments, start to end (m, 2) [m], in any order; holes by parity."""
    start, end = np.ascontiguousarray(start), np.ascontiguousarray(end)
    length = np.linalg.norm(end - start, axis=1).sum()
    area = (start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum() / 2
    return Surface(lambda points: nearest_segment(points, start, end), start, 2 * abs(area) / length)


def section(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments of the cut of a closed mesh by the plane y = 0: start and end (m, 2) in (x, z), all the same way round.

    A vertex on the plane counts as just above it, so that every cut is closed.
    """
    corners = vertices[triangles]
    above = corners[:, :, 1] >= 0.0
    corners, above = corners[above.any(axis=1) & ~above.all(axis=1)], above[above.any(axis=1) & ~above.all(axis=1)]
    following = np.roll(corners, -1, axis=1)

    def cut(crossing: np.ndarray) -> np.ndarray:
        first, second = corners[crossing], following[crossing]
        share = first[:, 1] / (first[:, 1] - second[:, 1])
        return (first + share[:, None] * (second - first))[:, [0, 2]]

    later = np.roll(above, -1, axis=1)
    return cut(above & ~later), cut(~above & later)


FORMATS = (".stl", ".obj", ".ply", ".off")  # archives are not among them: what comes out of them has no limit
MOST_BYTES = 500e6  # of a mesh file; ten million triangles of a binary STL


def mesh_solid(
    path: str | Path, dimension: int, source: object = "", key: str = "tank.bathymetry", crop: Crop | None = None
) -> Solid:
    """A mesh file (STL, OBJ, PLY) as fixed solid ground [m]; in two dimensions its section by y = 0. Cavities in it may
    hold fluid, as a vessel's do. Particles are laid only within the box `crop`, two corners (dim,) [m].

    Raises SceneError for a file that is missing, unreadable, open, or misses the plane y = 0.
    """
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"no file {str(path)!r}", key=key, file=source, fix="give the path of an STL, OBJ or PLY file")
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"{path.suffix!r} is no mesh format read here", file=path, fix=READABLE)
    check_bytes(path, MOST_BYTES, "export it with fewer triangles, as binary STL")
    trimesh = require("trimesh", "bodies", "a bathymetry")
    try:
        loaded = trimesh.load_mesh(path)
    except Exception as error:  # each format raises its own kind
        raise SceneError(f"cannot be read as a mesh ({error})", file=path, fix=READABLE) from None
    vertices, faces = np.array(loaded.vertices, dtype=float), np.array(loaded.faces)
    if len(faces) == 0:
        raise SceneError("holds no triangles", file=path, fix=READABLE)
    found = sound(vertices, faces, file=path)
    if crop is not None:
        crop = np.array(crop[0], float), np.array(crop[1], float)
        _check_crop(vertices, crop, key, path, dimension)
    parts = found.hollow if found.overlap is not None else [np.concatenate(found.hollow)]
    solids = [solid for part in parts if (solid := _ground(vertices, part, dimension, crop)) is not None]
    if not solids:
        raise SceneError("does not meet the plane y = 0 of the 2D scene", file=path, fix="move it along y")
    return solids[0] if len(solids) == 1 else Together(solids)


def _ground(vertices: np.ndarray, triangles: np.ndarray, dimension: int, crop: Crop | None) -> Placed | None:
    """A shell of the ground; None where a section misses it."""
    if dimension == 3:
        surface = mesh(vertices, triangles)
    else:
        start, end = section(vertices, triangles)
        if len(start) == 0:
            return None
        surface = polygon(start, end)
    surface.crop = crop
    return Placed(surface, np.zeros(dimension), np.eye(dimension))


def _check_crop(vertices: np.ndarray, crop: Crop, key: str, path: Path, dimension: int) -> None:
    """Raise SceneError for ground that does not meet the box around the tank."""
    axes = [0, 2] if dimension == 2 else [0, 1, 2]
    low, high = vertices.min(axis=0)[axes], vertices.max(axis=0)[axes]
    for k, axis in enumerate(axes):
        if low[k] > crop[1][k] or high[k] < crop[0][k]:
            fault = f"lies beside the tank: {'xyz'[axis]} = {low[k]:.4g} to {high[k]:.4g} m"
            fault += f" where the tank with its walls has {crop[0][k]:.4g} to {crop[1][k]:.4g} m"
            fix = "move it"
            if (high - low).max() > 20 * (crop[1] - crop[0]).max():
                fix += "; if the file is in millimetres, scale it by 0.001"
            raise SceneError(fault, key=key, file=path, fix=fix)


def sound(vertices: np.ndarray, triangles: np.ndarray, key: str = "", file: object = "") -> Shells:
    """The shells of a mesh that a body can be made of. Raises SceneError for one that is open, flat or turned, or that runs
    through itself."""
    check_closed(vertices, triangles, key, file)
    found = shells(vertices, triangles)
    if found.crossing is not None:
        fault = f"mesh runs through itself near {at(found.crossing)}, so that its inside is not certain"
        raise SceneError(fault, key=key, file=file, fix=f"make it one surface without overlaps {BY_HAND}")
    if found.mixed:
        raise SceneError(
            "some of the mesh's closed parts are inside out", key=key, file=file, fix=f"turn them {BY_HAND}"
        )
    return found


def at(point: np.ndarray) -> str:
    """A place in words."""
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"


def check_closed(vertices: np.ndarray, triangles: np.ndarray, key: str = "", file: object = "") -> None:
    """Raise SceneError unless the mesh encloses a volume and its triangles agree on which side that is."""
    edges = _edges(vertices, triangles)
    if len(edges) == 0:
        fix = "export it as triangles of a closed surface"
        raise SceneError("mesh has no triangle with an area", key=key, file=file, fix=fix)
    _, count = np.unique(_number(np.sort(edges, axis=1)), return_counts=True)
    if loose := int((count != 2).sum()):
        fix = f"repair it {BY_HAND}, or build the body of geoms of type box, cylinder, capsule and sphere"
        raise SceneError(f"mesh is not watertight ({loose} open edges)", key=key, file=file, fix=fix)
    _, count = np.unique(_number(edges), return_counts=True)
    if turned := int((count > 1).sum()):
        fix = f"turn the normals to one side {BY_HAND}"
        raise SceneError(f"triangles face different ways (across {turned} edges)", key=key, file=file, fix=fix)


def _number(edges: np.ndarray) -> np.ndarray:
    """One number (k,) for each of the edges (k, 2)."""
    return edges[:, 0] * (edges.max(initial=0) + 1) + edges[:, 1]


def _edges(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Edges (k, 2) as the triangles run through them, by vertex numbers after merging; without degenerate triangles."""
    corners = merged(vertices)[triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
