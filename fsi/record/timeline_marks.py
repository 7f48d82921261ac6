"""Where the instruments of a scene are, and the loads on fixed structures, on the timeline."""

from __future__ import annotations

import numpy as np

from fsi.extras import require
from fsi.protocols import BodySet, Frame
from fsi.record.fields import spatial
from fsi.scene.geometry import fluid_depth
from fsi.scene.model import Scene

rr = require("rerun", "viewer", "output.timeline = true")

GAUGE, PROBE, METER, PLANE, LOAD = 0xC06000FF, 0xD04080FF, 0x2070C0FF, 0x30A0A0FF, 0xD02020FF
ARROW = 0.5  # length of the arrow of a load, in depths of the fluid, for the push of still water on a side of the tank


def log_instruments(log, scene: Scene, bodies: BodySet | None) -> None:
    """Gauges, probes, velocimeters, flux planes, run-up lines and areas, each with its name; probes that ride on a body in the
    frame of it."""
    low, high = spatial(np.array([scene.tank.min, scene.tank.max]))
    feet = [(g.x, g.y if scene.dimension == 3 else 0.0) for g in scene.gauges.values()]
    if feet:
        lines = rr.LineStrips3D([[(*foot, z) for z in (low[2], high[2])] for foot in feet], colors=[GAUGE])
        log("world/gauges", lines, static=True)
        tops = [(*foot, high[2]) for foot in feet]
        log("world/gauges/names", _points(tops, list(scene.gauges), GAUGE, scene.spacing / 2), static=True)
    still = {n: p for n, p in scene.probes.items() if not (p.body or p.site)}
    if still:
        places = spatial(np.array([probe.position for probe in still.values()]))
        log("world/probes", _points(places, list(still), PROBE, 0.8 * scene.spacing), static=True)
    for name, probe in scene.probes.items():
        if name not in still and bodies is not None:
            body, place = _on_body(scene, probe, bodies)
            path = rr.new_entity_path(["world", "bodies", body, "probes", name])
            log(path, _points([place], [name], PROBE, 0.8 * scene.spacing), static=True)
    for name, meter in scene.velocimeters.items():
        places = spatial(np.array(meter.places))
        path = rr.new_entity_path(["world", "velocimeters", name])
        log(path, _points(places, [name] + [""] * (len(places) - 1), METER, 0.5 * scene.spacing), static=True)
    for name, plane in scene.fluxes.items():
        path = rr.new_entity_path(["world", "fluxes", name])
        log(path, rr.LineStrips3D([_outline(plane)], labels=[name], colors=[PLANE]), static=True)
    for kind, ends in (("runups", ("start", "end")), ("areas", ("min", "max"))):
        for name, part in getattr(scene, kind).items():
            corners = [(*getattr(part, end), scene.fluid.still_water_level) for end in ends]
            path = rr.new_entity_path(["world", kind, name])
            log(path, rr.LineStrips3D([spatial(np.array(corners))], labels=[name], colors=[METER]), static=True)


def log_fixed_loads(stream, scene: Scene, frames: list[Frame], times: list) -> None:
    """The load on each fixed structure as an arrow at its pressure centre."""
    push = 0.5 * scene.fluid.density * (scene.gravity or 1.0) * float(fluid_depth(scene)) ** 2
    across = scene.tank.width if scene.dimension == 2 else scene.tank.max[1] - scene.tank.min[1]
    per_newton = ARROW * float(fluid_depth(scene)) / (push * across)
    for n, name in enumerate(scene.loads):
        path = rr.new_entity_path(["world", "loads", name])
        force, centre = (np.stack([f.series[s][n] for f in frames]) for s in ("load_force", "load_centre"))
        vectors, origins = np.nan_to_num(per_newton * force), np.nan_to_num(centre)
        stream.send_columns(path, times, rr.Arrows3D.columns(vectors=vectors, origins=origins))


def _points(places, names: list[str], colour: int, radius: float):
    return rr.Points3D(places, labels=names, colors=[colour], radii=[radius])


def _outline(plane) -> np.ndarray:
    """Corners of a flux plane, the first one twice, or its two ends in two dimensions."""
    low, high = np.array(plane.min), np.array(plane.max)
    if len(low) == 2:
        return spatial(np.array([low, high]))
    a, b = (d for d in range(3) if d != plane.axis)
    corners = np.tile(low, (5, 1))
    corners[1:3, a], corners[2:4, b] = high[a], high[b]
    return corners.astype(np.float32)


def _on_body(scene: Scene, probe, bodies: BodySet) -> tuple[str, np.ndarray]:
    """The body that a probe rides on, and its place (3,) in the frame of it at the centre of mass."""
    if probe.site is not None:
        body, place = bodies.site(probe.site) or (0, np.zeros(3))
    else:
        body, place = bodies.names.index(probe.body), spatial(np.array([probe.position]))[0].astype(float)
    motion = bodies.motion()
    return bodies.names[body], (place - motion.position[body]) @ motion.rotation[body]
