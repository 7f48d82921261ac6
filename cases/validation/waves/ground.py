"""Ground as a closed mesh, from heights on a grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def block(file: Path, x: np.ndarray, y: np.ndarray, z: np.ndarray, floor: float) -> None:
    """Write the ground between heights z (n, m) over x (n,) and y (m,), both ascending, and the plane z = `floor` to an STL
    file [m]."""
    import trimesh

    trimesh.Trimesh(*grid(x, y, z, floor)).export(file)


def grid(x: np.ndarray, y: np.ndarray, z: np.ndarray, floor: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles, outward, of the same."""
    n, m = z.shape
    flat = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    vertices = np.concatenate([np.column_stack([flat, z.ravel()]), np.column_stack([flat, np.full(n * m, floor)])])
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    top = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    rim = np.concatenate([number[:, 0], number[-1, 1:], number[-2::-1, -1], number[0, -2:0:-1]])
    after = np.roll(rim, -1)
    sides = np.concatenate([np.stack([rim, rim + n * m, after + n * m], -1), np.stack([rim, after + n * m, after], -1)])
    return vertices, np.concatenate([top, top[:, ::-1] + n * m, sides])
