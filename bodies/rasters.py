"""Files of heights: rasters (ESRI ASC, GeoTIFF, XYZ on a lattice), scattered XYZ points, and profiles along a line."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Protocol

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.scene.model import GRIDS
from fsi.trust import check_bytes

MOST = 50e6  # cells that are read
MOST_BYTES = 500e6  # of heights as text
STRAIGHT = 1e-6  # width of a line over its length
HEADER = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value")
Window = tuple[np.ndarray, np.ndarray]  # lowest and highest corner of a rectangle, each (2,) [m]


class Heights(Protocol):
    """Heights over the rectangle from `low` to `high`, each (2,) [m]."""

    low: np.ndarray
    high: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Heights (n,) at points (n, 2) [m], nan where there are none."""


@dataclass
class Raster:
    """Heights z (n, m) at the centres of cells of the sizes `cell` (2,), the first one at `first` (2,) [m]; nan where there is
    no data. Between the centres they are bilinear; a cell's outer half is as high as its centre."""

    first: np.ndarray
    cell: np.ndarray
    z: np.ndarray
    low: np.ndarray = None
    high: np.ndarray = None

    def __post_init__(self):
        if self.low is None:
            self.low = self.first - 0.5 * self.cell
            self.high = self.low + self.cell * self.z.shape

    def at(self, points: np.ndarray) -> np.ndarray:
        last = np.array(self.z.shape) - 1
        place = (points - self.first) / self.cell
        outside = np.any((place < -0.5 - 1e-9) | (place > last + 0.5 + 1e-9), axis=1)
        place = np.clip(place, 0.0, last)
        i, j = np.minimum(place.astype(int), np.maximum(last - 1, 0)).T
        s, t = place[:, 0] - i, place[:, 1] - j
        total = np.zeros(len(points))
        for a, u in ((i, 1 - s), (np.minimum(i + 1, last[0]), s)):
            for b, v in ((j, 1 - t), (np.minimum(j + 1, last[1]), t)):
                weight = u * v
                total += np.where(
                    weight > 1e-9, weight * self.z[a, b], 0.0
                )  # a corner that does not count may be missing
        return np.where(outside, np.nan, total)

    def coarser(self, size: float) -> Raster:
        """Means over whole cells, up to cells of a `size` [m], so that nothing smaller than that is lost between places."""
        many = np.maximum(1, np.floor(size / self.cell + 1e-6).astype(int))
        shape = np.array(self.z.shape) // many
        if (many == 1).all() or (shape < 2).any():
            return self
        cut = self.z[: shape[0] * many[0], : shape[1] * many[1]]
        parts = cut.reshape(shape[0], many[0], shape[1], many[1])
        known = ~np.isnan(parts)
        count = known.sum(axis=(1, 3))
        mean = np.where(known, parts, 0.0).sum(axis=(1, 3)) / np.maximum(count, 1)
        z = np.where(2 * count >= many.prod(), mean, np.nan)
        return Raster(self.first + 0.5 * (many - 1) * self.cell, self.cell * many, z, self.low, self.high)


class Scattered:
    """Heights between points (n, 3), linear on their Delaunay triangles."""

    def __init__(self, points: np.ndarray):
        require("scipy", "geo", "a bathymetry of scattered points")
        from scipy.interpolate import LinearNDInterpolator

        self.low, self.high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        self._interpolate = LinearNDInterpolator(points[:, :2] - self.low, points[:, 2])

    def at(self, points: np.ndarray) -> np.ndarray:
        return self._interpolate(points - self.low)


class Transect:
    """Heights along the straight line that points (n, 3) lie on, linear between them and the same across it."""

    def __init__(self, points: np.ndarray, along: np.ndarray):
        self.low, self.high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        self._along, self._first = along, points[0, :2]
        self._place, which = np.unique((points[:, :2] - self._first) @ along, return_inverse=True)
        self._z = np.bincount(which, points[:, 2]) / np.bincount(which)  # a place that is given twice has their mean

    def at(self, points: np.ndarray) -> np.ndarray:
        return np.interp((points - self._first) @ self._along, self._place, self._z, left=np.nan, right=np.nan)


