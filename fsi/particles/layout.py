"""From a scene to particles: the fluid on a lattice, the tank's walls, the boundary particles of the solids."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsi.errors import SceneError
from fsi.owners import FIRST_BODY, PISTON, WALL
from fsi.particles import hydrostatics
from fsi.particles.crowded import CLEAR, made_room
from fsi.particles.filling import (
    Filling,
    along_the_slope,
    beside,
    fillings,
    free,
    load,
    on_the_lattice,
    particle_volume,
    uneven,
    volume_outside,
)
from fsi.particles.fixed import Surface, joined, unburied
from fsi.particles.ghosts import Periodic
from fsi.particles.hydrostatics import Cells
from fsi.particles.instruments import check_instruments
from fsi.particles.tank import Sides, axis, wall_particles
from fsi.protocols import BodySet, Solid
from fsi.scene import region
from fsi.scene.check_size import size_faults
from fsi.scene.geometry import WHOLE, all_blocks, cell, fluid_height, retreats, start
from fsi.scene.model import Block, Scene
from fsi.scene.region import contains, shaped

STRAIGHT = 127  # length of a normal in whole numbers
NORMAL = 0.9  # gradient of the distance to a body, from which on it is a normal


@dataclass(frozen=True)
class Layout:
    """Particles at t = 0 and the box they live in.

    position, velocity (n, dim), pressure (n,) of the fluid; boundary (b, dim) with owner (b,), sorted by owner;
    liquid (n,): number in `Scene.all_liquids`, None where there is one alone; domain_min, domain_max (dim,);
    normal (m, dim): outward normals of the bodies at their boundary particles, the last m, None without bodies; facing
    (b - m, dim), int8: those of all others times `STRAIGHT`;
    depth: height of the fluid [m]; volume: that a particle stands for [m3; m2 in two dimensions]; notes: what the user should
    know; loads (loads, b, dim): see `load_weights`, None without.
    """

    position: np.ndarray
    velocity: np.ndarray
    pressure: np.ndarray
    boundary: np.ndarray
    owner: np.ndarray
    domain_min: np.ndarray
    domain_max: np.ndarray
    depth: float
    volume: float
    notes: tuple[str, ...]
    liquid: np.ndarray | None = None
    glued: np.ndarray | None = None
    normal: np.ndarray | None = None
    facing: np.ndarray | None = None
    loads: np.ndarray | None = None


def build(scene: Scene, bodies: BodySet | None = None, ground: Solid | None = None) -> Layout:
    """Raises SceneError where no fluid is left, where what a bathymetry leaves of it does not fit into memory, and where an
    instrument is inside a solid."""
    solids = ([(WALL, ground)] if ground else []) + (bodies.solids() if bodies else [])
    check_instruments(scene, solids)
    gaps = bodies.gaps() if bodies else []
    obstacles = [solid for _, solid in solids + gaps]
    if ground:
        for key, fault, fix in size_faults(scene, volume_outside(scene, [solid for _, solid in solids]), fluid_height(scene)):
            raise SceneError(fault, key=key, fix=fix)
    if scene.sea and (scene.sea.start == "waves" or scene.sea.current is not None):
        from fsi.particles.sea import under_waves

        (position, velocity, pressure, clear, volume), liquid, left_out = under_waves(scene, obstacles), None, ()
    else:
        position, velocity, pressure, liquid, clear, volume, left_out = _fluid(scene, obstacles)
    if len(position) == 0:
        raise SceneError(
            "the scene holds no fluid particle",
            key="fluid",
            fix="raise fluid.still_water_level above the tank's bottom, or add [[fluid.blocks]]",
        )
    if not scene.closed:  # rows as far apart as the particles' volume has them
        rise = (position[:, -1] - scene.tank.min[-1]) * (volume / math.prod(cell(scene)) - 1.0)
        position[:, -1] += rise
        if start(scene) != "zero":
            pressure = np.maximum(0.0, pressure - scene.fluid.density * scene.gravity * rise)
    glued = None
    if gaps:
        glued = np.concatenate([np.full(len(gap.position), owner) for owner, gap in gaps])
        layer = np.concatenate([gap.position for _, gap in gaps])
        below = scene.fluid.still_water_level - layer[:, -1]
        position, velocity = np.concatenate([position, layer]), np.concatenate([velocity, np.zeros_like(layer)])
        pressure = np.concatenate([pressure, scene.fluid.density * scene.gravity * np.maximum(below, 0.0)])
        liquid = None if liquid is None else np.concatenate([liquid, np.zeros(len(layer), liquid.dtype)])
    boundary, normal, facing, owner, source = _boundary(scene, solids)
    if scene.numerics.wall_guard > 0 and obstacles:
        near = np.flatnonzero(clear < CLEAR * scene.spacing)
        position[near] = made_room(position[near], boundary, scene.numerics.wall_guard, scene.spacing)
    if scene.sea and bodies:
        from fsi.particles.sea import check_zones

        check_zones(scene, bodies)
    loads = None
    if scene.loads:
        from fsi.particles.loads import load_weights

        loads = load_weights(scene, boundary, owner, source, solids)
    margin = (scene.layers + 0.01) * scene.spacing
    low = np.array(scene.tank.min) - margin
    high = np.array(scene.tank.max) + margin
    back, forth = retreats(scene)
    low, high = low - back, high + forth
    periodic = Periodic(scene)
    low[periodic.axes] -= periodic.width
    high[periodic.axes] += periodic.width
    notes = (*_off_lattice(scene), *left_out)
    return Layout(
        position,
        velocity,
        pressure,
        boundary,
        owner,
        low,
        high,
        fluid_height(scene),
        volume,
        notes,
        liquid,
        glued,
        normal,
        facing,
        loads,
    )


def _fluid(scene: Scene, solids: list[Solid]):
    """Position, velocity, pressure and liquid of the fluid, its clearance from the solids, the volume of a particle, and notes:
    blocks on one lattice anchored at the tank's corner, of cells that are stretched to fit (`geometry.cell`), or
    along a slope, without what the solids displace, and without cells that the tank's far walls cut."""
    blocks, spacing, notes = fillings(scene), scene.spacing, ()
    parts, stand_ins, cells = [], [], 0.0
    shapes = turned = np.empty((0, scene.dimension))  # the particles so far in shapes, and those of them along slopes
    for number, (block, liquid) in enumerate(blocks):
        slope, before = block.angle is not None, blocks[:number]
        on_lattice = on_the_lattice(scene, block)
        points = along_the_slope(scene, block) if slope else on_lattice
        of, clear, left = free(scene, before, solids, points)
        stand_ins.append((block, liquid, *(free(scene, before, solids, on_lattice)[:2] if slope else (of, clear))))
        if shaped(block):
            notes += tuple(uneven(scene, _key(scene, block), block, len(points)))
            shapes, turned = np.concatenate([shapes, of]), np.concatenate([turned, of]) if slope else turned
            cells += len(of)
        else:
            if len(shapes):  # they hold a part of what the boxes before leave
                boxes = [filling for filling in before if not shaped(filling[0])]
                left = free(scene, boxes, solids, points)[2] - float(contains(block, shapes, spacing).sum())
            if len(turned):
                of, clear, _ = free(scene, [filling for filling in before if filling[0].angle is None], solids, points)
                of, clear = beside(of, clear, turned, round(left), spacing)
            cells += left
        parts.append((block, liquid, of, clear))
    position, liquid, top, clear = _joined(scene, parts)
    velocity = [np.tile(np.zeros(scene.dimension) if b.velocity is None else b.velocity, (len(of), 1)) for b, _, of, _ in parts]
    velocity, volume = np.concatenate(velocity), particle_volume(scene, cells, len(position))
    if not len(turned):
        pressure, pocket = _pressure(scene, blocks, solids, position, liquid, top, clear)
    else:  # the hydrostatic pressure needs columns: cells of the tank's lattice stand in for particles along a slope
        lattice = _joined(scene, stand_ins)
        found = _pressure(scene, blocks, solids, *lattice)
        pressure, pocket = _off_cells(scene, blocks, lattice[0], found, position, liquid)
    kept = np.ones(len(position), bool)
    if pocket.any():  # a sealed gap of one or two rows is no pool: its water has no room to find its pressure
        clear = np.minimum(clear, Sides(scene, WALL).clearance(position))
        room = np.zeros(pocket.max() + 1)
        np.maximum.at(room, pocket, clear)
        kept = (pocket == 0) | (room[pocket] >= spacing)
        if lost := int((~kept).sum()):
            notes += (f"fluid: {lost} particles in sealed gaps narrower than three spacings are left out",)
    position, velocity, pressure, liquid, clear = (v[kept] for v in (position, velocity, pressure, liquid, clear))
    return position, velocity, pressure, liquid if scene.liquids else None, clear, volume, notes


