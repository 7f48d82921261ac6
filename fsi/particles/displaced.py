"""The water that bodies displace, as cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsi.protocols import Solid


def cells(solids: Sequence[Solid], most: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Places (c, dim) [m] and sizes (c,) [m3; m2 in two dimensions] of cells of the union of solids, and how far they are apart
    [m], about `most` in the box around all. Solids that overlap count once; a cell at the surface counts in part."""
    bounds = [solid.bounds() for solid in solids if hasattr(solid, "bounds")]
    low = np.min([one for one, _ in bounds], axis=0)
    high = np.max([one for _, one in bounds], axis=0)
    dim, span = len(low), high - low
    step = float((np.prod(span) / most) ** (1 / dim))
    counts = np.ceil(span / step).astype(int) + 2
    first = (low + high) / 2 - 0.5 * (counts - 1) * step
    points = first + step * np.indices(counts).reshape(dim, -1).T
    clearance = np.min([solid.clearance(points) for solid in solids], axis=0)
    share = np.clip(0.5 - clearance / step, 0.0, 1.0)
    return points[share > 0], share[share > 0] * step**dim, step
