"""What `fsi check` says of bodies in still water: how they float, and where water is too narrow to be resolved."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsi.owners import FIRST_BODY, WALL
from fsi.protocols import BodySet, Solid
from fsi.scene.model import Scene

SPACINGS = 4  # across a gap, that a flow through it needs
CORNER = 3  # spacings from the middle of a ball to the corner that it touches
HEEL = 2.0  # degrees from the pose as drawn that are told
MOST = 1_000_000  # cells that are looked at


def floating_lines(hydrostatics: dict) -> Iterator[str]:
    """Two lines a body: as drawn, and at rest."""
    for name, poses in hydrostatics.items():
        drawn, rest = poses["drawn"], poses.get("rest")
        masses = f"mass {drawn['mass']:.4g} kg, displaces {drawn['displaced_mass']:.4g} kg"
        yield f"body {name!r} as drawn: {masses}, {_figures(drawn)}"
        if rest and not (rest["rise"] == 0.0 and rest["heel"] == drawn["heel"]):
            side = "higher" if rest["rise"] > 0 else "lower"
            yield f"body {name!r} at rest: {abs(rest['rise']):.3g} m {side}, {_figures(rest)}"


def _figures(pose: dict) -> str:
    parts = [
        f"draft {pose['draft']:.3g} m",
        f"centre of mass at z = {pose['centre_of_mass']:.3g} m",
        f"of buoyancy at {pose['centre_of_buoyancy']:.3g} m",
        f"heel {pose['heel']:.2g} degrees",
    ]
    if "metacentric_height" in pose:
        parts.append(f"metacentric height {pose['metacentric_height']:.3g} m")
    if "metacentric_height_roll" in pose:
        parts.append(f"{pose['metacentric_height_roll']:.3g} m in roll")
    return ", ".join(parts)


def afloat(scene: Scene, hydrostatics: dict) -> list[str]:
    """Bodies that do not float as drawn, one line each."""
    lines = []
    for name, poses in hydrostatics.items():
        if scene.coupler.scheme == "prescribed":
            continue
        if "rest" not in poses:
            fix = "compare its mass with what it displaces"
            lines.append(f"body {name!r} finds no rest in still water: it sinks, or turns for ever; {fix}")
            continue
        rise, heel = poses["rest"]["rise"], poses["rest"]["heel"] - poses["drawn"]["heel"]
        if abs(rise) > 0.5 * scene.spacing or abs(heel) > HEEL:
            way = f"{abs(rise):.3g} m {'higher' if rise > 0 else 'lower'}, {abs(poses['rest']['heel']):.2g} degrees heeled"
            key = name.partition("/")[0] if len(scene.bodies) > 1 else next(iter(scene.bodies))
            lines.append(
                f"body {name!r} does not float as drawn: it rests {way}; "
                f'bodies.{key}.start = "equilibrium" starts it there'
            )
    return lines


def narrow(scene: Scene, bodies: BodySet | None, ground: Solid | None) -> list[str]:
    """Water beside a body or a fixed geom in which no ball of `SPACINGS` fits: gaps to walls and to other bodies, columns
    within it. A corner is not narrow: told is what goes deeper than that into the water, from where such a ball does fit."""
    if not bodies or scene.fluid.blocks:
        return []
    solids = [(owner, solid) for owner, solid in bodies.solids() if hasattr(solid, "bounds")]
    every = [solid for _, solid in bodies.solids()] + ([ground] if ground else [])
    lines = []
    one = [(f"geom {solid.name!r}", [solid]) for owner, solid in solids if owner == WALL and getattr(solid, "name", "")]
    for b, name in enumerate(bodies.names):
        one.append((f"body {name!r}", [solid for owner, solid in solids if owner == FIRST_BODY + b]))
    for name, own in one:
        points = _around(scene, own)
        if points is None:
            lines.append(f"{name}: narrow water was not looked for, its surroundings have over {MOST} cells")
        elif (found := _narrowest(scene, *points, every)) is not None:
            place = ", ".join(f"{axis} = {value:.3g}" for axis, value in zip(scene.tank.axes, found[0], strict=True))
            lines.append(
                f"{name}: the water at {place} m is narrower than {SPACINGS} spacings "
                f"({SPACINGS * scene.spacing:.3g} m): what flows there is not resolved; "
                f"a spacing of {found[1] / SPACINGS:.2g} m resolves it"
            )
    return lines


def slowed(scene: Scene, bodies: BodySet | None) -> list[str]:
    """Moving bodies, and fixed geoms whose load is asked for, that stand in a damping zone at the start."""
    lines, asked = [], {load.on for load in scene.loads.values()}
    for n, zone in enumerate(scene.damping if bodies else ()):
        axis, found = scene.tank.axes.index(zone.axis), []
        for owner, solid in bodies.solids():
            name = getattr(solid, "name", "")
            if hasattr(solid, "bounds") and (owner >= FIRST_BODY or name in asked):
                low, high = (float(end[axis]) for end in solid.bounds())
                if low < zone.end and high > zone.start:
                    found.append(f"geom {name!r}")
        if found:
            where = f"{zone.axis} = {zone.start:g} to {zone.end:g} m"
            lines.append(
                f"damping[{n}]: {', '.join(found)} in it, {where}: the water is slowed there, and its loads with it"
            )
    return lines


def _around(scene: Scene, own: list[Solid]) -> tuple[np.ndarray, np.ndarray] | None:
    """Points (n, dim) half a spacing apart in the tank around a body, and how many there are along each axis (dim,); None
    where they are too many."""
    dr, tank = scene.spacing, scene.tank
    step = dr / 2
    low = np.min([solid.bounds()[0] for solid in own], axis=0) - SPACINGS * dr
    high = np.max([solid.bounds()[1] for solid in own], axis=0) + SPACINGS * dr
    low, high = np.maximum(low, tank.min), np.minimum(high, tank.max)
    counts = np.maximum(np.ceil((high - low) / step - 1e-9).astype(int), 1)
    if counts.prod() > MOST:
        return None
    return low + (np.indices(counts).reshape(len(counts), -1).T + 0.5) * (high - low) / counts, counts


def _narrowest(
    scene: Scene, points: np.ndarray, counts: np.ndarray, every: list[Solid]
) -> tuple[np.ndarray, float] | None:
    """A place (dim,) in narrow water among these points, and its width there [m]; None where there is none."""
    dr, tank = scene.spacing, scene.tank
    room = np.full(len(points), np.inf)
    for solid in every:
        room = np.minimum(room, solid.clearance(points))
    for k, axis in enumerate(tank.axes):
        for side, wall in (("-", tank.min[k]), ("+", tank.max[k])):
            if f"{axis}{side}" in tank.walls:
                room = np.minimum(room, np.abs(points[:, k] - wall))
    water = (room > 0.0) & (points[:, -1] < scene.fluid.still_water_level)
    fits = (room >= 0.5 * SPACINGS * dr - 0.51 * dr / 2).reshape(counts)
    covered = _within(fits, 2 * CORNER)  # from the middle of a ball to a corner
    left = water & ~covered.ravel()
    if not left.any():
        return None
    place = np.flatnonzero(left)[np.argmax(room[left])]
    return points[place], max(2 * float(room[place]), 0.5 * dr)


def _within(cells: np.ndarray, steps: int) -> np.ndarray:
    """The cells up to so many steps away, along the axes and across."""
    for _ in range(steps):
        grown = cells.copy()
        for axis in range(cells.ndim):
            wide = grown.copy()
            ahead = [slice(None)] * cells.ndim
            behind = [slice(None)] * cells.ndim
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            wide[tuple(ahead)] |= grown[tuple(behind)]
            wide[tuple(behind)] |= grown[tuple(ahead)]
            grown = wide
        cells = grown
    return cells
