"""Polygons [x, z] as a scene gives them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def crossing_sides(corners: Sequence[Sequence[float]]) -> tuple[int, int] | None:
    """Numbers of two sides of a polygon that cross or touch without being neighbours, of which side k begins at corner k; or of
    two neighbours that lie on each other. None where none do."""
    a = np.array(corners, float)
    b, n = np.roll(a, -1, 0), len(a)
    along = b - a
    after = np.roll(along, -1, 0)
    turn = along[:, 0] * after[:, 1] - along[:, 1] * after[:, 0]
    back = (turn == 0.0) & ((along * after).sum(1) <= 0.0)
    if back.any():
        return (k := int(np.argmax(back))), (k + 1) % n
    for i in range(n - 2):
        j = np.arange(i + 2, n - (i == 0))
        over = _side(a[i], b[i], a[j]) * _side(a[i], b[i], b[j]) <= 0
        over &= _side(a[j], b[j], a[i]) * _side(a[j], b[j], b[i]) <= 0
        low, high = np.minimum(a, b), np.maximum(a, b)
        over &= ((low[i] <= high[j]) & (low[j] <= high[i])).all(1)
        if over.any():
            return i, int(j[np.argmax(over)])
    return None


def _side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """On which side of the line from p to q the point r lies: 1, 0 or -1."""
    u, v = q - p, r - p
    return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
