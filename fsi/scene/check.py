"""Checks of a scene's values against each other, before anything is allocated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.errors import SceneError
from fsi.scene.check_effect import idle_values
from fsi.scene.check_liquids import all_blocks, liquid_faults, liquid_warnings
from fsi.scene.check_size import size_faults
from fsi.scene.check_waves import Fault, water_depth, wave_faults, wave_warnings
from fsi.scene.model import Box, Scene
from fsi.waves import TablePiston


def check_scene(scene: Scene, file: object = "") -> None:
    """Raise SceneError with one line for each contradiction in the scene."""
    checks = (_output, _positions, liquid_faults, _periodic, _field, _resolution, wave_faults, _coupler, _files)
    # The other checks combine points, so they wait for the dimensions.
    faults = list(_dimensions(scene)) or list(_sizes(scene)) or [fault for check in checks for fault in check(scene)]
    if faults:
        raise SceneError("\n".join(str(SceneError(fault, key=key, file=file, fix=fix)) for key, fault, fix in faults))


def scene_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    return wave_warnings(scene) + liquid_warnings(scene) + idle_values(scene)


def fluid_depth(scene: Scene) -> float:
    """Height of the highest fluid at the start above the tank's floor [m]."""
    return (
        max((block.max[-1] for block in scene.fluid.blocks), default=scene.fluid.still_water_level) - scene.tank.min[-1]
    )


def fluid_volume(scene: Scene) -> float:
    """Volume of the fluid at the start [m3], or its area in two dimensions [m2]; solids in it are not taken off."""
    if scene.fluid.blocks:
        return sum(math.prod(np.subtract(block.max, block.min).tolist()) for block in all_blocks(scene).values())
    return math.prod(np.subtract(scene.tank.max, scene.tank.min)[:-1].tolist()) * water_depth(scene)


def _dimensions(scene: Scene) -> Iterator[Fault]:
    points = {"tank.min": scene.tank.min}
    for key, block in all_blocks(scene).items():
        points[f"{key}.min"] = block.min
        points[f"{key}.velocity"] = block.velocity or block.min
    if scene.fluid.acceleration:
        points["fluid.acceleration"] = scene.fluid.acceleration
    points |= {f"probes.{name}.position": probe.position for name, probe in scene.probes.items()}
    for n, row in enumerate(scene.fluid.acceleration_gradient or ()):
        points[f"fluid.acceleration_gradient[{n}]"] = row
    axes = "x, z" if scene.dimension == 2 else "x, y, z"
    for key, point in points.items():
        if len(point) != scene.dimension:
            yield key, f"{list(point)} has {len(point)} components in {scene.dimension} dimensions", f"give {axes}"


def _sizes(scene: Scene) -> Iterator[Fault]:
    return size_faults(scene, max(0.0, fluid_volume(scene)), fluid_depth(scene))


def _output(scene: Scene) -> Iterator[Fault]:
    """Fields that this scene's particles do not have."""
    turbulent = scene.numerics.turbulence != "none"
    there = {
        "liquid": bool(scene.liquids),
        "eddy_viscosity": turbulent,
        "viscosity": scene.numerics.viscosity != "none"
        and (turbulent or len(scene.all_liquids) > 1 or scene.fluid.rheology is not None),
    }
    if not scene.output.fields:
        yield "output.fields", "names no field to colour the particles with", "give one, or leave it out"
    for field in scene.output.fields:
        if not there.get(field, True):
            yield "output.fields", f"particles of this scene have no field {field!r}", "remove it"


def _positions(scene: Scene) -> Iterator[Fault]:
    tank, level = scene.tank, scene.fluid.still_water_level
    low, high = tank.min[-1], tank.max[-1]
    if not scene.fluid.blocks and not low < level <= high:
        yield "fluid.still_water_level", f"{level:g} m is not in the tank, z = {low:g} to {high:g} m", "move it inside"
    for n, zone in enumerate(scene.damping):
        axis = "xy".index(zone.axis)
        if zone.axis == "y" and scene.dimension == 2:
            yield f"damping[{n}].axis", "a two-dimensional scene has no y axis", 'use axis = "x"'
        elif zone.start == zone.end:
            yield f"damping[{n}]", f"start and end are both {zone.end:g} m", "move one of them"
        elif min(zone.start, zone.end) < tank.min[axis] or max(zone.start, zone.end) > tank.max[axis]:
            span = f"{zone.axis} = {tank.min[axis]:g} to {tank.max[axis]:g} m"
            fault = f"{zone.axis} = {zone.start:g} to {zone.end:g} m leaves the tank, {span}"
            yield f"damping[{n}]", fault, "shorten it"
    for name, gauge in scene.gauges.items():
        place = (gauge.x,) if scene.dimension == 2 else (gauge.x, gauge.y)
        for axis, value, a, b in zip("xy", place, tank.min, tank.max, strict=False):
            if not a <= value <= b:
                fault = f"{value:g} m is outside the tank, {axis} = {a:g} to {b:g} m"
                yield f"gauges.{name}.{axis}", fault, "move it inside"
    for name, probe in scene.probes.items():
        if not _inside(tank, probe.position):
            fault = f"{list(probe.position)} is outside the tank {_span(tank)}"
            yield f"probes.{name}.position", fault, "move it inside"


