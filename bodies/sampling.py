"""Particles in layers under a surface: on lattices, on rings, and on any surface with a distance function.

Every particle stands for spacing**dim of volume, and the outermost layer lies half a spacing below the surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit

GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # turn from one ring to the next, so that rings do not line up [rad]

Nearest = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # points -> (signed distance, closest surface point)


def line(length: float, spacing: float) -> np.ndarray:
    """Positions (n,) along a segment centred on 0, stretched so that the outermost lie half a spacing from its ends.
    A segment under 1.5 spacings carries one."""
    count = max(1, math.ceil(length / spacing - 0.5 - 1e-9))
    end = (length - spacing) / 2 if count > 1 else 0.0
    return np.linspace(-end, end, count)


def depths(reach: float, spacing: float, layers: int) -> np.ndarray:
    """Depths (k,) of the layers under a surface whose largest inscribed ball has the radius `reach`, outermost first.
    The innermost is moved to the centre rather than left out or crowded."""
    below = (np.arange(layers) + 0.5) * spacing
    below = below[below < reach + 0.25 * spacing]
    return np.minimum(below, reach) if below.size else np.array([reach])


def box(half: np.ndarray, spacing: float, layers: int) -> np.ndarray:
    """Outer layers (n, dim) of the lattice that fills a box with half sizes `half` (dim,)."""
    axes = [line(2 * h, spacing) for h in half]
    index = np.indices([axis.size for axis in axes])
    count = np.array([axis.size for axis in axes]).reshape(-1, *[1] * len(axes))
    outer = np.minimum(index, count - 1 - index).min(axis=0) < layers
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[outer]


def ring(radius: float, spacing: float, phase: float = 0.0) -> np.ndarray:
    """Even points (n, 2) on a circle."""
    count = max(1, round(2 * math.pi * radius / spacing))
    angle = phase + 2 * math.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def disc(radius: float, spacing: float, layers: int) -> np.ndarray:
    """Concentric rings (n, 2) under the edge of a disc."""
    return np.vstack([ring(radius - d, spacing) for d in depths(radius, spacing, layers)])


def cylinder(radius: float, half: float, spacing: float, layers: int) -> np.ndarray:
    """Concentric rings (n, 3) stacked along z, hollow inside the outer layers."""
    heights = line(2 * half, spacing)
    end = np.minimum(np.arange(heights.size), heights.size - 1 - np.arange(heights.size))
    parts = []
    for layer, depth in enumerate(depths(radius, spacing, math.ceil(radius / spacing) + 1)):
        stack = heights if layer < layers else heights[end < layers]
        circle = ring(radius - depth, spacing, layer * GOLDEN)
        parts.append(np.column_stack([np.tile(circle, (stack.size, 1)), np.repeat(stack, len(circle))]))
    return np.vstack(parts)


def capsule(radius: float, half: float, spacing: float, layers: int) -> np.ndarray:
    """Shells (n, 3) under the surface of a cylinder along z with round ends; a sphere where half = 0."""
    parts = []
    for depth in depths(radius, spacing, layers):
        shell = radius - depth
        arc = math.pi * shell / 2
        meridian = 2 * (arc + half)
        count = max(1, round(meridian / spacing))
        along = (np.arange(count) + 0.5) * meridian / count - meridian / 2
        beyond = np.clip(np.abs(along) - half, 0.0, None)
        turn = beyond / shell if shell > 0 else np.zeros(count)
        height = np.sign(along) * (np.minimum(np.abs(along), half) + shell * np.sin(turn))
        for i, (z, rho) in enumerate(zip(height, shell * np.cos(turn), strict=True)):
            circle = ring(rho, spacing, i * GOLDEN)
            parts.append(np.column_stack([circle, np.full(len(circle), z)]))
    return np.vstack(parts)


def under(
    nearest: Nearest, lower: np.ndarray, upper: np.ndarray, spacing: float, layers: int, finest: float
) -> np.ndarray:
    """Particles (n, dim) in layers under any closed surface within the box `lower` to `upper` (dim,).

    Lattice points, several per particle, slide along the normal onto their layer and are thinned to even distances,
    so many that each layer has the volume it stands for. Where the solid is too thin for a layer they end half way
    through it: the first layer then counts by area, deeper ones are left out. `finest` [m] is a lattice that resolves
    the thinnest part.
    """
    step = min(spacing / (2 if len(lower) == 3 else 8), finest)
    points = near(nearest, lower, upper, layers * spacing, step)
    depth = -nearest(points)[0]
    parts = []
    for layer in range(layers):
        target = (layer + 0.5) * spacing
        shares = _cover(depth, layer * spacing, step) - _cover(depth, (layer + 1) * spacing, step)
        moved, reached = _slide(nearest, points[shares > 0], target)
        keep = reached > (0.0 if layer == 0 else target - 0.25 * spacing)
        thick = np.minimum(2 * reached[keep], spacing)
        wanted = (shares[shares > 0][keep] * step / thick).sum() * (step / spacing) ** (len(lower) - 1)
        parts.append(_thin_to(moved[keep], wanted, spacing))
    return np.vstack(parts)


def _cover(depth: np.ndarray, level: float, step: float) -> np.ndarray:
    """Share of the lattice cells, centred at `depth` (n,), that lies below the depth `level`."""
    return np.clip((depth - level) / step + 0.5, 0.0, 1.0)


def near(nearest: Nearest, lower: np.ndarray, upper: np.ndarray, reach: float, step: float) -> np.ndarray:
    """Lattice points (n, dim) with spacing `step`, row by row, whose cells touch what lies inside within `reach` of the
    surface. Larger cells that the distance rules out are never refined."""
    dim = len(lower)
    extent = float(np.max(upper - lower))
    level = max(0, math.ceil(math.log2(extent / (16 * step))))
    size = step * 2**level
    count = np.ceil((upper - lower) / size).astype(int)
    cells = (np.indices(count).reshape(dim, -1).T + 0.5 - count / 2) * size + (lower + upper) / 2
    corner = np.indices([2] * dim).reshape(dim, -1).T - 0.5
    for _ in range(level):
        distance = nearest(cells)[0]
        margin = size * math.sqrt(dim) / 2
        cells = cells[(distance < margin) & (distance > -reach - margin)]
        size /= 2
        cells = (cells[:, None] + corner * size).reshape(-1, dim)
    distance = nearest(cells)[0]
    cells = cells[(distance < step / 2) & (distance > -reach - step / 2)]
    return cells[np.lexsort(np.round(cells / step).T)]


def deepest(nearest: Nearest, lower: np.ndarray, upper: np.ndarray, spacing: float, finest: float) -> float:
    """Radius of the largest ball inside a closed surface [m], but not more than 1.25 spacings."""
    points = near(nearest, lower, upper, 1.5 * spacing, min(spacing / 2, finest))
    return float(_slide(nearest, points, 1.25 * spacing)[1].max()) if len(points) else 0.0


def _slide(nearest: Nearest, points: np.ndarray, target: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, dim) moved to the depth `target` along the normal, or to the middle of what is thinner, and the depths
    (n,) they reach. The passes carry points in a corner to the corner of the layer."""
    moved, reached, rest = points.copy(), np.zeros(len(points)), np.arange(len(points))
    for _ in range(5):
        distance, foot = nearest(moved[rest])
        reached[rest] = -distance
        off = np.abs(distance + target) > 1e-3 * target
        rest = rest[off]
        moved[rest] = foot[off] + target * _inward(moved[rest], foot[off], distance[off])
    if rest.size:
        moved[rest] = _climb(nearest, points[rest], target)
        reached[rest] = -nearest(moved[rest])[0]
    return moved, reached


