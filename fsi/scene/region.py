"""Where a block of liquid is: in its box, and in its polygon or closed mesh, known by where vertical lines enter and leave it.

That answers all that is asked: what is inside, how high the block reaches over a place, and how much of it stands there.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.scene.model import Block
from fsi.trust import check_bytes

ASIDE = np.array([0.31e-6, 0.17e-6, 1e-6])  # [spacing] that points move along x, y, z, so that none is on a face
MOST_BYTES = 50e6  # of a mesh file
BATCH = 2_000_000  # crossings at a time


def shaped(block: Block) -> bool:
    """Whether it is something else than its box."""
    return bool(block.polygon) or block.mesh is not None


def contains(block: Block, points: np.ndarray, spacing: float) -> np.ndarray:
    """Which of the points (n, dim) are in the block. A point on a face is in just one of two blocks that share it."""
    inside = ((points > np.array(block.min)) & (points < np.array(block.max))).all(1)
    if shaped(block) and inside.any():
        near = points[inside]
        low, high = spans(block, near, spacing)
        z = near[:, -1:] + ASIDE[-1] * spacing
        inside[inside] = ((low < z) & (z < high)).any(1)
    return inside


def spans(block: Block, points: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """The heights low, high (n, k) between which the verticals through points (n, dim) are in the block; `low` is above `high`
    where there are fewer than k."""
    floor, top = block.min[-1], block.max[-1]
    under = ((points[:, :-1] > np.array(block.min[:-1])) & (points[:, :-1] < np.array(block.max[:-1]))).all(1)
    if not shaped(block):
        return np.where(under, floor, np.inf)[:, None], np.where(under, top, -np.inf)[:, None]
    across = points[:, :-1] + ASIDE[: points.shape[1] - 1] * spacing
    columns, which = np.unique(across, axis=0, return_inverse=True)
    crossed = np.sort(_polygon(block, columns) if block.polygon else _mesh(block.mesh, columns), 1)[which.ravel()]
    crossed[~under] = np.inf
    low, high = crossed[:, ::2], crossed[:, 1::2]
    low, high = np.maximum(low, floor), np.minimum(high, top)
    empty = ~(low < high)
    return np.where(empty, np.inf, low), np.where(empty, -np.inf, high)


def top(block: Block, points: np.ndarray, spacing: float) -> np.ndarray:
    """Height (n,) at which the block ends above points (n, dim) inside of it."""
    low, high = spans(block, points, spacing)
    z = points[:, -1:] + ASIDE[-1] * spacing
    return np.where((low < z) & (z < high), high, -np.inf).max(1)


def volume(block: Block, samples: int = 128) -> float:
    """Volume of the block [m3], or its area in two dimensions [m2]; that of a shape by so many verticals along each axis."""
    sides = np.subtract(block.max, block.min)
    if not shaped(block):
        return float(np.prod(sides))
    places = [a + (np.arange(samples) + 0.5) * d / samples for a, d in zip(block.min[:-1], sides[:-1], strict=True)]
    grid = np.stack(np.meshgrid(*places, indexing="ij"), -1).reshape(-1, len(places))
    low, high = spans(block, np.column_stack([grid, np.zeros(len(grid))]), 0.0)
    return float(np.where(low < high, high - low, 0.0).sum(1).mean() * np.prod(sides[:-1]))


def corners(block: Block) -> np.ndarray:
    """Points (n, 2), x and z, whose hull holds the block."""
    box = np.array([(x, z) for x in (block.min[0], block.max[0]) for z in (block.min[-1], block.max[-1])])
    if block.polygon:
        return np.array(block.polygon)
    return box


def _polygon(block: Block, columns: np.ndarray) -> np.ndarray:
    """Heights (n, sides) at which verticals at `columns` (n, dim - 1) cross the sides of the polygon, infinite where not."""
    a = np.array(block.polygon)
    b = np.roll(a, -1, 0)
    batch = max(1, BATCH // len(a))
    found = []
    for x in np.split(columns[:, :1], range(batch, len(columns), batch)):
        met = (a[:, 0] <= x) != (b[:, 0] <= x)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (x - a[:, 0]) / (b[:, 0] - a[:, 0])
            found.append(np.where(met, a[:, 1] + share * (b[:, 1] - a[:, 1]), np.inf))
    return _packed(np.concatenate(found))


def _mesh(file: Path, columns: np.ndarray) -> np.ndarray:
    """The same for a closed mesh; in two dimensions for its section y = 0."""
    if not file.is_file():
        raise SceneError("no such file", file=file, fix="check the path; it is relative to the scene file")
    triangles = read_mesh(file, file.stat().st_mtime_ns)
    if columns.shape[1] == 1:
        columns = np.column_stack([columns, np.full(len(columns), 1e-9 * np.ptp(triangles))])
    order = np.argsort(columns[:, 0], kind="stable")
    x, y = columns[order].T
    first = np.searchsorted(x, triangles[:, :, 0].min(1))
    last = np.searchsorted(x, triangles[:, :, 0].max(1), side="right")
    row, height = [np.empty(0, int)], [np.empty(0)]
    for (p, q, r), i, j in zip(triangles, first, last, strict=True):
        u, v = q[:2] - p[:2], r[:2] - p[:2]
        if i == j or (det := u[0] * v[1] - u[1] * v[0]) == 0.0:
            continue
        dx, dy = x[i:j] - p[0], y[i:j] - p[1]
        s, t = (dx * v[1] - dy * v[0]) / det, (u[0] * dy - u[1] * dx) / det
        met = (s >= 0) & (t >= 0) & (s + t <= 1)
        row.append(i + np.flatnonzero(met))
        height.append(p[2] + s[met] * (q[2] - p[2]) + t[met] * (r[2] - p[2]))
    row, height = order[np.concatenate(row)], np.concatenate(height)
    count = np.bincount(row, minlength=len(columns))
    if (count % 2).any():
        at = columns[np.argmax(count % 2)]
        where = f"the vertical at x = {at[0]:.4g}, y = {at[1]:.4g} m enters it and never leaves"
        raise SceneError(f"is not closed: {where}", file=file, fix="close its holes")
    found = np.full((len(columns), max(2, count.max(initial=0))), np.inf)
    order = np.argsort(row, kind="stable")
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    found[row[order], place] = height[order]
    return found


def _packed(crossed: np.ndarray) -> np.ndarray:
    """The same crossings (n, k) of as few columns as they need, an even number."""
    crossed = np.sort(crossed, 1)
    most = max(2, int(np.isfinite(crossed).sum(1).max(initial=0)))
    return crossed[:, : most + most % 2]


@lru_cache(maxsize=4)
def read_mesh(file: Path, stamp: int) -> np.ndarray:
    """Triangles (m, 3, 3) of a mesh file [m]. Raises SceneError where it cannot be read."""
    check_bytes(file, MOST_BYTES, "export it with fewer triangles, as binary STL")
    trimesh = require("trimesh", "bodies", "a block of fluid from a mesh")
    try:
        mesh = trimesh.load_mesh(file)
        triangles = np.asarray(mesh.triangles, float)
    except Exception as fault:  # the readers raise whatever they like
        raise SceneError(f"cannot be read as a mesh: {fault}", file=file, fix="give an STL, OBJ or PLY file") from None
    if not len(triangles) or not np.isfinite(triangles).all():
        raise SceneError("has no triangles, or some without numbers", file=file, fix="give a closed mesh")
    if not mesh.is_watertight:
        raise SceneError("is not closed: some edges belong to one triangle only", file=file, fix="close its holes")
    return triangles
