"""Instruments and solids: a probe or a gauge inside one would read nothing for ever."""

from __future__ import annotations

import numpy as np

from fsi.errors import SceneError
from fsi.protocols import Solid
from fsi.scene.model import Scene

PLACES = 20  # along each side of a flux plane, at which it is asked whether it lies in a solid
ON_FACE = 0.1  # spacings that a probe on the face of a solid may lie under it


def check_instruments(scene: Scene, solids: list[tuple[int, Solid]]) -> None:
    """Raise SceneError, one line each, for probes inside a solid at t = 0 and for gauges whose vertical lies inside fixed
    solids all the way; `solids` with their owners, 0 where they are fixed."""
    if not solids or not (scene.probes or scene.gauges or scene.velocimeters or scene.fluxes):
        return
    faults = [*_buried_probes(scene, [solid for _, solid in solids])]
    faults += _buried_planes(scene, [solid for owner, solid in solids if owner == 0])
    faults += _buried_gauges(scene, [solid for owner, solid in solids if owner == 0])
    if faults:
        raise SceneError("\n".join(map(str, faults)))


def _buried_probes(scene: Scene, solids: list[Solid]):
    for name, probe in scene.probes.items():
        if probe.position is None:  # at a site of a body, whose place is not known here
            continue
        depth = -_clearance(solids, np.array([probe.position], float))[0]
        if depth > ON_FACE * scene.spacing:
            fault = f"{list(probe.position)} is {depth:.3g} m inside a solid, where no fluid can come"
            yield SceneError(fault, key=f"probes.{name}.position", fix="move it to the face or into the fluid")

    for name, meter in scene.velocimeters.items():
        depth = -_clearance(solids, np.array(meter.places, float)).min()
        if depth > scene.spacing:
            fault = f"reaches {depth:.3g} m into a solid, where no fluid can come"
            yield SceneError(
                fault, key=f"velocimeters.{name}", fix="move it into the fluid, or make the profile shorter"
            )


def _buried_planes(scene: Scene, fixed: list[Solid]):
    for name, plane in scene.fluxes.items() if fixed else ():
        sides = [np.linspace(a, b, 1 if a == b else PLACES) for a, b in zip(plane.min, plane.max, strict=True)]
        points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))
        if (_clearance(fixed, points) < 0).all():
            fault, fix = "lies inside a solid, where nothing can pass", "move it over the crest, or into the fluid"
            yield SceneError(fault, key=f"fluxes.{name}", fix=fix)


def _buried_gauges(scene: Scene, fixed: list[Solid]):
    heights = np.arange(scene.tank.min[-1], scene.tank.max[-1], 0.5 * scene.spacing)
    for name, gauge in scene.gauges.items() if fixed else ():
        foot = (gauge.x,) if scene.dimension == 2 else (gauge.x, gauge.y)
        vertical = np.column_stack([np.tile(foot, (len(heights), 1)), heights])
        if (_clearance(fixed, vertical) < 0).all():
            fault = "stands inside a solid from the tank's floor to its top, where no fluid can come"
            yield SceneError(fault, key=f"gauges.{name}", fix="move it into the fluid")


def _clearance(solids: list[Solid], points: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, dim) to the nearest of the solids, negative inside one."""
    return np.min([solid.clearance(points) for solid in solids], axis=0)
