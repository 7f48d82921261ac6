"""A sea at the start: water that is already under waves, and bodies that keep out of its zones."""

from __future__ import annotations

import numpy as np

from fsi.errors import SceneError
from fsi.particles.tank import axis, lattice
from fsi.protocols import BodySet, Solid
from fsi.scene.geometry import cell, incident_waves, sea_sides, sea_zone
from fsi.scene.model import Scene


def under_waves(scene: Scene, solids: list[Solid]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity (n, dim) and pressure (n,) of the fluid: the lattice of still water, carried to where the waves have
    it at t = 0, without what is inside the solids."""
    tank, dr, level, waves = scene.tank, scene.spacing, scene.fluid.still_water_level, incident_waves(scene)
    top = (*tank.max[:-1], level)
    home = lattice([axis(a, b, a, side) for a, b, side in zip(tank.min, top, cell(scene), strict=True)])
    home[:, -1] -= level
    position = waves.carried(0.0, home)
    velocity, pressure = waves.velocity(0.0, position), waves.pressure_of(0.0, home, scene.fluid.density)
    position[:, -1] += level
    for solid in solids:
        free = solid.clearance(position) > 1e-6 * dr
        position, velocity, pressure = position[free], velocity[free], pressure[free]
    return position, velocity, np.maximum(pressure, 0.0)


def check_zones(scene: Scene, bodies: BodySet) -> None:
    """Raise SceneError for a body in a zone of the sea, where the water is drawn to waves that know nothing of it."""
    tank, (width, _) = scene.tank, sea_zone(scene)
    for _, solid in bodies.solids():
        points = solid.boundary(scene.spacing, scene.layers)
        points = points[points[:, -1] < scene.fluid.still_water_level]
        for side in sea_sides(scene) if len(points) else ():
            d = tank.axes.index(side[0])
            gap = points[:, d].min() - tank.min[d] if side[1] == "-" else tank.max[d] - points[:, d].max()
            if gap < width:
                name = getattr(solid, "name", "") or "a wet geom"
                fault = (
                    f"{name} comes to {max(gap, 0.0):.3g} m from the side {side}, into the zone of {width:.3g} m there"
                )
                raise SceneError(fault, key="sea.zone", fix="use a longer box or narrower zones")
