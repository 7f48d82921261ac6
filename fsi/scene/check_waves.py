"""What a scene's waves cannot be, what they should not be, and what they are."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.errors import SceneError
from fsi.scene.model import Scene
from fsi.waves import Motion, piston, reach, wavenumber
from fsi.waves.regular import SECOND_ORDER_URSELL, order_of, ursell
from fsi.waves.sponge import reflection

BREAKING_DEPTH_RATIO = 0.78  # height over depth of a solitary wave that breaks (McCowan 1894)
BREAKING_STEEPNESS = 0.142  # height over length of a breaking wave in deep water (Michell 1893)
SEA_DEPTH_RATIO = 0.6  # Hm0 over depth that a sea hardly exceeds
SEA_STEEPNESS = 0.07  # Hm0 over the length at the peak that a sea hardly exceeds
FAST = 0.6  # piston speed over sqrt(g depth) that throws the water up
REFLECTING = 0.1  # part of the wave height that a damping zone had better not send back
LEAST_HEIGHT, LEAST_LENGTH = 4, 10  # spacings over the height and the length of a wave

Fault = tuple[str, str, str]  # key, fault, fix


def water_depth(scene: Scene) -> float:
    """Depth of the tank's floor below the still water level [m]; a bathymetry is not counted."""
    return scene.fluid.still_water_level - scene.tank.min[-1]


def wave_faults(scene: Scene) -> Iterator[Fault]:
    """What cannot work."""
    for check in (_place, _theory, _path) if scene.waves else ():
        faults = list(check(scene))
        yield from faults
        if faults:  # the next check builds on this one
            return


def _place(scene: Scene) -> Iterator[Fault]:
    depth = water_depth(scene)
    if "x-" not in scene.tank.walls:
        yield "tank.walls", "waves need the x- wall, where the piston stands", "add 'x-'"
    if depth <= 0:
        yield "fluid.still_water_level", f"waves need water: the depth is {depth:g} m", "raise it above the floor"
    elif scene.gravity == 0:
        yield "gravity", "waves need gravity", "use e.g. 9.81"
    elif scene.fluid.blocks:
        yield from _water_at_the_piston(scene)


def _water_at_the_piston(scene: Scene) -> Iterator[Fault]:
    """The piston's path follows from the still water level, so the blocks at its wall have to reach just that."""
    key, dr, level = "fluid.still_water_level", scene.spacing, scene.fluid.still_water_level
    blocks = [block for liquid in scene.all_liquids for block in liquid.blocks]
    tops = [block.max[-1] for block in blocks if block.min[0] < scene.tank.min[0] + dr]
    if not tops:
        yield "fluid.blocks", "no block meets the x- wall, where the piston stands", "let one begin at tank.min[0]"
    elif abs(max(tops) - level) > dr:
        fault = f"{level:g} m, and the blocks at the piston end at {max(tops):g} m, so that its waves would be wrong"
        yield key, fault, f"set it to {max(tops):g}, or let the blocks end at {level:g}"


def _theory(scene: Scene) -> Iterator[Fault]:
    """Heights that the theory behind the piston's path has no waves for."""
    waves, depth = scene.waves, water_depth(scene)
    if waves.kind == "solitary" and waves.wave_height > BREAKING_DEPTH_RATIO * depth:
        fault = f"{waves.wave_height:g} m is more than {BREAKING_DEPTH_RATIO} of the depth {depth:g} m"
        yield "waves.wave_height", f"{fault}, where a solitary wave breaks", "use a lower wave or deeper water"
    if waves.kind == "regular" and waves.order == 2:
        number = ursell(waves.wave_height, 2 * math.pi / _wave_length(scene, waves.period), depth)
        if number >= SECOND_ORDER_URSELL:
            fault = f"H L^2 / d^3 is {number:.0f}, and the second order ends at {SECOND_ORDER_URSELL:.0f}"
            yield "waves.order", fault, "set order = 1, or use lower or shorter waves, or deeper water"


