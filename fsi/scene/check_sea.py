"""What a scene's sea cannot be, what it should not be, and what it is."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fsi.errors import SceneError
from fsi.scene.check_waves import slow_waves
from fsi.scene.geometry import (
    ZONE_POWER,
    drifting_waves,
    endless,
    incident_waves,
    longest_period,
    sea_current,
    sea_sides,
    sea_zone,
    wave_depth,
)
from fsi.scene.model import Scene
from fsi.waves.kind import Fault, Water
from fsi.waves.sponge import reflection

MOST = 100  # waves of a sum that may have bound ones
REFLECTING = 0.1  # part of a wave that zones had better not send back
FLUME = (
    3.0  # wave lengths of a flume with a piston beside the length around the bodies: before, behind, and to damp them
)


def sea_faults(scene: Scene) -> Iterator[Fault]:
    """What cannot work."""
    for check in (_alone, _box, _current, _kind, _sum, _repeats, _zones) if scene.sea else ():
        faults = list(check(scene))
        yield from faults
        if faults:  # the next check builds on this one
            return


def _alone(scene: Scene) -> Iterator[Fault]:
    if scene.waves:
        yield "sea", "the scene has [waves] too, and a tank has one kind of wavemaker", "remove one of them"
    if scene.damping:
        yield (
            "damping",
            "the zones of the sea take waves away already",
            "remove [[damping]], or set sea.zone and sea.rate",
        )
    if scene.liquids:
        yield "liquids", "the waves of a sea are those of one liquid", "remove them, or use a flume with [waves]"
    if scene.fluid.blocks:
        yield "fluid.blocks", "a sea fills the tank up to fluid.still_water_level", "leave the blocks out"
    if scene.gravity == 0:
        yield "gravity", "waves need gravity", "use e.g. 9.81"
    if scene.sea.waves.absorb:
        yield "sea.waves.absorb", "there is no piston that could absorb", "leave it out: the zones do"
    moving = scene.sea.start == "waves" or scene.sea.current is not None
    if moving and scene.fluid.start not in ("auto", "hydrostatic"):
        fix = "leave it out" if scene.sea.current is not None else "leave it out, or set sea.start = 'rest'"
        yield "fluid.start", f"{scene.fluid.start!r} is of water at rest", fix


def _box(scene: Scene) -> Iterator[Fault]:
    tank = scene.tank
    if scene.closed or "z+" in tank.walls:
        yield "tank.walls", "a sea needs a free surface", "raise the tank over the water, and leave 'z+' out"
    if "z-" not in tank.walls:
        yield "tank.walls", "a sea needs a floor", "add 'z-'"
    for side in sea_sides(scene):
        if side not in tank.walls and side[0] not in tank.periodic:
            yield "tank.walls", f"a sea needs the wall {side}, which moves with its waves", f"add {side!r}"
    turn = abs(math.sin(math.radians(scene.sea.heading)))
    if turn > 1e-6 and scene.dimension == 2:
        yield "sea.heading", f"{scene.sea.heading:g} degrees in two dimensions", "use 0 or 180"
    elif turn > 1e-6 and tank.periodic:
        yield "sea.heading", "waves across a periodic axis do not repeat themselves", "use 0 or 180"


def _current(scene: Scene) -> Iterator[Fault]:
    """A current that the tank can carry: it comes back where it left."""
    given, tank = scene.sea.current, scene.tank
    if given is None:
        return
    sides = scene.dimension - 1
    if (len(given) if isinstance(given, tuple) else 1) != sides:
        yield "sea.current", f"{given} in {scene.dimension} dimensions", "give u" if sides == 1 else "give [u, v]"
        return
    for axis, speed in zip(tank.axes[:-1], sea_current(scene)[:sides], strict=True):
        if speed and axis not in tank.periodic:
            fault = f"{speed:g} m/s along {axis} would go through the walls {axis}- and {axis}+"
            along = " and make the tank a whole number of wave lengths long" if axis == "x" else ""
            yield "sea.current", fault, f'set tank.periodic = ["{axis}"]{along}: what flows out comes in again'


def _kind(scene: Scene) -> Iterator[Fault]:
    try:
        yield from ((f"sea.{key}", fault, fix) for key, fault, fix in drifting_waves(scene).faults(_water(scene)))
        incident_waves(scene)
    except SceneError as error:
        key = error.key or "sea.waves"
        yield key if key.startswith("sea.") else f"sea.{key}", error.fault, error.fix


def _sum(scene: Scene) -> Iterator[Fault]:
    """Directions and bound waves of a sum of waves."""
    sea = scene.sea
    if sea.spreading is None and sea.order == 1:
        return
    key = "sea.spreading" if sea.spreading is not None else "sea.order"
    plain = sea.waves.incident(wave_depth(scene), scene.gravity)
    if plain.steady or len(plain.k) < 2:
        yield (
            key,
            f"{sea.waves.kind} waves are one wave",
            "leave it out, or use irregular, spectrum, measured or focused",
        )
    elif sea.order == 2 and len(plain.k) > MOST:
        fault = f"{len(plain.k)} waves have {len(plain.k) ** 2} bound ones"
        yield "sea.order", fault, f"set sea.waves.components to {MOST} or less"
    if sea.spreading is not None and scene.dimension == 2:
        yield "sea.spreading", "waves in two dimensions have one direction", "leave it out"
    elif sea.spreading is not None and scene.tank.periodic:
        yield "sea.spreading", "waves across a periodic axis do not repeat themselves", "leave it or tank.periodic out"
    elif sea.spreading is not None and getattr(sea.waves, "place", 0.0):
        yield (
            "sea.waves.place",
            "waves of many directions meet at x = y = 0",
            "leave it out, and move the tank and the bodies",
        )


def _repeats(scene: Scene) -> Iterator[Fault]:
    """Waves along a periodic axis, which meet themselves at its ends."""
    if not endless(scene):
        return
    waves, dr = incident_waves(scene), scene.spacing
    if len(waves.k) > 1 and not waves.steady:
        fix = "use regular or nonlinear waves, or a current across them along a periodic y axis"
        yield "sea.waves.kind", f"{scene.sea.waves.kind} waves do not repeat themselves along x", fix
        return
    length, size = 2 * math.pi / float(waves.k[0]), scene.tank.max[0] - scene.tank.min[0]
    count = max(1, round(size / length))
    if abs(size - count * length) > 0.5 * dr * (1 + 1e-6):
        fault = f"waves of {length:.4g} m do not repeat themselves in the {size:g} m along x"
        best = round(count * length / dr) * dr
        yield "tank.periodic", fault, f"make it {count} of them long, {best:.6g} m to the nearest spacing"


def _zones(scene: Scene) -> Iterator[Fault]:
    tank, (width, _) = scene.tank, sea_zone(scene)
    for axis in {side[0] for side in sea_sides(scene)}:
        d = tank.axes.index(axis)
        size = tank.max[d] - tank.min[d]
        if 2 * width > size - 4 * scene.smoothing_length:
            fault = f"zones of {width:.3g} m at both ends leave nothing of the {size:g} m along {axis}"
            yield "sea.zone", fault, f"use a longer box, or zones below {0.5 * size - 2 * scene.smoothing_length:.2g} m"
    crest = scene.fluid.still_water_level + incident_waves(scene).crest
    if crest + scene.spacing > tank.max[-1]:
        yield "tank.max", f"crests come to z = {crest:.3g} m, the tank ends at {tank.max[-1]:g} m", "raise it"


def sea_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    if scene.sea is None:
        return []
    return [
        *(
            f"sea.{line}" if line.startswith("waves") else line
            for line in drifting_waves(scene).warnings(_water(scene))
        ),
        *slow_waves(scene, drifting_waves(scene)),
        *_own(scene),
    ]


def _own(scene: Scene) -> Iterator[str]:
    tank, water, (width, rate) = scene.tank, _water(scene), sea_zone(scene)
    length = water.length(longest_period(scene))
    size = tank.max[0] - tank.min[0]
    if size < length:
        yield (
            f"tank: {size:.3g} m is {size / length:.2f} of a wave length; what bodies send out has no room to leave in: "
            f"make the box one and a half to two, {1.5 * length:.3g} to {2 * length:.3g} m"
        )
    part = reflection(width / length, rate / (2 * math.pi / longest_period(scene)), ZONE_POWER)
    if part > REFLECTING:
        yield (
            f"sea.zone: {width / length:.2f} wave lengths wide, sends back about {100 * part:.0f} % of what comes from the "
            f"bodies, by long-wave theory; make it half a wave length or more, {0.5 * length:.3g} m"
        )
    if scene.numerics.artificial_viscosity > 0 and scene.numerics.velocity_reconstruction == "none":
        yield (
            "numerics.velocity_reconstruction: 'none' lets the artificial viscosity take height from the waves between the "
            "zones; 'linear' keeps it (docs/guide/waves.md)"
        )


def sea_summary(scene: Scene) -> list[str]:
    """The sea in figures, one line each."""
    if scene.sea is None:
        return []
    water, (width, rate), waves = _water(scene), sea_zone(scene), incident_waves(scene)
    period = longest_period(scene)
    length, omega, size = water.length(period), 2 * math.pi / period, scene.tank.max[0] - scene.tank.min[0]
    part = reflection(width / length, rate / omega, ZONE_POWER)
    start = "under waves from the first step" if scene.sea.start == "waves" else f"from rest, ramp {waves.ramp:.3g} s"
    return [
        *(f"sea: {line}" for line in drifting_waves(scene).figures(water)),
        *_stream(scene),
        f"sea: {scene.sea.waves.kind}, heading {scene.sea.heading:g} degrees, {start}; walls move by {waves.excursion:.3g} m",
        f"sea: box of {size / length:.2f} wave lengths; zones of {width:.3g} m, {width / length:.2f} wave lengths, at "
        f"{rate / omega:.1f} omega send back about {100 * part:.2g} %, by long-wave theory",
        f"sea: a flume with a piston for the {size - 2 * width:.3g} m between the zones would be about "
        f"{(FLUME * length + size - 2 * width) / size:.1f} times as long, and wait for its waves",
    ]


def _stream(scene: Scene) -> Iterator[str]:
    """What the current does to the waves; all other lines are as the water sees them that drifts with it."""
    if scene.sea.current is None:
        return
    waves, (u, v) = incident_waves(scene), sea_current(scene)
    seen = float(waves.seen[0])
    yield (
        f"sea: current ({u:g}, {v:g}) m/s, seen from which the waves above are; at a fixed place their period is "
        f"{2 * math.pi / seen:.4g} s, and they travel at {seen / waves.k[0]:.3g} m/s"
    )


def _water(scene: Scene) -> Water:
    return Water(wave_depth(scene), scene.gravity, scene.spacing)
