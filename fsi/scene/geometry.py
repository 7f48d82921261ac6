"""The geometry of a scene: how deep its water is, how much of it there is, where its blocks are, how far its piston goes.

Every other module asks here, so that a check, an estimate and a run never judge one scene by two depths.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from fsi.errors import SceneError
from fsi.scene.model import Block, Scene
from fsi.scene.region import shaped, volume
from fsi.waves import Motion, piston
from fsi.waves.incident import IncidentWaves
from fsi.waves.kind import Water, WaveKind

ZONE_RATE, ZONE_POWER = 1.45, 1.0  # of the zones of a sea: rate over omega, how it grows (docs/guide/waves.md)
ALONG = 1e-6  # sine of the angle within which waves run along a wall
EXCURSION = 1.3  # excursion of walls over that of the water at still water level: crests, and the second order


def all_blocks(scene: Scene) -> dict[str, Block]:
    """Every block of liquid by its key."""
    owners = {"fluid": scene.fluid} | {f"liquids.{name}": liquid for name, liquid in scene.liquids.items()}
    return {f"{key}.blocks[{n}]": block for key, liquid in owners.items() for n, block in enumerate(liquid.blocks)}


def fluid_top(scene: Scene) -> float:
    """Height of the highest fluid at t = 0 [m]."""
    tops = [block.max[-1] for block in all_blocks(scene).values()]
    return max(tops if scene.fluid.blocks else [*tops, scene.fluid.still_water_level])


def fluid_height(scene: Scene) -> float:
    """From the lowest to the highest fluid at t = 0 [m]: the column that sets the speed of sound."""
    if scene.fluid.blocks:
        blocks = all_blocks(scene).values()
        return max(b.max[-1] for b in blocks) - min(b.min[-1] for b in blocks)
    return scene.fluid.still_water_level - scene.tank.min[-1]


def fluid_depth(scene: Scene) -> float:
    """Height of the highest fluid at t = 0 above the tank's floor [m]: the range of its hydrostatic pressure."""
    return fluid_top(scene) - scene.tank.min[-1]


def wave_depth(scene: Scene) -> float:
    """Depth of the water that the waves are made in, at the piston [m]: from the highest fluid there at t = 0 to the tank's
    floor. A bathymetry is not counted."""
    if not scene.fluid.blocks:
        return scene.fluid.still_water_level - scene.tank.min[-1]
    near = scene.tank.min[0] + 0.5 * scene.spacing
    tops = [b.max[-1] for b in all_blocks(scene).values() if b.min[0] < near]
    return max(tops, default=scene.tank.min[-1]) - scene.tank.min[-1]


WHOLE = 0.02  # spacings by which a length may differ from a whole number of them
SAMPLES = 16  # places along each axis of the side of a block, at which it is asked what is beside it
FEWEST = 4  # cells along an axis, from which on they are stretched


def cell(scene: Scene) -> tuple[float, ...]:
    """Sides (dim,) of the cells that fluid starts in [m]: the spacing, stretched along each axis so that a whole number of them
    reaches from the tank's corner to its far side, or up to the still water level; with blocks, to where they end. Where
    that is less than `FEWEST`, they are as they are."""
    tank, fluid = scene.tank, scene.fluid
    ends = [*tank.max[:-1], fluid.still_water_level]
    if fluid.blocks:
        farthest = np.max([block.max for block in all_blocks(scene).values()], axis=0)
        ends = np.minimum(farthest, tank.max).tolist()
    sides = []
    for low, high in zip(tank.min, ends, strict=True):
        count = round((high - low) / scene.spacing)
        whole = abs(high - low - count * scene.spacing) < WHOLE * scene.spacing
        sides.append(scene.spacing if whole or count < FEWEST else (high - low) / count)
    return tuple(sides)


def start(scene: Scene, fixed: bool = False) -> str:
    """What the scene starts from: "hydrostatic", "converged" or "zero" pressure, or "settled". A block with a free side has no
    hydrostatic pressure once it is let go, and with that a dam break would gain energy. Water that meets a bathymetry or
    other `fixed` solids, which cut its lattice anywhere, settles, where nothing says that it should move."""
    if scene.fluid.start != "auto":
        return scene.fluid.start
    if scene.gravity > 0 and scene.fluid.blocks and _free_side(scene):
        return "converged"
    return "settled" if fixed and not restless(scene) else "hydrostatic"


