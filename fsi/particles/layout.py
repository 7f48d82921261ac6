"""From a scene to particles: the fluid on a lattice, the tank's walls, the boundary particles of the solids."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsi.errors import SceneError
from fsi.owners import FIRST_BODY, PISTON, WALL
from fsi.particles import hydrostatics
from fsi.particles.fixed import Surface, joined
from fsi.particles.ghosts import Periodic
from fsi.particles.hydrostatics import Cells
from fsi.particles.instruments import check_instruments
from fsi.particles.tank import WHOLE, Sides, axis, lattice, wall_particles
from fsi.protocols import BodySet, Solid
from fsi.scene.geometry import fluid_height, piston_retreat
from fsi.scene.model import Scene

CLEAR = 0.9  # gradient of the distance to a body, from which on it is a normal


@dataclass(frozen=True)
class Layout:
    """Particles at t = 0 and the box they live in.

    position, velocity (n, dim), pressure (n,) of the fluid; boundary (b, dim) with owner (b,), sorted by owner;
    liquid (n,): number in `Scene.all_liquids`, None where there is one alone; domain_min, domain_max (dim,);
    normal (b, dim): outward normals of the bodies at their boundary particles, 0 elsewhere, None without bodies;
    depth: height of the fluid [m]; notes: what the user should know; loads (loads, b, dim): see `load_weights`, None without.
    """

    position: np.ndarray
    velocity: np.ndarray
    pressure: np.ndarray
    boundary: np.ndarray
    owner: np.ndarray
    domain_min: np.ndarray
    domain_max: np.ndarray
    depth: float
    notes: tuple[str, ...]
    liquid: np.ndarray | None = None
    glued: np.ndarray | None = None
    normal: np.ndarray | None = None
    loads: np.ndarray | None = None


def build(scene: Scene, bodies: BodySet | None = None, ground: Solid | None = None) -> Layout:
    """Raises SceneError where no fluid is left, and where an instrument is inside a solid."""
    solids = ([(WALL, ground)] if ground else []) + (bodies.solids() if bodies else [])
    check_instruments(scene, solids)
    gaps = bodies.gaps() if bodies else []
    position, velocity, pressure, liquid, left_out = _fluid(scene, [solid for _, solid in solids + gaps])
    if len(position) == 0:
        raise SceneError(
            "the scene holds no fluid particle",
            key="fluid",
            fix="raise fluid.still_water_level above the tank's bottom, or add [[fluid.blocks]]",
        )
    glued = None
    if gaps:
        glued = np.concatenate([np.full(len(gap.position), owner) for owner, gap in gaps])
        layer = np.concatenate([gap.position for _, gap in gaps])
        below = scene.fluid.still_water_level - layer[:, -1]
        position, velocity = np.concatenate([position, layer]), np.concatenate([velocity, np.zeros_like(layer)])
        pressure = np.concatenate([pressure, scene.fluid.density * scene.gravity * np.maximum(below, 0.0)])
        liquid = None if liquid is None else np.concatenate([liquid, np.zeros(len(layer), liquid.dtype)])
    boundary, normal, owner, source = _boundary(scene, solids)
    loads = None
    if scene.loads:
        from fsi.particles.loads import load_weights

        loads = load_weights(scene, boundary, owner, source, solids)
    margin = (scene.layers + 0.01) * scene.spacing
    low = np.array(scene.tank.min) - margin
    high = np.array(scene.tank.max) + margin
    low[0] -= piston_retreat(scene)
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
        notes,
        liquid,
        glued,
        normal,
        loads,
    )


def _fluid(scene: Scene, solids: list[Solid]):
    """Blocks of fluid on one lattice anchored at the tank's corner, without what the solids displace, and without cells that
    the tank's far walls cut."""
    tank, spacing = scene.tank, scene.spacing
    half = (0.5 - WHOLE) * spacing
    room = [b - half if f"{n}+" in tank.walls else math.inf for n, b in zip(tank.axes, tank.max, strict=True)]
    blocks = _blocks(scene)
    positions, velocities, liquids, tops, free = [], [], [], [], []
    for number, (low, high, velocity, liquid) in enumerate(blocks):
        axes = [axis(a, min(b, r), o, spacing) for a, b, r, o in zip(low, high, room, tank.min, strict=True)]
        points = lattice(axes)
        for other_low, other_high, *_ in blocks[:number]:  # blocks may overlap: the first one holds the particle
            inside = ((points > np.array(other_low)) & (points < np.array(other_high))).all(1)
            points = points[~inside]
        clear = np.full(len(points), math.inf)
        for solid in solids:
            clear = np.minimum(clear, gap := solid.clearance(points))
            fits = gap > 1e-6 * spacing  # so that the volume is right on average
            points, clear = points[fits], clear[fits]
        positions.append(points)
        velocities.append(np.tile(np.zeros(scene.dimension) if velocity is None else velocity, (len(points), 1)))
        liquids.append(np.full(len(points), liquid, np.int8))
        tops.append(np.full(len(points), high[-1]))
        free.append(clear)
    position, liquid, top, clear = (np.concatenate(parts) for parts in (positions, liquids, tops, free))
    velocity = np.concatenate(velocities)
    pressure, pocket = _pressure(scene, blocks, solids, position, liquid, top, clear)
    kept, notes = np.ones(len(position), bool), ()
    if pocket.any():  # a sealed gap of one or two rows is no pool: its water has no room to find its pressure
        clear = np.minimum(clear, Sides(scene, WALL).clearance(position))
        room = np.zeros(pocket.max() + 1)
        np.maximum.at(room, pocket, clear)
        kept = (pocket == 0) | (room[pocket] >= spacing)
        if lost := int((~kept).sum()):
            notes = (f"fluid: {lost} particles in sealed gaps narrower than three spacings are left out",)
    position, velocity, pressure, liquid = (values[kept] for values in (position, velocity, pressure, liquid))
    return position, velocity, pressure, liquid if scene.liquids else None, notes