def read(path: Path, window: Window, size: float) -> Heights:
    """The heights of a grid file around the `window`, averaged to cells of at most `size` [m]. Raises SceneError for a file
    that is missing or malformed."""
    if not path.is_file():
        raise SceneError(f"no file {str(path)!r}", key="tank.bathymetry", fix="give the path of a grid or a mesh")
    kind = path.suffix.lower()
    if kind not in GRIDS:
        raise SceneError(f"{kind!r} is no grid", key="tank.bathymetry", file=path, fix=f"use one of {', '.join(GRIDS)}")
    if kind in (".tif", ".tiff"):
        found = _tiff(path, window)
    else:
        check_bytes(
            path, MOST_BYTES, "cut it to the tank, or save it as GeoTIFF, of which only the tank's part is read"
        )
        found = _asc(path) if kind == ".asc" else _xyz(path)
    return found.coarser(size) if isinstance(found, Raster) else found


def _asc(path: Path) -> Raster:
    """ESRI ASCII grid: a header of keys and values, then rows from north to south."""
    header: dict[str, float] = {}
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if len(words) != 2 or words[0].lower() not in HEADER:
                break
            header[words[0].lower()] = _number(words[1], words[0], path)
    for key in ("ncols", "nrows"):
        if not header.get(key, 0) >= 2:
            raise _malformed(f"its header has no {key} of 2 or more", path)
    columns, rows = int(header["ncols"]), int(header["nrows"])
    if columns * rows > MOST:
        raise SceneError(f"{columns} x {rows} cells", file=path, fix=f"cut it to {MOST:.0e} cells")
    cell = np.array([header.get("dx", header.get("cellsize", 0)), header.get("dy", header.get("cellsize", 0))])
    corner = np.array([header.get("xllcorner", np.nan), header.get("yllcorner", np.nan)]) + 0.5 * cell
    centre = np.array([header.get("xllcenter", np.nan), header.get("yllcenter", np.nan)])
    first = np.where(np.isnan(centre), corner, centre)
    if np.isnan(first).any() or not (cell > 0).all():
        raise _malformed("its header lacks xllcorner, yllcorner (or xllcenter, yllcenter) or a positive cellsize", path)
    values = _numbers(path, len(header)).ravel()
    if len(values) != columns * rows:
        raise _malformed(f"{len(values)} values for {columns} columns x {rows} rows", path)
    z = values.reshape(rows, columns)[::-1].T
    return Raster(first, cell, np.where(z == header.get("nodata_value", -9999.0), np.nan, z))


def _xyz(path: Path) -> Heights:
    """Lines of x y z, a header line allowed; a lattice where their places fill one."""
    with path.open(encoding="utf-8", errors="replace") as lines:
        head = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    skip = 0 if _is_number(head.replace(",", " ").replace(";", " ").split()[:1]) else 1
    points = _numbers(path, skip)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise _malformed(f"{points.shape[-1] if points.ndim == 2 else 0} columns", path, "give lines of x y z [m]")
    x, y = (np.unique(points[:, k]) for k in (0, 1))
    steps = [np.diff(axis) for axis in (x, y)]
    even = all(len(step) and np.allclose(step, step.mean(), rtol=0.01) for step in steps)
    if not even or len(x) * len(y) > 4 * len(points):
        return _transect(points, path) or Scattered(points)
    z = np.full((len(x), len(y)), np.nan)
    z[np.searchsorted(x, points[:, 0]), np.searchsorted(y, points[:, 1])] = points[:, 2]
    return Raster(np.array([x[0], y[0]]), np.array([step.mean() for step in steps]), z)


