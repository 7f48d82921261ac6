"""Checks of a scene's values against each other, before anything is allocated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.errors import SceneError
from fsi.scene.check_effect import idle_values
from fsi.scene.check_implicit import implicit_faults
from fsi.scene.check_instruments import instrument_faults, points_of
from fsi.scene.check_liquids import liquid_faults, liquid_warnings
from fsi.scene.check_sea import sea_faults, sea_warnings
from fsi.scene.check_size import size_faults
from fsi.scene.check_waves import wave_faults, wave_warnings
from fsi.scene.fields import field_of
from fsi.scene.geometry import all_blocks, fluid_height, fluid_volume, restless
from fsi.scene.model import Scene
from fsi.waves.kind import Fault


def check_scene(scene: Scene, file: object = "") -> None:
    """Raise SceneError with one line for each contradiction in the scene."""
    checks = (
        _output,
        _start,
        implicit_faults,
        _positions,
        liquid_faults,
        _periodic,
        _open,
        _field,
        _resolution,
        wave_faults,
        sea_faults,
        _coupler,
        _control,
        _rest,
        _moorings,
        _files,
    )
    # The other checks combine points, so they wait for the dimensions.
    faults = list(_dimensions(scene)) or list(_sizes(scene)) or [fault for check in checks for fault in check(scene)]
    if faults:
        raise SceneError("\n".join(str(SceneError(fault, key=key, file=file, fix=fix)) for key, fault, fix in faults))


def scene_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    return wave_warnings(scene) + sea_warnings(scene) + liquid_warnings(scene) + idle_values(scene)


def _dimensions(scene: Scene) -> Iterator[Fault]:
    points = {"tank.min": scene.tank.min}
    for key, block in all_blocks(scene).items():
        if block.polygon and len(block.min) < scene.dimension == 3:
            yield key, "a polygon in three dimensions needs its extent along y", "give min and max, with x, y, z"
            continue
        points[f"{key}.min"] = block.min
        points[f"{key}.velocity"] = block.velocity or block.min
    if scene.fluid.acceleration:
        points["fluid.acceleration"] = scene.fluid.acceleration
    points |= points_of(scene)
    for n, row in enumerate(scene.fluid.acceleration_gradient or ()):
        points[f"fluid.acceleration_gradient[{n}]"] = row
    axes = "x, z" if scene.dimension == 2 else "x, y, z"
    for key, point in points.items():
        if len(point) != scene.dimension:
            yield key, f"{list(point)} has {len(point)} components in {scene.dimension} dimensions", f"give {axes}"


def _sizes(scene: Scene) -> Iterator[Fault]:
    volume = max(0.0, fluid_volume(scene))
    if scene.tank.bathymetry:  # what it leaves is counted once it is read (`fsi.particles.layout`): here a row over the tank
        volume = min(volume, scene.spacing * math.prod(np.subtract(scene.tank.max, scene.tank.min)[:-1]))
    return size_faults(scene, volume, fluid_height(scene))


def _start(scene: Scene) -> Iterator[Fault]:
    """Water that is to come to rest before t = 0 and never would."""
    if scene.fluid.start == "settled" and (key := restless(scene)):
        fault = f'"settled" lets the fluid come to rest before t = 0, which {key} does not'
        yield "fluid.start", fault, 'use "auto", or leave it out'


def _output(scene: Scene) -> Iterator[Fault]:
    """Fields that this scene's particles do not have."""
    if not scene.output.fields:
        yield "output.fields", "names no field to colour the particles with", "give one, or leave it out"
    for name in scene.output.fields:
        if not field_of(name).present(scene):
            yield "output.fields", f"particles of this scene have no field {name!r}", "remove it"


def _positions(scene: Scene) -> Iterator[Fault]:
    tank, level = scene.tank, scene.fluid.still_water_level
    low, high = tank.min[-1], tank.max[-1]
    if not scene.fluid.blocks and not low < level <= high:
        yield "fluid.still_water_level", f"{level:g} m is not in the tank, z = {low:g} to {high:g} m", "move it inside"
    if scene.closed and not (tank.bathymetry or "z+" in tank.walls or "z" in tank.periodic):
        fault = (
            f"{level:g} m is the tank's top, where there is no wall: water under no lid has a free surface, and no room"
        )
        fix = "raise tank.max for a free surface, or add 'z+' to tank.walls for a closed tank"
        yield "fluid.still_water_level", fault, fix
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
    yield from instrument_faults(scene)


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
    if tank.periodic and scene.bodies and not (scene.sea and scene.sea.current is not None):
        yield key, "bodies do not repeat along a periodic axis", "use walls far away instead"


def _open(scene: Scene) -> Iterator[Fault]:
    tank, key = scene.tank, "tank.open"
    for side in tank.open:
        if side[0] not in tank.axes:
            yield key, f"{side}: a two-dimensional scene has no y axis", "leave it out"
        elif side in tank.walls:
            yield key, f"{side} has a wall", "leave it out of tank.walls"
        elif side[0] in tank.periodic:
            yield key, f"{side}: the tank repeats itself along that axis", "leave it out"


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
    depth = fluid_height(scene)
    if 0 < depth < 4 * scene.spacing * (1 - 1e-9):
        fault = f"{scene.spacing:g} m gives {depth / scene.spacing:.1f} particles over the fluid's depth {depth:g} m"
        yield "spacing", fault, f"use {depth / 4:.2g} m or less, for at least 4"


def _coupler(scene: Scene) -> Iterator[Fault]:
    return scene.coupler.faults(scene)


def _moorings(scene: Scene) -> Iterator[Fault]:
    for name, body in scene.bodies.items():
        if body.moorings and scene.coupler.scheme == "prescribed":
            yield f"bodies.{name}.moorings", "have no effect on prescribed motion", "remove them"
        for line, mooring in body.moorings.items():
            if mooring.body is not None and isinstance(mooring.fairlead, str):
                yield f"bodies.{name}.moorings.{line}.body", "has no effect: the site says whose it is", "remove it"


def _rest(scene: Scene) -> Iterator[Fault]:
    for name, body in scene.bodies.items():
        if body.start == "drawn":
            continue
        if scene.fluid.blocks or scene.liquids or not scene.gravity:
            fault = "the tank is not filled with one liquid to its still water level, in which bodies could rest"
            yield f"bodies.{name}.start", fault, 'use start = "drawn"'
        elif scene.coupler.scheme == "prescribed":
            yield f"bodies.{name}.start", "the motion says where the bodies start", 'use start = "drawn"'


def _control(scene: Scene) -> Iterator[Fault]:
    if scene.control and not scene.bodies:
        yield "control", "there are no bodies with actuators", "add [bodies.NAME] with mjcf, or remove it"
    elif scene.control and scene.coupler.scheme == "prescribed":
        yield (
            "control",
            "has no effect on prescribed motion: actuators move nothing",
            "remove it, or use another scheme",
        )


def _files(scene: Scene) -> Iterator[Fault]:
    files = {f"bodies.{name}.mjcf": body.mjcf for name, body in scene.bodies.items()}
    if scene.tank.bathymetry:
        files["tank.bathymetry"] = scene.tank.bathymetry
    files |= {f"{key}.mesh": block.mesh for key, block in all_blocks(scene).items() if block.mesh}
    for key, path in files.items():
        if not path.is_file():
            yield key, f"no such file: {path}", "check the path; it is relative to the scene file"
