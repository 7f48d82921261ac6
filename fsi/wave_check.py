"""What a scene's waves cannot be, what they should not be, and what they are."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.errors import SceneError
from fsi.scene import Scene
from fsi.waves import Motion, piston, wavenumber
from fsi.waves.regular import SECOND_ORDER_URSELL, order_of, ursell

BREAKING_DEPTH_RATIO = 0.78  # height over depth of a solitary wave that breaks (McCowan 1894)
BREAKING_STEEPNESS = 0.142  # height over length of a breaking wave in deep water (Michell 1893)
SEA_DEPTH_RATIO = 0.6  # Hm0 over depth that a sea hardly exceeds
SEA_STEEPNESS = 0.07  # Hm0 over the length at the peak that a sea hardly exceeds
FAST = 0.6  # piston speed over sqrt(g depth) that throws the water up
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
        back, forth = _motion(scene).reach
    except SceneError:  # a bad table is told of as a file
        return
    if max(-back, forth) >= length / 4:
        fault = f"the piston moves from {back:.3g} to {forth:.3g} m; a quarter of the tank's length is {length / 4:g} m"
        yield "waves", fault, "use lower or shorter waves, or a longer tank"


def wave_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    if scene.waves is None:
        return []
    return [*_KINDS.get(scene.waves.kind, lambda scene: ())(scene), *_speed(scene)]


def wave_summary(scene: Scene) -> list[str]:
    """The waves in figures, one line each."""
    if scene.waves is None:
        return []
    motion = _motion(scene)
    back, forth = motion.reach
    path = f"piston from {back:.3g} to {forth:.3g} m, at most {_fastest(scene, motion):.3g} m/s"
    return [*(f"waves: {line}" for line in _figures(scene)), f"waves: {scene.waves.kind}, {path}"]


def _motion(scene: Scene) -> Motion:
    return piston(scene.waves, water_depth(scene), scene.gravity)


def _wave_length(scene: Scene, period: float) -> float:
    return 2 * math.pi / wavenumber(2 * math.pi / period, water_depth(scene), scene.gravity)


def _figures(scene: Scene) -> Iterator[str]:
    """Each train of waves: its length, depth, steepness and resolution."""
    waves = scene.waves
    if waves.kind == "regular":
        order = order_of(waves, 2 * math.pi / _wave_length(scene, waves.period), water_depth(scene))
        trains = [(f"order {order}, ", waves.wave_height, waves.period)]
    elif waves.kind == "irregular":
        trains = [("at the peak, ", waves.Hm0, waves.peak_period)]
    elif waves.kind == "packet":
        trains = [(f"{group.waves:g} waves, ", group.wave_height, group.period) for group in waves.groups]
    else:
        trains = []
    for name, height, period in trains:
        length, depth = _wave_length(scene, period), water_depth(scene)
        yield (
            f"{name}height {height:g} m, period {period:g} s, length {length:.3g} m, kd {2 * math.pi * depth / length:.2f}, "
            f"H/L {height / length:.3f}, {height / scene.spacing:.1f} spacings high, {length / scene.spacing:.0f} long"
        )


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


def _fastest(scene: Scene, motion: Motion) -> float:
    """Largest speed of the piston in the run [m/s]."""
    return max(abs(motion(float(t))[1]) for t in np.linspace(0, scene.duration, 2001))


_KINDS = {"regular": _regular, "irregular": _irregular, "packet": _packet, "solitary": _solitary}
