"""Blocks of fluid filled with particles: on the tank's lattice, or on one of their own along a slope."""

from __future__ import annotations

import math

import numpy as np

from fsi.particles.fixed import pairs_within
from fsi.particles.tank import axis, lattice
from fsi.protocols import Solid
from fsi.scene.geometry import WHOLE, cell
from fsi.scene.model import Block, Scene
from fsi.scene.region import contains, corners, shaped, spans, volume

FILLED = 0.02  # share by which the fluid of a shape may differ from its volume without a note

PLACES = 24  # along each axis of a block, at which it is asked whether it is outside of solids

EXACT = 1e-6  # share to which volumes of the lattice are known

OFFSETS = (0.0, 0.5, 0.25, 0.75)  # [cell] that a lattice along a slope may be shifted by along it

PARTS = {2: 6, 3: 3}  # of a cell along each of its sides, by which the filled part is known

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)  # multiples of it, without their whole numbers, are evenly spread

Filling = tuple[Block, int]  # a block, and the number of its liquid


def fillings(scene: Scene) -> list[Filling]:
    """All blocks, with the number of their liquid; the other liquids' come first and hold their place."""
    tank, fluid = scene.tank, scene.fluid
    blocks = [(block, n) for n, liquid in enumerate(scene.all_liquids) for block in liquid.blocks if n]
    if fluid.blocks:
        return blocks + [(block, 0) for block in fluid.blocks]
    return [*blocks, (Block(min=tank.min, max=(*tank.max[:-1], fluid.still_water_level)), 0)]


def on_the_lattice(scene: Scene, block: Block) -> np.ndarray:
    """Points (n, dim) of the tank's lattice in a block, without cells that the tank's far walls cut."""
    tank, sides = scene.tank, cell(scene)
    ends = zip(block.min, block.max, _room(scene), tank.min, sides, strict=True)
    points = lattice([axis(a, min(b, r), o, side) for a, b, r, o, side in ends])
    return points[contains(block, points, scene.spacing)] if shaped(block) else points


def volume_outside(scene: Scene, solids: list[Solid]) -> float:
    """Volume [m3; m2 in two dimensions] of the fluid outside of solids within a few parts in a hundred, counted on a coarse
    lattice in each block, before particles are made."""
    blocks, total = fillings(scene), 0.0
    for number, (block, _) in enumerate(blocks):
        sides = np.subtract(block.max, block.min) / PLACES
        points = lattice([low + side * (np.arange(PLACES) + 0.5) for low, side in zip(block.min, sides, strict=True)])
        if shaped(block):
            points = points[contains(block, points, scene.spacing)]
        for before, _ in blocks[:number]:
            points = points[~contains(before, points, scene.spacing)]
        total += math.prod(sides) * float((clearance(solids, points) > 0).sum())
    return total


def along_the_slope(scene: Scene, block: Block) -> np.ndarray:
    """Points (n, dim) of a lattice with rows at `block.angle`, that has cells of the volume of the tank's and begins half a
    cell from the end of the block across the rows: those whose cells the block fills most, as many as its volume has, of
    equal ones evenly spread. Along the rows it begins where they hold most of the block."""
    best, most = None, -1.0
    for offset in OFFSETS:
        points, sides = _turned_lattice(scene, block, offset)
        points = points[((points > np.array(scene.tank.min)) & (points < _room(scene))).all(1)]
        shares = _shares(block, points, sides, scene.spacing)
        kept = np.sort(_fullest(shares)[: round(shares.sum())])
        if (held := shares[kept].sum()) > most + 0.5:
            best, most = points[kept], held
    return best


def _fullest(shares: np.ndarray) -> np.ndarray:
    """Order (n,) of cells by how much of them is filled, such that the first of equal ones are evenly spread among these."""
    order = np.argsort(-shares.round(6), kind="stable")
    _, first, group = np.unique(-shares[order].round(6), return_index=True, return_inverse=True)
    place = np.arange(len(order)) - first[group]
    return order[np.lexsort((GOLDEN * place % 1.0, group))]


