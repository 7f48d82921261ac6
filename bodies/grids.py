"""Bathymetry from a grid of heights (XYZ, ESRI ASC, GeoTIFF): read, placed in the tank by `tank.grid`, made solid ground."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from bodies.rasters import Heights, read
from bodies.shapes.meshes import Crop
from bodies.shapes.primitives import Placed
from bodies.shapes.terrain import profile, terrain
from fsi.errors import SceneError
from fsi.scene.model import Grid, Scene

KEY = "tank.bathymetry"
BEYOND = 4  # spacings, and twice the layers, that the ground goes on beyond its particles; its sides get none
FAR = 20  # times the tank's height, from which on a relief must be in another unit


def grid_solid(scene: Scene, crop: Crop) -> Placed:
    """The bathymetry file of a scene, a grid, as solid ground at the scene's spacing. Particles are laid only within the box
    `crop`, two corners (dim,) [m].

    Raises SceneError for a file that is missing or malformed, for ground that does not meet the tank, and for places of the
    tank without data."""
    path, place, tank, dr = scene.tank.bathymetry, scene.tank.grid or Grid(), scene.tank, scene.spacing
    low, high = (np.asarray(corner, float) for corner in crop)
    beyond = (BEYOND + 2 * scene.layers) * dr
    sides = [_nodes(a - beyond, b + beyond, dr) for a, b in zip(low[:-1], high[:-1], strict=True)]
    x, y = (*sides, np.zeros(1))[:2]
    where = to_file(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2), place)
    data = read(path, (where.min(axis=0), where.max(axis=0)), dr)
    found = data.at(where).reshape(len(x), len(y))
    inside = (x > tank.min[0] - 0.5 * dr)[:, None] & (x < tank.max[0] + 0.5 * dr)[:, None]
    if scene.dimension == 3:
        inside = inside & ((y > tank.min[1] - 0.5 * dr) & (y < tank.max[1] + 0.5 * dr))
    _check_overlap(data, where[inside.ravel()], found[inside], path)
    gaps = bool(np.isnan(found[inside]).any())
    if place.missing is not None:
        found = np.where(np.isnan(found), place.missing, found)
    _check_missing(found, inside, x, y, path)
    heights = _filled((-found if place.depths else found) - place.level)
    _check_height(heights[inside], scene, path)
    bottom = min(float(heights.min()), low[-1]) - 10 * dr
    box = low, high
    solid = terrain(x, y, heights, bottom, box) if scene.dimension == 3 else profile(x, heights[:, 0], bottom, box)
    if place.missing is not None and not gaps:
        solid.notes = ("tank.grid.missing: has no effect: the file has data all over the tank",)
    return solid


def to_file(points: np.ndarray, place: Grid) -> np.ndarray:
    """Points (n, 2) of the tank in the coordinates of the file [m]."""
    angle = math.radians(place.direction)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return points @ turn.T + np.array(place.origin)


def _nodes(low: float, high: float, spacing: float) -> np.ndarray:
    return low + spacing * np.arange(math.ceil((high - low) / spacing - 1e-9) + 1)


def _check_overlap(data: Heights, where: np.ndarray, found: np.ndarray, path: Path) -> None:
    """Raise SceneError where no place of the tank has data."""
    if not np.isnan(found).all():
        return
    (a, c), (b, d) = data.low, data.high
    (e, g), (f, h) = where.min(axis=0), where.max(axis=0)
    fault = f"lies beside the tank: the file covers x = {a:.6g} to {b:.6g} m and y = {c:.6g} to {d:.6g} m, the tank"
    fault += f" x = {e:.6g} to {f:.6g} m and y = {g:.6g} to {h:.6g} m in its coordinates"
    fix = "set tank.grid.origin to the file's coordinates of the tank's x = y = 0, and tank.grid.direction to the turn"
    if a >= -180 and b <= 360 and c >= -90 and d <= 90 and max(b - a, d - c) < 10:
        fix += "; if the file is in degrees, project it to metres first (gdalwarp -t_srs)"
    elif max(b - a, d - c) > FAR * max(f - e, h - g):
        fix += "; if the file is in millimetres, scale it by 0.001"
    raise SceneError(fault, key=KEY, file=path, fix=fix)


def _check_missing(found: np.ndarray, inside: np.ndarray, x: np.ndarray, y: np.ndarray, path: Path) -> None:
    """Raise SceneError for places of the tank without data."""
    gaps = np.isnan(found) & inside
    if gaps.any():
        i, j = np.argwhere(gaps)[0]
        place = f"x = {x[i]:.4g} m" + (f", y = {y[j]:.4g} m" if len(y) > 1 else "")
        fault = f"has no data in {gaps.sum() / inside.sum():.2g} of the tank's area, such as at {place}"
        fix = "shrink or move the tank, fill the file's gaps, or set tank.grid.missing to the height that they have"
        raise SceneError(fault, key=KEY, file=path, fix=fix)


def _check_height(heights: np.ndarray, scene: Scene, path: Path) -> None:
    """Raise SceneError for ground that lies under the tank, or fills it."""
    least, most = float(heights.min()), float(heights.max())
    floor, top = scene.tank.min[-1], scene.tank.max[-1]
    if most > floor - scene.layers * scene.spacing and least < top:
        return
    side = "under the tank's floor" if least < top else "over the tank's top"
    fault = f"has no effect: it lies at z = {least:.4g} to {most:.4g} m, {side} at {floor if least < top else top:g} m"
    if least >= top:
        fault = f"fills the tank: it lies at z = {least:.4g} to {most:.4g} m, {side} at {top:g} m"
    fix = "set tank.grid.level to the file's height of the tank's z = 0, and tank.grid.depths = true if it holds depths"
    if max(most - least, abs(most)) > FAR * (top - floor):
        fix += "; if its heights are in millimetres, scale them by 0.001"
    raise SceneError(fault, key=KEY, file=path, fix=fix)


def _filled(heights: np.ndarray) -> np.ndarray:
    """Heights (n, m) with places without data, which lie beyond the tank, as high as those next to them."""
    while (gaps := np.isnan(heights)).any():
        around = np.pad(heights, 1, constant_values=np.nan)
        sides = np.stack([around[:-2, 1:-1], around[2:, 1:-1], around[1:-1, :-2], around[1:-1, 2:]])
        known = ~np.isnan(sides)
        count = known.sum(axis=0)
        mean = np.where(known, sides, 0.0).sum(axis=0) / np.maximum(count, 1)
        heights = np.where(gaps & (count > 0), mean, heights)
    return heights