def restless(scene: Scene) -> str:
    """Why the fluid of a scene is not at rest at t = 0 [the key that says so], empty where it is."""
    fluid, blocks = scene.fluid, all_blocks(scene)
    if scene.gravity == 0:
        return "gravity"
    if fluid.acceleration or fluid.acceleration_gradient:
        return "fluid.acceleration" if fluid.acceleration else "fluid.acceleration_gradient"
    if scene.liquids:
        return "liquids"
    if scene.sea:
        return "sea"
    if moved := [key for key, block in blocks.items() if block.velocity]:
        return f"{moved[0]}.velocity"
    return "fluid.blocks" if blocks and _free_side(scene) else ""


def _free_side(scene: Scene) -> bool:
    """Whether a side of a block, a spacing or more high, has neither a wall nor another block beside it; taken as so where a
    block is no box."""
    tank, blocks, dr = scene.tank, list(all_blocks(scene).values()), scene.spacing
    if any(shaped(block) for block in blocks):
        return True
    lows, highs = (np.array([getattr(block, end) for block in blocks]) for end in ("min", "max"))
    for d, name in enumerate(tank.axes[:-1]):
        if name in tank.periodic:
            continue
        for block in blocks:
            for side, edge, end in (("-", block.min[d], tank.min[d]), ("+", block.max[d], tank.max[d])):
                out = 1 if side == "+" else -1
                if f"{name}{side}" in tank.walls and (edge - end) * out > -dr:
                    continue
                axes = [np.linspace(a, b, SAMPLES + 2)[1:-1] for a, b in zip(block.min, block.max, strict=True)]
                axes[d] = np.array([edge + 0.5 * out * dr])
                beside = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 1, len(axes))
                covered = ((beside > lows) & (beside < highs)).all(2).any(1).mean()
                if (1 - covered) * (block.max[-1] - block.min[-1]) > dr:
                    return True
    return False


def fluid_volume(scene: Scene) -> float:
    """Volume of the fluid at t = 0 [m3], or its area in two dimensions [m2]; solids in it are not taken off."""
    if scene.fluid.blocks:
        return sum(volume(block) for block in all_blocks(scene).values())
    across = np.subtract(scene.tank.max, scene.tank.min)[:-1]
    return math.prod(across) * (scene.fluid.still_water_level - scene.tank.min[-1])


def piston_motion(scene: Scene) -> Motion | None:
    """The motion of the scene's piston, None without waves; one scene's is built once. Raises SceneError for a bad table."""
    if scene.waves is None:
        return None
    file = getattr(scene.waves, "file", None)
    stamp = (file.stat().st_mtime_ns, file.stat().st_size) if file and file.is_file() else None
    return _motion(scene.waves, wave_depth(scene), scene.gravity, stamp)


@lru_cache(maxsize=4)
def _motion(waves, depth: float, g: float, stamp: tuple | None) -> Motion:
    return piston(waves, depth, g)


def piston_path(scene: Scene) -> tuple[float, float]:
    """The least and the largest displacement of the piston [m], 0 without waves."""
    return scene.waves.excursion(piston_motion(scene)) if scene.waves else (0.0, 0.0)


def incident_waves(scene: Scene) -> IncidentWaves:
    """The waves of the scene's sea; one scene's are made once. Raises SceneError for a kind without any."""
    sea, water = scene.sea, Water(wave_depth(scene), scene.gravity, scene.spacing)
    kind, ramp = drifting_waves(scene), 0.0
    if sea.start == "rest":
        given = getattr(sea.waves, "ramp", None)
        ramp = 2 * longest_period(scene) if given is None else given
    file = getattr(sea.waves, "file", None)
    stamp = (file.stat().st_mtime_ns, file.stat().st_size) if file and file.is_file() else None
    found = _incident(kind, water.depth, water.g, stamp, sea.spreading, sea.order)
    if found is None:
        fix = "use regular, nonlinear, irregular, spectrum, measured or focused, or a flume with [waves]"
        raise SceneError(
            f"waves of the kind {sea.waves.kind!r} come from a piston alone", key="sea.waves.kind", fix=fix
        )
    found = found.turned(math.radians(sea.heading), ramp)
    if sea.current is None and not endless(scene):
        return found
    from fsi.waves.current import on_current

    return on_current(found, sea_current(scene), endless(scene))


