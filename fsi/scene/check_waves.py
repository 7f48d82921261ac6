"""What a scene's waves cannot be, what they should not be, and what they are."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.protocols import Solid
from fsi.scene.geometry import piston_motion, piston_path, wave_depth
from fsi.scene.model import Block, Scene
from fsi.scene.region import shaped
from fsi.waves.kind import Fault, Motion, Water, WaveKind
from fsi.waves.sponge import reflection

FAST = 0.6  # piston speed over sqrt(g depth) that throws the water up
REFLECTING = 0.1  # part of the wave height that a damping zone had better not send back
SLOW, ORDER = 0.02, 2.5  # part of their speed that waves had better not lose to the spacing, and how that falls with it
SHALLOWER = 0.02  # part of the depth that the bed may stand over the tank's floor at the piston
STEPS, ACROSS = 500, 9  # places over the depth and across the tank, at which it is looked for


def wave_faults(scene: Scene) -> Iterator[Fault]:
    """What cannot work."""
    for check in (_place, _kind, _path) if scene.waves else ():
        faults = list(check(scene))
        yield from faults
        if faults:  # the next check builds on this one
            return


def _place(scene: Scene) -> Iterator[Fault]:
    depth = wave_depth(scene)
    if "x-" not in scene.tank.walls:
        yield "tank.walls", "waves need the x- wall, where the piston stands", "add 'x-'"
    if scene.fluid.blocks and not _tops(scene):
        yield "fluid.blocks", "no block meets the x- wall, where the piston stands", "let one begin at tank.min[0]"
    elif any(shaped(block) for block in _at_the_piston(scene)):
        yield (
            "fluid.blocks",
            "a block that is no box meets the x- wall, where the piston stands",
            "begin with a box there",
        )
    elif depth <= 0:
        yield "fluid.still_water_level", f"waves need water: the depth is {depth:g} m", "raise it above the floor"
    elif scene.gravity == 0:
        yield "gravity", "waves need gravity", "use e.g. 9.81"


def _tops(scene: Scene) -> list[float]:
    """Where the blocks of fluid at the piston end [m]."""
    return [block.max[-1] for block in _at_the_piston(scene)]


def _at_the_piston(scene: Scene) -> list[Block]:
    blocks = [block for liquid in scene.all_liquids for block in liquid.blocks]
    return [block for block in blocks if block.min[0] < scene.tank.min[0] + scene.spacing]


def _level_at_the_piston(scene: Scene) -> Iterator[str]:
    """Waves are made for the water at the piston; gauges and damping refer to the still water level."""
    level, tops = scene.fluid.still_water_level, _tops(scene)
    if tops and abs(max(tops) - level) > scene.spacing:
        yield (
            f"fluid.still_water_level: {level:g} m, and the blocks at the piston end at {max(tops):g} m: waves are made for "
            f"the {wave_depth(scene):g} m of water there, and gauges read from {level:g} m; set it to {max(tops):g}"
        )


def _kind(scene: Scene) -> Iterator[Fault]:
    return scene.waves.faults(_water(scene))


def _path(scene: Scene) -> Iterator[Fault]:
    length = scene.tank.max[0] - scene.tank.min[0]
    back, forth = piston_path(scene)
    if max(-back, forth) >= length / 4:
        fault = f"the piston moves from {back:.3g} to {forth:.3g} m; a quarter of the tank's length is {length / 4:g} m"
        yield "waves", fault, "use lower or shorter waves, or a longer tank"


def wave_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    if scene.waves is None:
        return []
    own = scene.waves.warnings(_water(scene))
    return [
        *_level_at_the_piston(scene),
        *own,
        *slow_waves(scene, scene.waves),
        *_speed(scene),
        *_reflecting(scene),
        *_duration(scene),
        *_in_the_way(scene),
    ]


def slowing(length: float, depth: float, spacing: float, ratio: float) -> float:
    """Part of their speed that waves of this length [m] lose to the spacing at this h / dr, mostly in the four rows under the
    surface; fitted to boxes with 21 to 84 spacings over the length at kd = 0.75 to 3, within 0.8 %, 0.4 % from 31 on."""
    return 0.022 * (42 * spacing / length) ** ORDER * (ratio / 2) ** 4 * math.tanh(math.pi * depth / length)


def slow_waves(scene: Scene, waves: WaveKind) -> Iterator[str]:
    """The train of waves that the spacing slows most, where that is told in phases and places."""
    water, solver = _water(scene), scene.numerics.solver
    lengths = [water.length(train.period) for train in waves.trains(water)] if solver != "iisph" else []
    if not lengths:
        return
    length, ratio = min(lengths), scene.numerics.smoothing_ratio
    lost = slowing(length, water.depth, water.spacing, ratio)
    if lost > SLOW:
        enough = water.spacing * (SLOW / lost) ** (1 / ORDER)
        yield (
            f"spacing: {water.spacing:g} m gives {length / water.spacing:.0f} particles over the wave length {length:.3g} m; "
            f"such waves run about {100 * lost:.0f} % too slow, {100 * SLOW:.0f} % with {enough:.2g} m (docs/guide/waves.md)"
        )


def wave_summary(scene: Scene) -> list[str]:
    """The waves in figures, one line each."""
    if scene.waves is None:
        return []
    motion = piston_motion(scene)
    back, forth = piston_path(scene)
    path = f"piston from {back:.3g} to {forth:.3g} m, at most {_fastest(scene, motion):.3g} m/s"
    kind = f"{scene.waves.kind}, absorbing" if scene.waves.absorb else scene.waves.kind
    if hasattr(motion, "end"):
        path += f", at rest from {motion.end:.3g} s on"
    zones = (
        f"{key}: {length:.2f} wave lengths at {rate:.1f} omega send back about {100 * part:.2g} %, by long-wave theory"
        for key, length, rate, part, _ in _responses(scene)
    )
    return [*(f"waves: {line}" for line in scene.waves.figures(_water(scene))), f"waves: {kind}, {path}", *zones]


def _water(scene: Scene) -> Water:
    return Water(wave_depth(scene), scene.gravity, scene.spacing, scene.duration)


def bed_at_piston(scene: Scene, ground: Solid | None) -> list[str]:
    """A warning where the bathymetry stands over the tank's floor at the piston: the waves are those of the depth to the
    floor."""
    if scene.waves is None or ground is None:
        return []
    low, level, depth = scene.tank.min, scene.fluid.still_water_level, wave_depth(scene)
    sides = [(low[0] + 0.5 * scene.spacing,)]
    if scene.dimension == 3:
        sides = [(*sides[0], y) for y in np.linspace(low[1], scene.tank.max[1], ACROSS + 2)[1:-1]]
    heights = np.linspace(level - depth, level, STEPS)
    points = np.array([(*side, z) for side in sides for z in heights])
    covered = (ground.clearance(points) < 0.0).reshape(len(sides), STEPS).mean()
    if covered < SHALLOWER:
        return []
    bed = level - depth * (1 - covered)
    return [
        f"tank.bathymetry: at the piston the bed lies at z = {bed:.3g} m, {covered * depth:.2g} m over the tank's floor: "
        f"the waves are made for {depth:.3g} m of water where there are {level - bed:.3g} m; "
        f"set tank.min[{len(low) - 1}] = {bed:.3g}"
    ]


def _responses(scene: Scene) -> Iterator[tuple[str, float, float, float, float]]:
    """Of each damping zone before the x+ wall, for the longest waves: key, length [wave length], rate [omega], reflection,
    omega [1/s]."""
    water = _water(scene)
    periods = [train.period for train in scene.waves.trains(water)]
    for n, zone in enumerate(scene.damping):
        if (
            not periods
            or zone.axis != "x"
            or "x+" not in scene.tank.walls
            or zone.end < scene.tank.max[0] - scene.spacing
        ):
            continue
        omega = 2 * math.pi / max(periods)
        length, rate = (zone.end - zone.start) / water.length(max(periods)), zone.rate / omega
        yield f"damping[{n}]", length, rate, reflection(length, rate), omega


def _speed(scene: Scene) -> Iterator[str]:
    limit = math.sqrt(scene.gravity * wave_depth(scene))
    fastest = _fastest(scene, piston_motion(scene))
    if fastest > FAST * limit:
        yield (
            f"waves: the piston reaches {fastest:.3g} m/s, {fastest / limit:.2f} of sqrt(g depth); "
            f"from about {FAST} on it throws the water up; use lower waves or deeper water"
        )


def _reflecting(scene: Scene) -> Iterator[str]:
    for key, length, _, part, omega in _responses(scene):
        if part > REFLECTING:
            yield (
                f"{key}: {length:.2f} wave lengths long, sends back about {100 * part:.0f} % of the wave height; "
                f"make it about a wave length long with rate = {2.5 * omega:.2g}"
            )


def _in_the_way(scene: Scene) -> Iterator[str]:
    furthest = scene.tank.min[0] + piston_path(scene)[1]
    for name, gauge in scene.gauges.items():
        if gauge.x < furthest:
            yield f"gauges.{name}.x: {gauge.x:g} m lies in the path of the piston, which may come to {furthest:.3g} m"


def _duration(scene: Scene) -> Iterator[str]:
    ramp = getattr(scene.waves, "ramp", None) or 0.0
    if ramp >= scene.duration:
        yield f"waves.ramp: {ramp:g} s, and the run ends at {scene.duration:g} s: the waves do not come to their height"
    end = getattr(piston_motion(scene), "end", 0.0)
    if end > scene.duration:
        yield f"duration: the run ends at {scene.duration:g} s, and the piston has made its waves at {end:.3g} s"


def _fastest(scene: Scene, motion: Motion) -> float:
    """Largest speed of the piston in the run [m/s]."""
    return max(abs(motion(float(t))[1]) for t in np.linspace(0, scene.duration, 2001))