def _pressure(scene: Scene, blocks: list[tuple], solids: list[Solid], position, liquid, top, clear) -> tuple:
    """Pressure (n,) at t = 0 of the particles at `position` (n, dim), whose blocks end at the heights `top` (n,), `clear` (n,)
    from the solids, and the sealed pocket (n,) of each, 0 if none."""
    density = np.array([q.density for q in scene.all_liquids])
    if len(position) == 0 or (len(blocks) == 1 and not solids):
        found, pocket = scene.fluid.density * scene.gravity * (top - position[:, -1]), np.zeros(len(position), int)
        return (np.zeros(len(position)) if scene.fluid.start == "zero" else found), pocket
    origin = np.array(scene.tank.min)
    cells = Cells(position, density[liquid], top, clear, solids, origin, scene.spacing)
    pressure, pocket = hydrostatics.pressure(cells, scene.gravity)
    if scene.fluid.start == "zero":
        return np.zeros(len(position)), pocket
    if scene.liquids:  # blocks that end between two rows of the lattice: their exact load, where no more is different
        exact = scene.gravity * _load(position, blocks, density)
        near = np.abs(pressure - exact) < density.max() * scene.gravity * scene.spacing
        pressure = np.where(near, exact, pressure)
    return pressure, pocket


def _blocks(scene: Scene) -> list[tuple]:
    """(low, high, velocity, number of the liquid) of all blocks; the other liquids' come first and hold their place."""
    tank, fluid = scene.tank, scene.fluid
    blocks = [(b.min, b.max, b.velocity, n) for n, q in enumerate(scene.all_liquids) for b in q.blocks if n]
    whole = [(tank.min, (*tank.max[:-1], fluid.still_water_level), None, 0)]
    return blocks + ([(b.min, b.max, b.velocity, 0) for b in fluid.blocks] or whole)


def _load(points: np.ndarray, blocks: list[tuple], density: np.ndarray) -> np.ndarray:
    """Mass per area [kg/m2] of the fluid straight above points (n, dim)."""
    total = np.zeros(len(points))

    def column(low, high, weight: float) -> None:
        under = ((points[:, :-1] > np.array(low[:-1])) & (points[:, :-1] < np.array(high[:-1]))).all(1)
        total[under] += weight * np.maximum(0.0, high[-1] - np.maximum(points[under, -1], low[-1]))

    for n, (low, high, _, liquid) in enumerate(blocks):
        column(low, high, density[liquid])
        for other_low, other_high, *_ in blocks[:n]:  # what an earlier block holds of this one
            shared_low, shared_high = np.maximum(low, other_low), np.minimum(high, other_high)
            if (shared_low < shared_high).all():
                column(shared_low, shared_high, -density[liquid])
    return total


def _boundary(scene: Scene, solids: list[tuple[int, Solid]]) -> tuple:
    """Boundary particles (n, dim), the outward normals (n, dim) of bodies, owners (n,), by which they are sorted, and the
    number (n,) of the solid that each is of, -1 for the tank's walls."""
    points, owners = wall_particles(scene)
    clouds = [solid.boundary(scene.spacing, scene.layers) for _, solid in solids]
    fixed = [n for n, (owner, _) in enumerate(solids) if owner == WALL]
    if fixed:
        walls = [(owners == owner, Sides(scene, owner).clearance) for owner in (WALL, PISTON)]
        ours = [Surface(points[mine], clearance) for mine, clearance in walls]
        grounds = [Surface(clouds[n], solids[n][1].clearance, getattr(solids[n][1], "foot", None)) for n in fixed]
        first, *middle, last = joined([ours[0], *grounds, ours[1]], scene.spacing)
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
    normal = np.zeros_like(boundary) if owner.max(initial=0) >= FIRST_BODY else None
    for body in np.unique(owner[owner >= FIRST_BODY]):
        own = [solid for its_owner, solid in solids if its_owner == body]
        normal[owner == body] = _normals(own, boundary[owner == body], 0.1 * scene.spacing)
    return boundary, normal, owner, source


def _normals(solids: list[Solid], points: np.ndarray, step: float) -> np.ndarray:
    """Outward normals (n, dim) at boundary particles (n, dim) of one body, from distances a `step` [m] to both sides; 0 where
    two faces are equally near, in an edge and in the middle of a plate."""

    def clearance(where: np.ndarray) -> np.ndarray:
        return np.min([solid.clearance(where) for solid in solids], axis=0)

    rise = [clearance(points + step * axis) - clearance(points - step * axis) for axis in np.eye(points.shape[1])]
    normal = np.stack(rise, axis=1) / (2 * step)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.where(length > CLEAR, normal / np.maximum(length, CLEAR), 0.0)


def _off_lattice(scene: Scene):
    """Sides of the tank that are not a whole number of spacings long leave a gap at the far wall."""
    spans = list(zip(scene.tank.axes, scene.tank.min, scene.tank.max, strict=True))
    if not scene.fluid.blocks:
        spans[-1] = ("z up to the still water level", scene.tank.min[-1], scene.fluid.still_water_level)
    for name, low, high in spans:
        count = (high - low) / scene.spacing
        if abs(count - round(count)) > WHOLE and (name != "z"):
            yield f"tank: {name}: {high - low:g} m is {count:.2f} spacings; the last {count % 1:.2f} stay without fluid"