def _periodic(scene: Scene) -> Iterator[Fault]:
    tank, key, names = scene.tank, "tank.periodic", scene.tank.axes
    for name in tank.periodic:
        if name not in names:
            yield key, f"a two-dimensional scene has no {name} axis", "leave it out"
            continue
        d = names.index(name)
        count, least = (tank.max[d] - tank.min[d]) / scene.spacing, 8.1 * scene.numerics.smoothing_ratio
        if count < least:
            yield key, f"the tank is {count:.1f} spacings long along {name}", f"give it {math.ceil(least)} or more"
        elif abs(count - round(count)) > 1e-6 * count:
            yield key, f"the tank is {count:g} spacings long along {name}", "make it a whole number"
    if "x" in tank.periodic and scene.waves:
        yield key, "a piston stands at the end of the x axis", 'leave "x" out or remove [waves]'
    if "z" in tank.periodic and scene.gravity > 0:
        yield key, "gravity acts along z", "set gravity = 0"
    if tank.periodic and scene.bodies:
        yield key, "bodies do not repeat along a periodic axis", "use walls far away instead"


def _field(scene: Scene) -> Iterator[Fault]:
    gradient, key = scene.fluid.acceleration_gradient, "fluid.acceleration_gradient"
    if gradient is None:
        return
    if len(gradient) != scene.dimension:
        yield key, f"{len(gradient)} rows in {scene.dimension} dimensions", "give a row for each axis"
    if scene.tank.walls or scene.tank.periodic or scene.tank.bathymetry or scene.bodies:
        yield (
            key,
            "acts on a free body of fluid alone, which touches no solid",
            "set tank.walls = [] and leave solids out",
        )


def _resolution(scene: Scene) -> Iterator[Fault]:
    blocks = scene.fluid.blocks
    depth = max((b.max[-1] - b.min[-1] for b in blocks), default=water_depth(scene))
    if 0 < depth < 4 * scene.spacing * (1 - 1e-9):
        fault = f"{scene.spacing:g} m gives {depth / scene.spacing:.1f} particles over the fluid's depth {depth:g} m"
        yield "spacing", fault, f"use {depth / 4:.2g} m or less, for at least 4"


def _coupler(scene: Scene) -> Iterator[Fault]:
    scheme, motion = scene.coupler.scheme, scene.coupler.motion
    if scheme == "prescribed" and not motion:
        yield "coupler.motion", "scheme 'prescribed' needs a motion", "add [coupler.motion.JOINT] with amplitude, omega"
    if scheme != "prescribed" and motion:
        yield "coupler.scheme", f"coupler.motion is of no use to {scheme!r}", "set scheme = 'prescribed'"
    if scheme == "prescribed" and (driven := next((name for name, body in scene.bodies.items() if body.pto), None)):
        yield f"bodies.{driven}.pto", "has no effect on prescribed motion", "remove it, or use scheme = 'added_mass'"
    if motion and not scene.bodies:
        yield "coupler.motion", "there are no bodies to move", "add [bodies.NAME] with mjcf"


def _files(scene: Scene) -> Iterator[Fault]:
    files = {f"bodies.{name}.mjcf": body.mjcf for name, body in scene.bodies.items()}
    tables = {f"coupler.motion.{joint}.file": m.file for joint, m in scene.coupler.motion.items() if hasattr(m, "file")}
    if scene.tank.bathymetry:
        files["tank.bathymetry"] = scene.tank.bathymetry
    if hasattr(scene.waves, "file"):
        tables["waves.file"] = scene.waves.file
    for key, path in (files | tables).items():
        if not path.is_file():
            yield key, f"no such file: {path}", "check the path; it is relative to the scene file"
        elif key in tables:
            try:
                motion = TablePiston(path)
            except SceneError as error:
                yield key, error.fault, error.fix
                continue
            start = float(motion(0.0)[0])
            if key == "waves.file" and abs(start) > 1e-6 * max(map(abs, motion.reach)):
                first = f"the first row is {motion.t[0]:g}, {motion.x[0]:g}"
                fault = f"column position: {first}, so the piston begins at {start:.4g} m, and the wall is at 0"
                yield key, fault, f"add {-start:.4g} to the column, or begin with a row of 0"


def _inside(tank: Box, point: tuple[float, ...]) -> bool:
    return all(a - 1e-9 <= x <= b + 1e-9 for a, x, b in zip(tank.min, point, tank.max, strict=True))


def _span(box: Box) -> str:
    return f"{list(box.min)} to {list(box.max)} m"