def _turned_lattice(scene: Scene, block: Block, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, dim) of a lattice along the slope of a block, all around it, that is shifted by so many cells along the
    rows; the sides (dim, dim) of its cells."""
    tank, sides, a = scene.tank, cell(scene), math.radians(block.angle)
    along, across = np.array([math.cos(a), math.sin(a)]), np.array([-math.sin(a), math.cos(a)])
    side, ends = math.sqrt(sides[0] * sides[-1]), corners(block)
    turned = ends @ np.stack([along, across], 1)
    (first, bottom), (last, top) = turned.min(0), turned.max(0)
    rows = axis(first - side, last + side, first + offset * side, side), axis(bottom, top + side, bottom, side)
    flat = lattice(list(rows))
    plane = flat[:, :1] * along + flat[:, 1:] * across
    if scene.dimension == 2:
        return plane, side * np.array([along, across])
    y = axis(block.min[1], min(block.max[1], _room(scene)[1]), tank.min[1], sides[1])
    points = np.column_stack([np.repeat(plane[:, 0], len(y)), np.tile(y, len(plane)), np.repeat(plane[:, 1], len(y))])
    (ax, az), (bx, bz) = side * along, side * across
    return points, np.array([[ax, 0.0, az], [0.0, sides[1], 0.0], [bx, 0.0, bz]])


def _shares(block: Block, points: np.ndarray, sides: np.ndarray, spacing: float) -> np.ndarray:
    """Part (n,) of cells with these middles (n, dim) and sides (dim, dim) that a block fills: by its corners where they
    agree, else by some points along each side."""
    ends = (lattice([np.array([-0.5, 0.5])] * len(sides))) @ sides * (1 - 1e-6)
    inside = np.mean([contains(block, points + end, spacing) for end in ends], axis=0)
    cut = np.flatnonzero((inside > 0) & (inside < 1))
    parts = PARTS[len(sides)]
    within = lattice([(np.arange(parts) + 0.5) / parts - 0.5] * len(sides)) @ sides
    inside[cut] = np.mean([contains(block, points[cut] + place, spacing) for place in within], axis=0)
    return inside


def free(scene: Scene, before: list[Filling], solids: list[Solid], points: np.ndarray) -> tuple:
    """Those of the points (n, dim) that are in no block `before` and in no solid, their clearance (n,) from solids, and how
    many cells the solids leave of those of all points, parts of cells counted."""
    for block, _ in before:  # blocks may overlap: the first one holds the particle
        points = points[~contains(block, points, scene.spacing)]
    clear = clearance(solids, points)
    fits = clear > 1e-6 * scene.spacing  # so that the volume is right on average
    return points[fits], clear[fits], cells_left(scene, clear)


def beside(points: np.ndarray, clear: np.ndarray, turned: np.ndarray, wanted: int, spacing: float) -> tuple:
    """Those of the points (n, dim) that are farthest from particles along slopes, `turned` (m, dim), and as many as wanted: so
    that two lattices meet without a gap, and without particles that crowd each other. With their clearance (n,)."""
    i, j = pairs_within(points, turned, 2 * spacing)
    distance = np.full(len(points), np.inf)
    np.minimum.at(distance, i, np.linalg.norm(points[i] - turned[j], axis=1))
    kept = np.sort(np.argsort(-distance, kind="stable")[: max(wanted, 0)])
    return points[kept], clear[kept]


def clearance(solids: list[Solid], points: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, dim) from all solids, infinite without any."""
    clear = np.full(len(points), math.inf)
    for solid in solids:
        np.minimum(clear, solid.clearance(points), out=clear)
    return clear


def cells_left(scene: Scene, clear: np.ndarray) -> float:
    """How many cells solids leave, of those with the middle so far (n,) from their surface: a plane cuts a part off each."""
    side = math.prod(cell(scene)) ** (1 / scene.dimension)
    return float(np.clip(0.5 + clear / side, 0.0, 1.0).sum())


def particle_volume(scene: Scene, cells: float, count: int) -> float:
    """Volume [m3; m2 in two dimensions] of each of `count` particles that start in the lattice where solids leave so many cells
    of it: so the still water level is right, wherever the solids cut the lattice."""
    share = cells / count if count else 1.0
    return math.prod(cell(scene)) * (share if abs(share - 1.0) > EXACT else 1.0)


def load(points: np.ndarray, blocks: list[Filling], density: np.ndarray, spacing: float) -> np.ndarray:
    """Mass per area [kg/m2] of the fluid straight above points (n, dim). Blocks of one liquid do not overlap."""
    total, z = np.zeros(len(points)), points[:, -1:]
    held = [spans(block, points, spacing) for block, _ in blocks]
    for n, ((low, high), (_, liquid)) in enumerate(zip(held, blocks, strict=True)):
        total += density[liquid] * np.maximum(0.0, high - np.maximum(low, z)).sum(1)
        for other_low, other_high in held[:n]:  # what an earlier block holds of this one
            shared_low = np.maximum(low[:, :, None], other_low[:, None])
            shared_high = np.minimum(high[:, :, None], other_high[:, None])
            length = np.maximum(0.0, shared_high - np.maximum(shared_low, z[:, None]))
            total -= density[liquid] * length.sum((1, 2))
    return total


def uneven(scene: Scene, key: str, block: Block, count: int):
    """A note where the particles of a shape, `count` before solids are taken out, stand for more or less than its volume."""
    real, found = volume(block), count * math.prod(cell(scene))
    if abs(found - real) > FILLED * real:
        unit = "m2" if scene.dimension == 2 else "m3"
        yield f"{key}: its shape has {real:.4g} {unit}; it starts with {found:.4g} {unit} of particles"


def _room(scene: Scene) -> list[float]:
    """Where the last cell that the tank's far walls do not cut may have its middle [m]."""
    tank = scene.tank
    return [
        end - (0.5 - WHOLE) * side if f"{name}+" in tank.walls else math.inf
        for name, end, side in zip(tank.axes, tank.max, cell(scene), strict=True)
    ]
