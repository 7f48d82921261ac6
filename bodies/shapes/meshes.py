"""Closed triangle meshes and their plane sections as solids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from bodies.shapes import layers as layering
from bodies.shapes.distance import TriangleTree, nearest_segment
from bodies.shapes.primitives import Placed
from fsi.errors import SceneError
from fsi.protocols import Solid

Crop = tuple[np.ndarray, np.ndarray]  # lowest and highest corner of a box, each (dim,) [m]


class Surface:
    """A closed surface with a distance function. `mean_thickness` is volume over half the surface [m]; particles are
    laid only within `crop`."""

    def __init__(self, nearest: layering.Nearest, vertices: np.ndarray, mean_thickness: float):
        self._nearest, self._finest = nearest, mean_thickness / 3
        self.crop: Crop | None = None
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
        beyond = np.linalg.norm(np.maximum(np.maximum(lower - points, points - upper), 0.0), axis=1)
        close = beyond < 0.25 * (upper - lower).max()
        beyond[close] = self._nearest(points[close])[0]
        return beyond

    def thickness(self, spacing: float) -> float:
        """Diameter of the largest ball inside [m], told apart up to two and a half spacings."""
        return 2 * layering.deepest(self._nearest, *self._bounds, spacing, self._finest)


def mesh(vertices: np.ndarray, triangles: np.ndarray) -> Surface:
    """A closed mesh in three dimensions: vertices (n, 3) [m], triangles (m, 3) that all run the same way round."""
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


def mesh_solid(
    path: str | Path, dimension: int, source: object = "", key: str = "tank.bathymetry", crop: Crop | None = None
) -> Solid:
    """A mesh file (STL, OBJ, PLY) as fixed solid ground [m]; in two dimensions its section by y = 0. Particles are laid
    only within the box `crop`, two corners (dim,) [m].

    Raises SceneError for a file that is missing, unreadable, open, or misses the plane y = 0.
    """
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"no file {str(path)!r}", key=key, file=source, fix="give the path of an STL, OBJ or PLY file")
    try:
        loaded = trimesh.load_mesh(path)
    except Exception as error:  # each format raises its own kind
        raise SceneError(f"cannot be read as a mesh ({error})", file=path, fix="export it as STL, OBJ or PLY") from None
    vertices, faces = np.array(loaded.vertices, dtype=float), np.array(loaded.faces)
    if len(faces) == 0:
        raise SceneError("holds no triangles", file=path, fix="export it as STL, OBJ or PLY")
    check_closed(vertices, faces, file=path)
    if dimension == 3:
        surface = mesh(vertices, faces)
        surface.crop = crop
        return Placed(surface, np.zeros(3), np.eye(3))
    start, end = section(vertices, faces)
    if len(start) == 0:
        raise SceneError("does not meet the plane y = 0 of the 2D scene", file=path, fix="move it along y")
    surface = polygon(start, end)
    surface.crop = crop
    return Placed(surface, np.zeros(2), np.eye(2))


def open_edges(vertices: np.ndarray, triangles: np.ndarray) -> int:
    """Number of edges that do not join exactly two triangles, vertices (n, 3) at one place counted as one."""
    _, count = np.unique(np.sort(_edges(vertices, triangles), axis=1), axis=0, return_counts=True)
    return int((count != 2).sum())


def check_closed(vertices: np.ndarray, triangles: np.ndarray, key: str = "", file: object = "") -> None:
    """Raise SceneError unless the mesh encloses a volume and its triangles agree on which side that is."""
    fix = "repair it, for instance with trimesh.repair or a CAD program"
    if edges := open_edges(vertices, triangles):
        raise SceneError(f"mesh is not watertight ({edges} open edges)", key=key, file=file, fix=fix)
    _, count = np.unique(_edges(vertices, triangles), axis=0, return_counts=True)
    if turned := int((count > 1).sum()):
        raise SceneError(f"triangles face different ways (across {turned} edges)", key=key, file=file, fix=fix)


def _edges(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Edges (k, 2) as the triangles run through them, by vertex numbers after merging; without degenerate triangles."""
    _, merged = np.unique(vertices, axis=0, return_inverse=True)
    corners = merged.reshape(-1)[triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
