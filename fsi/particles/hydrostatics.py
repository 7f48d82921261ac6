"""Pressure at the start of fluid on a lattice: the weight of what stands above, continued sideways under overhangs.

The cells of the lattice form columns. A column that ends at the top of a block is open, and its pressure there is zero. One
that ends under a solid takes the pressure of a neighbouring column at the same height, and so on through every passage; water
that no open column reaches is sealed in and starts from its own highest place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsi.protocols import Solid

PASSAGE = 0.5  # clearance [spacing] from which on no solid stands between a cell and its neighbours


@dataclass(frozen=True)
class Cells:
    """Fluid on a lattice from `origin` (dim,) on with this spacing (dim,) [m].

    position (n, dim); density (n,) [kg/m3]; top (n,): height at which the block of each ends; clearance (n,) from `solids`."""

    position: np.ndarray
    density: np.ndarray
    top: np.ndarray
    clearance: np.ndarray
    solids: list[Solid]
    origin: np.ndarray
    spacing: np.ndarray


def pressure(cells: Cells, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Hydrostatic pressure (n,) [Pa], and the number (n,) of the sealed pocket of each, 0 for all other water."""
    z, dr, density = cells.position[:, -1], cells.spacing[-1], cells.density
    *sideways, above = _neighbours(cells)
    head = _heads(above)  # the number of a column is that of its highest cell
    opened = z > cells.top - dr * (1 + 1e-6)  # of the columns, as all that follows but `weight`
    uniform = np.ptp(density) == 0.0
    if uniform:  # p = rho g (level - z) with one level for a column
        weight, value, sealed = np.zeros(len(z)), cells.top.copy(), z + 0.5 * dr
    else:  # p = g (load + weight), the weight per area from the top of the column down
        first = np.where(opened, cells.top - z, 0.5 * dr) * density
        weight, value, sealed = _weights(cells, head, first[head]), np.zeros(len(z)), np.zeros(len(z))
    value = np.where(opened, value, -np.inf)
    known, pocket, count = opened, np.zeros(len(z), int), 0
    pairs = [np.stack([a := np.flatnonzero(n >= 0), n[a]]) for n in sideways]
    pairs = np.concatenate([np.concatenate([p, p[::-1]], 1) for p in pairs], 1)
    pairs = _spread(value, known, head, weight, pairs)
    rest = np.flatnonzero(~known[head])
    while len(rest):
        top = rest[np.argmax(z[rest])]
        value[top], known[top], count = sealed[top], True, count + 1
        pairs = _spread(value, known, head, weight, pairs)
        reached = known[head[rest]]
        pocket[rest[reached]] = count
        rest = rest[~reached]
    found = density * gravity * (value[head] - z) if uniform else gravity * (value[head] + weight)
    return found, pocket


def nearest(cells: np.ndarray, points: np.ndarray, origin: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """The cell, of those at `cells` (m, dim), m > 0, that each of the points (n, dim) is in; one nearby where there is none."""
    key, wanted = (np.floor((values - origin) / spacing + 1e-9).astype(np.int64) for values in (cells, points))
    low, high = np.minimum(key.min(0), wanted.min(0)) - 1, np.maximum(key.max(0), wanted.max(0)) + 2
    stride = np.cumprod([1, *(high - low)])[:-1]
    order = np.argsort(numbers := (key - low) @ stride, kind="stable")
    numbers, goal, found = numbers[order], (wanted - low) @ stride, np.full(len(points), -1)
    steps = np.array(list(np.ndindex(*(3,) * len(stride)))) - 1
    for step in steps[np.argsort((steps**2).sum(1), kind="stable")]:
        at = np.minimum(np.searchsorted(numbers, goal + step @ stride), len(numbers) - 1)
        found = np.where((found < 0) & (numbers[at] == goal + step @ stride), order[at], found)
    for n in np.flatnonzero(found < 0):
        found[n] = np.argmin(((cells - points[n]) ** 2).sum(1))
    return found


def _neighbours(cells: Cells) -> list[np.ndarray]:
    """Number (n,) of the next cell along each axis, -1 where there is none or a solid stands between."""
    index = np.round((cells.position - cells.origin) / cells.spacing - 0.5).astype(np.int64)
    index -= index.min(0)
    stride = np.cumprod([1, *(index.max(0) + 2)[:0:-1]])[::-1]  # in the order of the lattice, so that searches are near
    key = index @ stride
    order = np.argsort(key, kind="stable")
    ordered, found = key[order], []
    near = cells.clearance < PASSAGE * cells.spacing.max()
    for d, step in enumerate(stride):
        at = np.minimum(np.searchsorted(ordered, key + step), len(key) - 1)
        following = np.where(ordered[at] == key + step, order[at], -1)
        doubtful = np.flatnonzero((following >= 0) & (near | near[following]))
        middle = cells.position[doubtful]
        middle[:, d] += 0.5 * cells.spacing[d]
        for solid in cells.solids if len(doubtful) else ():
            following[doubtful[solid.clearance(middle) <= 0.0]] = -1
        found.append(following)
    return found


def _heads(above: np.ndarray) -> np.ndarray:
    """The highest cell (n,) of the column of each cell."""
    head = np.where(above < 0, np.arange(len(above)), above)
    while not np.array_equal(further := head[head], head):
        head = further
    return head


def _weights(cells: Cells, head: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Mass per area (n,) [kg/m2] between the top of a column and the middle of a cell, `first` (n,) that over its head."""
    order = np.lexsort((-cells.position[:, -1], head))
    density, start = cells.density[order], head[order] == order
    step = 0.5 * cells.spacing[-1] * (density + np.roll(density, 1))
    total = np.cumsum(np.where(start, 0.0, step))
    begun = np.maximum.accumulate(np.where(start, np.arange(len(order)), 0))
    weight = np.empty(len(order))
    weight[order] = total - total[begun] + first[order]
    return weight


def _spread(value, known, head, weight, pairs) -> np.ndarray:
    """Carry the value of known columns on to their neighbours, ring by ring; the highest pressure rules. `pairs` (2, k) of
    cells side by side; those whose second column is not reached come back."""
    while True:
        pairs = pairs[:, ~known[head[pairs[1]]]]
        ready = known[head[pairs[0]]]
        if not ready.any():
            return pairs
        a, b = pairs[:, ready]
        np.maximum.at(value, head[b], value[head[a]] + weight[a] - weight[b])
        known[head[b]] = True
