"""Instruments that lie outside the tank or ask for what the scene does not have."""

from __future__ import annotations

from collections.abc import Iterator

from fsi.parts import Side
from fsi.scene.geometry import moving_sides
from fsi.scene.model import Box, Scene
from fsi.waves.kind import Fault

SIDES = Side.__args__
BATHYMETRY = "bathymetry"


def points_of(scene: Scene) -> dict[str, tuple[float, ...]]:
    """Key -> point of every instrument that is given by points."""
    found = {f"probes.{n}.position": p.position for n, p in scene.probes.items() if p.position is not None}
    for name, meter in scene.velocimeters.items():
        found[f"velocimeters.{name}.position"] = meter.position
        if meter.end is not None:
            found[f"velocimeters.{name}.end"] = meter.end
    found |= {f"fluxes.{name}.min": plane.min for name, plane in scene.fluxes.items()}
    for name, load in scene.loads.items():
        found |= {f"loads.{name}.{key}": p for key in ("min", "about") if (p := getattr(load, key)) is not None}
    return found


def instrument_faults(scene: Scene) -> Iterator[Fault]:
    """What cannot be measured."""
    tank = scene.tank
    for kind in ("gauges", "depths"):
        for name, gauge in getattr(scene, kind).items():
            place = (gauge.x,) if scene.dimension == 2 else (gauge.x, gauge.y)
            for axis, value, a, b in zip("xy", place, tank.min, tank.max, strict=False):
                if not a <= value <= b:
                    fault = f"{value:g} m is outside the tank, {axis} = {a:g} to {b:g} m"
                    yield f"{kind}.{name}.{axis}", fault, "move it inside"
    for key, point in points_of(scene).items():
        if key.startswith(("probes", "velocimeters")) and not _inside(tank, point):
            yield key, f"{list(point)} is outside the tank {_span(tank)}", "move it inside"
    yield from _planes(scene)
    yield from _ground(scene)
    yield from _loads(scene)
    for name, probe in scene.probes.items():
        if (probe.body or probe.site) and not scene.bodies:
            key = "body" if probe.body else "site"
            yield f"probes.{name}.{key}", "the scene has no bodies", f"add a body file, or leave {key} out"


def _planes(scene: Scene) -> Iterator[Fault]:
    tank = scene.tank
    for name, plane in scene.fluxes.items():
        beside = any(
            a > high or b < low for a, b, low, high in zip(plane.min, plane.max, tank.min, tank.max, strict=True)
        )
        if beside:
            yield f"fluxes.{name}", f"lies outside the tank {_span(tank)}", "move it inside"
        if tank.axes[plane.axis] in tank.periodic and plane.min[plane.axis] in (
            tank.min[plane.axis],
            tank.max[plane.axis],
        ):
            yield f"fluxes.{name}", "lies where the tank begins anew", "move it inside, where every particle passes it"


def _ground(scene: Scene) -> Iterator[Fault]:
    tank, axes = scene.tank, scene.dimension - 1
    for kind, keys in (("runups", ("start", "end")), ("areas", ("min", "max"))):
        for name, part in getattr(scene, kind).items():
            for key in keys:
                place = getattr(part, key)
                if len(place) != axes:
                    fix = f"give {', '.join('xy'[:axes])}"
                    yield f"{kind}.{name}.{key}", f"{list(place)} has {len(place)} components, not {axes}", fix
                elif any(not a <= x <= b for a, x, b in zip(tank.min, place, tank.max, strict=False)):
                    yield f"{kind}.{name}.{key}", f"{list(place)} is outside the tank {_span(tank)}", "move it inside"
    for name, line in scene.runups.items():
        if line.start == line.end:
            yield f"runups.{name}", "start and end are the same place", "move one of them"


def _loads(scene: Scene) -> Iterator[Fault]:
    tank = scene.tank
    for name, load in scene.loads.items():
        key = f"loads.{name}.on"
        if load.on in SIDES:
            if load.on not in tank.walls or load.on[0] not in tank.axes or load.on[0] in tank.periodic:
                yield key, f"the tank has no wall {load.on!r}", f"its walls are {', '.join(tank.walls)}"
            elif scene.sea and load.on in moving_sides(scene):
                yield key, f"the wall {load.on} moves with the waves of the sea", "take another side"
            elif load.on == "x-" and scene.waves:
                fix = "take another side; `wavemaker_work` says what the piston does"
                yield key, "the wall x- is the piston, which moves", fix
        elif load.on == BATHYMETRY:
            if tank.bathymetry is None:
                yield key, "the scene has no bathymetry", "set tank.bathymetry, or name a side or a static wet geom"
        elif load.on is not None and not scene.bodies:
            yield key, f"no side of the tank is called {load.on!r}, and there are no bodies", f"use {', '.join(SIDES)}"


def _inside(tank: Box, point: tuple[float, ...]) -> bool:
    return all(a - 1e-9 <= x <= b + 1e-9 for a, x, b in zip(tank.min, point, tank.max, strict=True))


def _span(box: Box) -> str:
    return f"{list(box.min)} to {list(box.max)} m"