def _path(scene: Scene) -> Iterator[Fault]:
    length = scene.tank.max[0] - scene.tank.min[0]
    try:
        back, forth = reach(scene.waves, water_depth(scene), scene.gravity)
    except SceneError:  # a bad table is told of as a file
        return
    if max(-back, forth) >= length / 4:
        fault = f"the piston moves from {back:.3g} to {forth:.3g} m; a quarter of the tank's length is {length / 4:g} m"
        yield "waves", fault, "use lower or shorter waves, or a longer tank"


def wave_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    if scene.waves is None:
        return []
    own = _KINDS.get(scene.waves.kind, lambda scene: ())
    return [*own(scene), *_speed(scene), *_reflecting(scene), *_duration(scene), *_in_the_way(scene)]


def wave_summary(scene: Scene) -> list[str]:
    """The waves in figures, one line each."""
    if scene.waves is None:
        return []
    motion = _motion(scene)
    back, forth = reach(scene.waves, water_depth(scene), scene.gravity)
    path = f"piston from {back:.3g} to {forth:.3g} m, at most {_fastest(scene, motion):.3g} m/s"
    kind = f"{scene.waves.kind}, absorbing" if scene.waves.absorb else scene.waves.kind
    if hasattr(motion, "end"):
        path += f", at rest from {motion.end:.3g} s on"
    zones = (
        f"{key}: {length:.2f} wave lengths at {rate:.1f} omega send back about {100 * part:.2g} %, by long-wave theory"
        for key, length, rate, part, _ in _responses(scene)
    )
    return [*(f"waves: {line}" for line in _figures(scene)), f"waves: {kind}, {path}", *zones]


def _motion(scene: Scene) -> Motion:
    return piston(scene.waves, water_depth(scene), scene.gravity)


def _wave_length(scene: Scene, period: float) -> float:
    return 2 * math.pi / wavenumber(2 * math.pi / period, water_depth(scene), scene.gravity)


def _trains(scene: Scene) -> list[tuple[str, float, float]]:
    """What each train of waves is called, its height [m] and its period [s]."""
    waves = scene.waves
    if waves.kind == "regular":
        order = order_of(waves, 2 * math.pi / _wave_length(scene, waves.period), water_depth(scene))
        return [(f"order {order}", waves.wave_height, waves.period)]
    if waves.kind == "irregular":
        return [("at the peak", waves.Hm0, waves.peak_period)]
    if waves.kind == "packet":
        return [(f"{group.waves:g} waves", group.wave_height, group.period) for group in waves.groups]
    return []


def _figures(scene: Scene) -> Iterator[str]:
    """Each train of waves: its length, depth, steepness and resolution."""
    dr, depth = scene.spacing, water_depth(scene)
    for name, height, period in _trains(scene):
        length = _wave_length(scene, period)
        yield (
            f"{name}, height {height:g} m, period {period:g} s, length {length:.3g} m, kd {2 * math.pi * depth / length:.2f}, "
            f"H/L {height / length:.3f}, {height / dr:.1f} spacings high, {length / dr:.0f} long"
        )
    if scene.waves.kind == "solitary":
        height = scene.waves.wave_height
        speed = math.sqrt(scene.gravity * (depth + height))
        yield f"height {height:g} m, H/d {height / depth:.2f}, speed {speed:.3g} m/s, {height / dr:.1f} spacings high"


def _responses(scene: Scene) -> Iterator[tuple[str, float, float, float, float]]:
    """Of each damping zone before the x+ wall, for the longest waves: key, length [wave length], rate [omega], reflection,
    omega [1/s]."""
    periods = [period for _, _, period in _trains(scene)]
    for n, zone in enumerate(scene.damping):
        if (
            not periods
            or zone.axis != "x"
            or "x+" not in scene.tank.walls
            or zone.end < scene.tank.max[0] - scene.spacing
        ):
            continue
        omega = 2 * math.pi / max(periods)
        length, rate = (zone.end - zone.start) / _wave_length(scene, max(periods)), zone.rate / omega
        yield f"damping[{n}]", length, rate, reflection(length, rate), omega