def _key(scene: Scene, block: Block) -> str:
    return next((key for key, other in all_blocks(scene).items() if other is block), "fluid")


def _pressure(scene: Scene, blocks: list[Filling], solids: list[Solid], position, liquid, top, clear) -> tuple:
    """Pressure (n,) at t = 0 of the particles at `position` (n, dim), whose blocks end at the heights `top` (n,), `clear` (n,)
    from the solids, and the sealed pocket (n,) of each, 0 if none."""
    density = np.array([q.density for q in scene.all_liquids])
    if len(position) == 0 or (len(blocks) == 1 and not solids and not shaped(blocks[0][0])):
        found, pocket = scene.fluid.density * scene.gravity * (top - position[:, -1]), np.zeros(len(position), int)
        return (np.zeros(len(position)) if start(scene) == "zero" else found), pocket
    origin = np.array(scene.tank.min)
    cells = Cells(position, density[liquid], top, clear, solids, origin, np.array(cell(scene)))
    pressure, pocket = hydrostatics.pressure(cells, scene.gravity)
    if start(scene) == "zero":
        return np.zeros(len(position)), pocket
    return _exact_load(scene, blocks, position, pressure), pocket


def _exact_load(scene: Scene, blocks: list[Filling], position, pressure) -> np.ndarray:
    """Pressure (n,) of several liquids, whose blocks end between two rows of the lattice: by their exact load, where no more is
    different."""
    if not scene.liquids:
        return pressure
    density = np.array([q.density for q in scene.all_liquids])
    exact = scene.gravity * load(position, blocks, density, scene.spacing)
    near = np.abs(pressure - exact) < density.max() * scene.gravity * scene.spacing
    return np.where(near, exact, pressure)


