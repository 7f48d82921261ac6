"""From a scene to particles: the fluid on a lattice, the tank's walls, the boundary particles of the solids."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsi.errors import SceneError
from fsi.particles.ghosts import Periodic
from fsi.particles.instruments import check_instruments
from fsi.protocols import BodySet, Solid
from fsi.scene.model import Scene
from fsi.waves import reach

WALL, PISTON, FIRST_BODY = 0, 1, 2  # owners of boundary particles
WHOLE = 0.02  # spacings by which a length may differ from a whole number of them
CLEAR = 0.9  # gradient of the distance to a body, from which on it is a normal


@dataclass(frozen=True)
class Layout:
    """Particles at t = 0 and the box they live in.

    position, velocity (n, dim), pressure (n,) of the fluid; boundary (b, dim) with owner (b,), sorted by owner;
    liquid (n,): number in `Scene.all_liquids`, None where there is one alone; domain_min, domain_max (dim,);
    normal (b, dim): outward normals of the bodies at their boundary particles, 0 elsewhere, None without bodies;
    depth: height of the fluid [m]; notes: what the user should know.
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


def water_depth(scene: Scene) -> float:
    """Largest height of fluid over its own bottom at t = 0 [m]."""
    if scene.fluid.blocks:
        blocks = [block for liquid in scene.all_liquids for block in liquid.blocks]
        return max(b.max[-1] for b in blocks) - min(b.min[-1] for b in blocks)
    return scene.fluid.still_water_level - scene.tank.min[-1]


def piston_reach(scene: Scene) -> float:
    """How far the piston moves back, out of the tank [m]."""
    if scene.waves is None:
        return 0.0
    return max(0.0, -reach(scene.waves, water_depth(scene), scene.gravity)[0])


def build(scene: Scene, bodies: BodySet | None = None, ground: Solid | None = None) -> Layout:
    """Raises SceneError where no fluid is left, and where an instrument is inside a solid."""
    solids = ([(WALL, ground)] if ground else []) + (bodies.solids() if bodies else [])
    check_instruments(scene, solids)
    gaps = bodies.gaps() if bodies else []
    position, velocity, pressure, liquid = _fluid(scene, [solid for _, solid in solids + gaps])
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
    boundary, normal, owner = _boundary(scene, solids)
    margin = (scene.layers + 0.01) * scene.spacing
    low = np.array(scene.tank.min) - margin
    high = np.array(scene.tank.max) + margin
    low[0] -= piston_reach(scene)
    periodic = Periodic(scene)
    low[periodic.axes] -= periodic.width
    high[periodic.axes] += periodic.width
    notes = tuple(_off_lattice(scene))
    return Layout(
        position, velocity, pressure, boundary, owner, low, high, water_depth(scene), notes, liquid, glued, normal
    )


def _axis(low: float, high: float, origin: float, spacing: float) -> np.ndarray:
    """Lattice points origin + (k + 1/2) spacing between low and high; a point on the edge, to rounding, is outside."""
    first = math.ceil((low - origin) / spacing - 0.5 - 1e-6)
    last = math.floor((high - origin) / spacing - 0.5 + 1e-6)
    return origin + (np.arange(first, last + 1) + 0.5) * spacing


def _fitted(low: float, high: float, inner: float, outer: float, spacing: float) -> np.ndarray:
    """Lattice points between low and high that begin anew at `inner` and `outer`, the sides of the tank, and are stretched
    between them to fit: walls that meet in an edge then share one lattice, and crowd no fluid particle there."""
    count = round((outer - inner) / spacing)
    if abs(count * spacing - (outer - inner)) < WHOLE * spacing:
        return _axis(low, high, inner, spacing)
    between = inner + (np.arange(count) + 0.5) * (outer - inner) / count
    return np.concatenate([_axis(low, inner, inner, spacing), between, _axis(outer, high, outer, spacing)])


def _lattice(axes: list[np.ndarray]) -> np.ndarray:
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