def sea_current(scene: Scene) -> np.ndarray:
    """The current (2,) [m/s] of the scene's sea."""
    given = np.zeros(2)
    if scene.sea.current is not None:
        parts = np.atleast_1d(scene.sea.current)[:2]
        given[: len(parts)] = parts
    return given


def endless(scene: Scene) -> bool:
    """Whether the waves of the scene's sea run along a periodic axis."""
    return "x" in scene.tank.periodic


def drifting_waves(scene: Scene) -> WaveKind:
    """The waves of the scene's sea as water that drifts with its current sees them. Raises SceneError where it stops them."""
    waves = scene.sea.waves
    if not endless(scene) or not hasattr(waves, "period"):
        return waves
    along = math.cos(math.radians(scene.sea.heading)) * float(sea_current(scene)[0])
    return _retimed(waves, wave_depth(scene), scene.gravity, along)


@lru_cache(maxsize=4)
def _retimed(waves, depth: float, g: float, along: float) -> WaveKind:
    from fsi.waves.current import retimed

    return retimed(waves, depth, g, along)


@lru_cache(maxsize=4)
def _incident(waves, depth: float, g: float, stamp: tuple | None, spreading, order: int) -> IncidentWaves | None:
    found = waves.incident(depth, g)
    if found is None or (spreading is None and order == 1):
        return found
    from fsi.waves.second_order import spread, with_bound_waves

    if spreading is not None:
        found = spread(found, spreading, getattr(waves, "seed", 1))
    return with_bound_waves(found) if order == 2 else found


def longest_period(scene: Scene) -> float:
    """Of the trains of waves of the scene's sea, where a current carries them seen from its water [s]."""
    water = Water(wave_depth(scene), scene.gravity, scene.spacing)
    return max(train.period for train in drifting_waves(scene).trains(water))


def sea_zone(scene: Scene) -> tuple[float, float]:
    """Width [m] of the zones of the scene's sea, and their rate [1/s]."""
    period = longest_period(scene)
    length = Water(wave_depth(scene), scene.gravity, scene.spacing).length(period)
    return scene.sea.zone or 0.5 * length, scene.sea.rate or ZONE_RATE * 2 * math.pi / period


def sea_sides(scene: Scene) -> list[str]:
    """Sides of the tank along which the sea has zones: all but those of a periodic axis that neither its waves nor its current
    run along."""
    current = sea_current(scene)
    axes = [a for n, a in enumerate(scene.tank.axes[:-1]) if a not in scene.tank.periodic or a == "x" or current[n]]
    return [f"{a}{s}" for a in axes for s in "-+"]


def moving_sides(scene: Scene) -> set[str]:
    """Sides of the tank whose walls move: the piston's, or those that the waves of the sea do not run along."""
    if scene.waves is not None:
        return {"x-"}
    if scene.sea is None:
        return set()
    walls = {side for side in sea_sides(scene) if side[0] not in scene.tank.periodic}
    if scene.sea.spreading is not None:
        return walls
    turn = math.radians(scene.sea.heading)
    across = {"x": abs(math.cos(turn)) > ALONG, "y": abs(math.sin(turn)) > ALONG}
    return {side for side in walls if across[side[0]]}


def retreats(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """How far the lower and the upper walls across each axis (dim,) move out of the tank [m]."""
    low, high = np.zeros(scene.dimension), np.zeros(scene.dimension)
    if scene.waves is not None:
        low[0] = piston_retreat(scene)
    elif scene.sea is not None:
        most = EXCURSION * incident_waves(scene).excursion
        for n, axis in enumerate(scene.tank.axes):
            low[n], high[n] = (most * (f"{axis}{sign}" in moving_sides(scene)) for sign in "-+")
    return low, high


def piston_retreat(scene: Scene) -> float:
    """How far the piston moves back, out of the tank [m]."""
    return max(0.0, -piston_path(scene)[0])