def _joined(scene: Scene, parts: list) -> tuple:
    """Position, liquid, height of the end of the block above, and clearance of the particles of all blocks; parts: a block, its
    liquid, position (n, dim) and clearance (n,)."""
    of = [part[2] for part in parts]
    top = [
        region.top(block, points, scene.spacing) if shaped(block) else np.full(len(points), block.max[-1])
        for (block, *_), points in zip(parts, of, strict=True)
    ]
    liquid = [np.full(len(points), part[1], np.int8) for part, points in zip(parts, of, strict=True)]
    return np.concatenate(of), np.concatenate(liquid), np.concatenate(top), np.concatenate([part[3] for part in parts])


def _off_cells(scene: Scene, blocks: list[Filling], cells: np.ndarray, found: tuple, position, liquid) -> tuple:
    """Pressure and pocket (n,) of particles anywhere, from `found` for `cells` (m, dim) of the lattice: those of the
    cell that each is in, and its own weight below the middle of that."""
    density = np.array([q.density for q in scene.all_liquids])[liquid]
    nearest = hydrostatics.nearest(cells, position, np.array(scene.tank.min), np.array(cell(scene)))
    pressure, pocket = (values[nearest] for values in found)
    if start(scene) == "zero":
        return pressure, pocket
    pressure = pressure + density * scene.gravity * (cells[nearest, -1] - position[:, -1])
    return _exact_load(scene, blocks, position, np.maximum(pressure, 0.0)), pocket