def _fluid(scene: Scene, solids: list[Solid]):
    """Blocks of fluid on one lattice anchored at the tank's corner, without what the solids displace, and without cells that
    the tank's far walls cut."""
    tank, spacing = scene.tank, scene.spacing
    half = (0.5 - WHOLE) * spacing
    room = [b - half if f"{n}+" in tank.walls else math.inf for n, b in zip(tank.axes, tank.max, strict=True)]
    blocks = _blocks(scene)
    positions, velocities, liquids, tops = [], [], [], []
    for number, (low, high, velocity, liquid) in enumerate(blocks):
        axes = [_axis(a, min(b, r), o, spacing) for a, b, r, o in zip(low, high, room, tank.min, strict=True)]
        points = _lattice(axes)
        for other_low, other_high, *_ in blocks[:number]:  # blocks may overlap: the first one holds the particle
            inside = ((points > np.array(other_low)) & (points < np.array(other_high))).all(1)
            points = points[~inside]
        for solid in solids:
            points = points[solid.clearance(points) > 0.0]  # so that the volume is right on average
        positions.append(points)
        velocities.append(np.tile(np.zeros(scene.dimension) if velocity is None else velocity, (len(points), 1)))
        liquids.append(np.full(len(points), liquid, np.int8))
        tops.append(np.full(len(points), high[-1]))
    position, liquid = np.concatenate(positions), np.concatenate(liquids)
    if scene.fluid.start == "zero":
        pressure = np.zeros(len(position))
    elif scene.liquids:
        pressure = scene.gravity * _load(position, blocks, [q.density for q in scene.all_liquids])
    else:
        pressure = scene.fluid.density * scene.gravity * (np.concatenate(tops) - position[:, -1])
    return position, np.concatenate(velocities), pressure, liquid if scene.liquids else None


def _blocks(scene: Scene) -> list[tuple]:
    """(low, high, velocity, number of the liquid) of all blocks; the other liquids' come first and hold their place."""
    tank, fluid = scene.tank, scene.fluid
    blocks = [(b.min, b.max, b.velocity, n) for n, q in enumerate(scene.all_liquids) for b in q.blocks if n]
    whole = [(tank.min, (*tank.max[:-1], fluid.still_water_level), None, 0)]
    return blocks + ([(b.min, b.max, b.velocity, 0) for b in fluid.blocks] or whole)


def _load(points: np.ndarray, blocks: list[tuple], density: list[float]) -> np.ndarray:
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


def _walls(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Layers of particles outside the walled sides of the tank. The last axis takes the corners, and under a piston
    the other walls reach as far back as it does, so that they stay closed while it moves; along a periodic axis they
    reach as far as its ghosts."""
    tank, spacing, dim = scene.tank, scene.spacing, scene.dimension
    thick = scene.layers * spacing
    names = tank.axes
    back = math.ceil(piston_reach(scene) / spacing) * spacing
    around = math.ceil(Periodic(scene).width / spacing) * spacing
    points, owners = [], []
    for d in range(dim):
        for side in (-1, 1):
            if f"{names[d]}{'-' if side < 0 else '+'}" not in tank.walls or names[d] in tank.periodic:
                continue
            axes = []
            for e in range(dim):
                low, high = tank.min[e], tank.max[e]
                if e == d:
                    own = (low - thick, low, low) if side < 0 else (high, high + thick, high)
                    axes.append(_axis(*own, spacing))
                    continue
                if names[e] in tank.periodic:
                    low, high = low - around, high + around
                elif e < d:
                    low -= (thick + (back if e == 0 else 0.0)) * (f"{names[e]}-" in tank.walls)
                    high += thick * (f"{names[e]}+" in tank.walls)
                axes.append(_fitted(low, high, tank.min[e], tank.max[e], spacing))
            slab = _lattice(axes)
            moving = scene.waves is not None and d == 0 and side < 0
            points.append(slab)
            owners.append(np.full(len(slab), PISTON if moving else WALL))
    if not points:
        return np.empty((0, dim)), np.empty(0, int)
    return np.concatenate(points), np.concatenate(owners)


def _boundary(scene: Scene, solids: list[tuple[int, Solid]]) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    points, owners = _walls(scene)
    clouds = [solid.boundary(scene.spacing, scene.layers) for _, solid in solids]
    boundary = np.concatenate([points, *clouds])
    owner = np.concatenate([owners, *(np.full(len(c), o) for c, (o, _) in zip(clouds, solids, strict=True))])
    order = np.argsort(owner, kind="stable")
    boundary, owner = boundary[order], owner[order].astype(np.int32)
    normal = np.zeros_like(boundary) if owner.max(initial=0) >= FIRST_BODY else None
    for body in np.unique(owner[owner >= FIRST_BODY]):
        own = [solid for its_owner, solid in solids if its_owner == body]
        normal[owner == body] = _normals(own, boundary[owner == body], 0.1 * scene.spacing)
    return boundary, normal, owner


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