def _climb(nearest: Nearest, points: np.ndarray, target: float) -> np.ndarray:
    """Points (n, dim) moved away from the surface in ever shorter strides, until they are `target` deep or as deep as
    the solid is there. The strides are odd so that none ends on the far side of a plate, where there is no way back."""
    for stride in 0.437 * target * 0.77 ** np.arange(20):
        distance, foot = nearest(points)
        points = points + np.clip(target + distance, 0.0, stride)[:, None] * _inward(points, foot, distance)
    return points


def _inward(points: np.ndarray, foot: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) from closest surface points `foot` into the solid; zero for points on the surface."""
    return (foot - points) * np.divide(1.0, distance, out=np.zeros_like(distance), where=distance != 0)[:, None]


def _thin_to(points: np.ndarray, wanted: float, spacing: float) -> np.ndarray:
    """About `wanted` of the points (n, dim), as evenly spread as a greedy choice gets them."""
    if len(points) <= 1:
        return points
    low, high = 0.3 * spacing, 1.3 * spacing
    for _ in range(12):
        radius = (low + high) / 2
        kept = _apart(points, radius)
        if abs(kept.sum() - wanted) <= 0.005 * wanted:
            break
        low, high = (radius, high) if kept.sum() > wanted else (low, radius)
    return points[kept]


@njit(cache=True)
def _apart(points, radius):
    """Which points (n, dim) to keep, first come first served, so that no two are closer than radius."""
    n, dim = points.shape
    slots = 1
    while slots < 2 * n:
        slots *= 2
    head, following, kept = np.full(slots, -1), np.full(n, -1), np.zeros(n, np.bool_)
    cell = np.zeros(3, np.int64)
    deep = 1 if dim == 3 else 0
    for i in range(n):
        for k in range(dim):
            cell[k] = int(np.floor(points[i, k] / radius))
        free = True
        for a in range(-1, 2):
            for b in range(-1, 2):
                for c in range(-deep, deep + 1):
                    j = head[_slot(cell[0] + a, cell[1] + b, cell[2] + c, slots)]
                    while free and j >= 0:
                        square = 0.0
                        for k in range(dim):
                            square += (points[i, k] - points[j, k]) ** 2
                        free = square >= radius * radius
                        j = following[j]
        if free:
            slot = _slot(cell[0], cell[1], cell[2], slots)
            kept[i], following[i], head[slot] = True, head[slot], i
    return kept


@njit(cache=True)
def _slot(a, b, c, slots):
    """Slot of a cell in the table of `slots`, a power of two (Teschner et al. 2003)."""
    return ((a * 73856093) ^ (b * 19349663) ^ (c * 83492791)) & (slots - 1)