def _boundary(scene: Scene, solids: list[tuple[int, Solid]]) -> tuple:
    """Boundary particles (n, dim), the outward normals (m, dim) of those of bodies and, in whole numbers, of all others, owners
    (n,), by which they are sorted, and the number (n,) of the solid that each is of, -1 for the tank's walls."""
    points, owners = wall_particles(scene)
    clouds = [solid.boundary(scene.spacing, scene.layers) for _, solid in solids]
    fixed = [n for n, (owner, _) in enumerate(solids) if owner == WALL]
    if fixed:
        walls = [(owners == owner, Sides(scene, owner).clearance) for owner in (WALL, PISTON)]
        ours = [Surface(points[mine], clearance) for mine, clearance in walls]
        grounds = [Surface(clouds[n], solids[n][1].clearance, getattr(solids[n][1], "foot", None)) for n in fixed]
        surfaces, support = [ours[0], *grounds, ours[1]], 2 * scene.smoothing_length
        kept = unburied(surfaces, support) if scene.single_layer else joined(surfaces, scene.spacing)
        first, *middle, last = kept
        keep = np.empty(len(points), bool)
        keep[walls[0][0]], keep[walls[1][0]] = first, last
        points, owners = points[keep], owners[keep]
        for n, kept in zip(fixed, middle, strict=True):
            clouds[n] = clouds[n][kept]
    boundary = np.concatenate([points, *clouds])
    owner = np.concatenate([owners, *(np.full(len(c), o) for c, (o, _) in zip(clouds, solids, strict=True))])
    source = np.concatenate([np.full(len(points), -1), *(np.full(len(c), n) for n, c in enumerate(clouds))])
    order = np.argsort(owner, kind="stable")
    boundary, owner, source = boundary[order], owner[order].astype(np.int32), source[order]
    normals = []
    for body in np.unique(owner[owner >= FIRST_BODY]):
        own = [solid for its_owner, solid in solids if its_owner == body]
        normals.append(_normals(own, boundary[owner == body], 0.1 * scene.spacing))
    facing = _facing(scene, solids, boundary, owner[owner < FIRST_BODY], source)
    return boundary, np.concatenate(normals) if normals else None, facing, owner, source


def _facing(scene: Scene, solids: list[tuple[int, Solid]], points: np.ndarray, owner: np.ndarray, source) -> np.ndarray:
    """The outward normals of the first boundary particles, those of the fixed walls and the piston, `owner` (f,)."""
    normal, count = np.zeros((len(owner), scene.dimension)), len(owner)
    for n in np.unique(source[:count]):
        for wall in (WALL, PISTON):
            mine = np.flatnonzero((source[:count] == n) & (owner == wall))
            solid = Sides(scene, wall) if n < 0 else solids[n][1]
            if len(mine):
                normal[mine] = _normals([solid], points[mine], 0.1 * scene.spacing)
    return np.rint(STRAIGHT * normal).astype(np.int8)


def _normals(solids: list[Solid], points: np.ndarray, step: float) -> np.ndarray:
    """Outward normals (n, dim) at boundary particles (n, dim) of one body, from distances a `step` [m] to both sides; 0 where
    two faces are equally near, in an edge and in the middle of a plate."""

    def clearance(where: np.ndarray) -> np.ndarray:
        return np.min([solid.clearance(where) for solid in solids], axis=0)

    rise = [clearance(points + step * axis) - clearance(points - step * axis) for axis in np.eye(points.shape[1])]
    normal = np.stack(rise, axis=1) / (2 * step)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.where(length > NORMAL, normal / np.maximum(length, NORMAL), 0.0)


def _off_lattice(scene: Scene):
    """Lengths of fluid that are no whole number of cells, by what starts in their place."""
    tank, sides = scene.tank, cell(scene)
    whole = {"fluid": (tank.min, (*tank.max[:-1], scene.fluid.still_water_level))} if not scene.fluid.blocks else {}
    boxes = whole | {key: (block.min, block.max) for key, block in all_blocks(scene).items() if not shaped(block)}
    for key, (low, high) in boxes.items():
        for name, a, b, origin, side in zip(tank.axes, low, np.minimum(high, tank.max), tank.min, sides, strict=True):
            filled = len(axis(a, b, origin, side)) * side
            if abs(filled - (b - a)) > WHOLE * side:
                yield f"{key}: {name}: {b - a:g} m is {(b - a) / side:.2f} cells; it starts {filled:g} m long"