def _transect(points: np.ndarray, path: Path) -> Transect | None:
    """The points (n, 3) as a profile, None where they do not lie on one line."""
    spread, axes = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), full_matrices=False)[1:]
    if spread[0] == 0.0:
        raise _malformed("all points lie at one place", path, "give lines of x y z [m]")
    return Transect(points, axes[0]) if spread[1] < STRAIGHT * spread[0] else None


def _tiff(path: Path, window: Window) -> Raster:
    """First band of a GeoTIFF in metres, north up; only what lies around the window is read."""
    rasterio = require("rasterio", "geo", "a bathymetry of GeoTIFF")
    from rasterio.windows import Window as Part

    try:
        source = rasterio.open(path)
    except rasterio.errors.RasterioIOError as error:
        raise SceneError(f"cannot be read as GeoTIFF ({error})", file=path, fix="export it again") from None
    with source:
        _check_projection(source, path)
        where = source.transform
        cell = np.array([where.a, -where.e])
        corner = np.array([where.c, where.f])
        low, high = window[0] - 2 * cell, window[1] + 2 * cell
        i = np.clip([(low[0] - corner[0]) / cell[0], (high[0] - corner[0]) / cell[0]], 0, source.width)
        j = np.clip([(corner[1] - high[1]) / cell[1], (corner[1] - low[1]) / cell[1]], 0, source.height)
        (a, b), (c, d) = ((int(np.floor(k[0])), int(np.ceil(k[1]))) for k in (i, j))
        if (b - a) * (d - c) > MOST:
            raise SceneError(f"{b - a} x {d - c} cells in the tank", file=path, fix=f"resample it to {MOST:.0e} cells")
        size = cell * (source.width, source.height)
        limits = corner - size * (0, 1), corner + size * (1, 0)
        if b <= a or d <= c:
            return Raster(limits[0] + 0.5 * cell, cell, np.full((2, 2), np.nan), *limits)
        band = source.read(1, window=Part(a, c, b - a, d - c), masked=True).astype(float)
    z = np.ma.filled(band, np.nan)[::-1].T
    first = np.array([corner[0] + (a + 0.5) * cell[0], corner[1] - (d - 0.5) * cell[1]])
    return Raster(first, cell, z, *limits)


def _check_projection(source, path: Path) -> None:
    """Raise SceneError for a GeoTIFF whose coordinates are no metres, or that is turned."""
    if source.crs and source.crs.is_geographic:
        fix = "project it to metres first: gdalwarp -t_srs EPSG:... FILE"
        raise SceneError(f"its coordinates are degrees ({source.crs})", file=path, fix=fix)
    if source.crs and abs(source.crs.linear_units_factor[1] - 1.0) > 1e-6:
        unit = source.crs.linear_units
        raise SceneError(
            f"its coordinates are in {unit}", file=path, fix="project it to metres: gdalwarp -t_srs EPSG:..."
        )
    where = source.transform
    if where.b or where.d or where.a <= 0 or where.e >= 0:
        fix = "resample it north up: gdalwarp FILE NEW.tif"
        raise SceneError("it has no place in metres, or is not north up", file=path, fix=fix)


def _numbers(path: Path, skip: int) -> np.ndarray:
    """A table of numbers, after `skip` lines; blanks, commas or semicolons between them."""
    try:
        with path.open(encoding="utf-8", errors="replace") as lines:
            rows = (line.replace(",", " ").replace(";", " ") for line in islice(lines, skip, None))
            return np.loadtxt(rows, ndmin=2)
    except ValueError as error:
        raise _malformed(f"holds something that is no number ({str(error).partition(';')[0]})", path) from None


def _is_number(words: list[str]) -> bool:
    try:
        return bool(words) and float(words[0]) is not None
    except ValueError:
        return False


def _number(text: str, key: str, path: Path) -> float:
    if not _is_number([text]):
        raise _malformed(f"its header's {key} is {text!r}", path)
    return float(text)


def _malformed(fault: str, path: Path, fix: str = "export it again") -> SceneError:
    return SceneError(fault, file=path, fix=fix)
