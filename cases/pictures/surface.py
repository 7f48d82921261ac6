"""The surface of the fluid, reconstructed from its particles."""

from __future__ import annotations

import numpy as np

from cases.pictures.frames import Mesh
from fsi.extras import require
from fsi.sph.kernel import value

WATER = (60, 130, 190)
SMOOTH = 1.2  # smoothing length [spacing]; with THRESHOLD a block of 15 spacings keeps its volume within 1 %
THRESHOLD = 0.6  # density at the surface over that of the fluid, in three dimensions
HALF = 0.5  # share of fluid at the surface, in two dimensions


def surface(position: np.ndarray, spacing: float, dimension: int) -> Mesh:
    """Surface of particles at `position` (n, 3): triangles in three dimensions, by splashsurf's marching cubes over the
    kernel's density (Loeschner et al. 2023); in two the line in y = 0 on which the interpolated share of fluid is a half."""
    if len(position) == 0:
        return Mesh(np.empty((0, 3)), np.empty((0, dimension), int), WATER)
    if dimension == 2:
        return _line(position[:, [0, 2]].astype(float), spacing)
    splash = require("pysplashsurf", "surface", "the surface of a three-dimensional run")
    radius = 0.5 * spacing
    found = splash.reconstruct_surface(  # in radii: versions differ in whether lengths are relative to them
        np.ascontiguousarray(position, np.float64) / radius, particle_radius=1.0, smoothing_length=2 * SMOOTH,
        cube_size=1.0, iso_surface_threshold=THRESHOLD,
    )  # fmt: skip
    return Mesh(radius * np.array(found.mesh.vertices), np.array(found.mesh.triangles).astype(int), WATER)


def _line(position: np.ndarray, spacing: float) -> Mesh:
    contourpy = require("contourpy", "report", "the surface of a two-dimensional run")
    cell, h = 0.5 * spacing, SMOOTH * spacing
    reach = int(np.ceil(2 * h / cell))
    low = position.min(0) - (reach + 2) * cell
    shape = np.ceil((position.max(0) - low) / cell).astype(int) + reach + 3
    share = np.zeros(shape)
    home = np.floor((position - low) / cell).astype(int)
    for i in range(-reach, reach + 2):
        for j in range(-reach, reach + 2):
            node = home + np.array([i, j])
            r = np.linalg.norm(low + node * cell - position, axis=1)
            np.add.at(share, (node[:, 0], node[:, 1]), value(r, h, 2) * spacing**2)
    x, z = (low[d] + np.arange(shape[d]) * cell for d in (0, 1))
    lines = contourpy.contour_generator(x, z, share.T).lines(HALF)
    vertices, cells, first = [], [], 0
    for line in lines:
        vertices.append(np.column_stack([line[:, 0], np.zeros(len(line)), line[:, 1]]))
        number = first + np.arange(len(line))
        cells.append(np.column_stack([number[:-1], number[1:]]))
        first += len(line)
    if not vertices:
        return Mesh(np.empty((0, 3)), np.empty((0, 2), int), WATER)
    return Mesh(np.concatenate(vertices), np.concatenate(cells), WATER)