def _regular(scene: Scene) -> Iterator[str]:
    return _train(scene, "waves.wave_height", scene.waves.wave_height, scene.waves.period)


def _packet(scene: Scene) -> Iterator[str]:
    for n, group in enumerate(scene.waves.groups):
        yield from _train(scene, f"waves.groups[{n}].wave_height", group.wave_height, group.period)


def _train(scene: Scene, key: str, height: float, period: float) -> Iterator[str]:
    """Breaking and resolution of regular waves."""
    depth, length = water_depth(scene), _wave_length(scene, period)
    if height > BREAKING_DEPTH_RATIO * depth:
        yield (
            f"{key}: {height:g} m is {height / depth:.2f} of the depth {depth:g} m; "
            f"waves break at about {BREAKING_DEPTH_RATIO}"
        )
    if height > BREAKING_STEEPNESS * length:
        yield (
            f"{key}: {height:g} m is {height / length:.2f} of the wave length {length:.3g} m; "
            f"waves break at {BREAKING_STEEPNESS} of it at most"
        )
    yield from _resolved(scene, "the wave height", height, LEAST_HEIGHT)
    yield from _resolved(scene, "the wave length", length, LEAST_LENGTH)


def _irregular(scene: Scene) -> Iterator[str]:
    waves, depth = scene.waves, water_depth(scene)
    length = _wave_length(scene, waves.peak_period)
    if waves.Hm0 > SEA_DEPTH_RATIO * depth:
        yield (
            f"waves.Hm0: {waves.Hm0:g} m is {waves.Hm0 / depth:.2f} of the depth {depth:g} m; "
            f"a sea hardly exceeds {SEA_DEPTH_RATIO}, higher waves break"
        )
    if waves.Hm0 > SEA_STEEPNESS * length:
        yield (
            f"waves.Hm0: {waves.Hm0:g} m is {waves.Hm0 / length:.2f} of the wave length {length:.3g} m at the peak; "
            f"a sea hardly exceeds {SEA_STEEPNESS}, steeper waves break"
        )
    shortest = _wave_length(scene, waves.peak_period / waves.highest)
    yield from _resolved(scene, "Hm0", waves.Hm0, LEAST_HEIGHT)
    yield from _resolved(scene, "the shortest wave", shortest, LEAST_LENGTH)


def _solitary(scene: Scene) -> Iterator[str]:
    yield from _resolved(scene, "the wave height", scene.waves.wave_height, LEAST_HEIGHT)


def _resolved(scene: Scene, what: str, size: float, least: int) -> Iterator[str]:
    if size < least * scene.spacing * (1 - 1e-9):
        yield (
            f"spacing: {scene.spacing:g} m gives {size / scene.spacing:.1f} particles over {what} "
            f"{size:.3g} m; such waves decay within a few lengths"
        )


def _speed(scene: Scene) -> Iterator[str]:
    limit = math.sqrt(scene.gravity * water_depth(scene))
    fastest = _fastest(scene, _motion(scene))
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
    furthest = scene.tank.min[0] + reach(scene.waves, water_depth(scene), scene.gravity)[1]
    for name, gauge in scene.gauges.items():
        if gauge.x < furthest:
            yield f"gauges.{name}.x: {gauge.x:g} m lies in the path of the piston, which may come to {furthest:.3g} m"


def _duration(scene: Scene) -> Iterator[str]:
    end = getattr(_motion(scene), "end", 0.0)
    if end > scene.duration:
        yield f"duration: the run ends at {scene.duration:g} s, and the piston has made its waves at {end:.3g} s"


def _fastest(scene: Scene, motion: Motion) -> float:
    """Largest speed of the piston in the run [m/s]."""
    return max(abs(motion(float(t))[1]) for t in np.linspace(0, scene.duration, 2001))


_KINDS = {"regular": _regular, "irregular": _irregular, "packet": _packet, "solitary": _solitary}
