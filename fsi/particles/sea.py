"""A sea at the start: water that is already under waves, and bodies that keep out of its zones."""

from __future__ import annotations

import numpy as np

from fsi.errors import SceneError
from fsi.particles.filling import cells_left, clearance, particle_volume
from fsi.particles.tank import axis, lattice
from fsi.protocols import BodySet, Solid
from fsi.scene.geometry import cell, incident_waves, sea_sides, sea_zone
from fsi.scene.model import Scene


def under_waves(scene: Scene, solids: list[Solid]) -> tuple:
    """Position, velocity (n, dim), pressure (n,) and clearance (n,) from the solids of the fluid, the lattice of still water
    carried to where the waves have it at t = 0, without what is inside the solids; and the volume of a particle."""
    tank, dr, level, waves = scene.tank, scene.spacing, scene.fluid.still_water_level, incident_waves(scene)
    top = (*tank.max[:-1], level)
    home = lattice([axis(a, b, a, side) for a, b, side in zip(tank.min, top, cell(scene), strict=True)])
    home[:, -1] -= level
    position = waves.carried(0.0, home)
    velocity, pressure = waves.velocity(0.0, position), waves.pressure_of(0.0, home, scene.fluid.density)
    position[:, -1] += level
    clear = clearance(solids, position)
    free = clear > 1e-6 * dr
    volume = particle_volume(scene, cells_left(scene, clear), int(free.sum()))
    return position[free], velocity[free], np.maximum(pressure, 0.0)[free], clear[free], volume


def check_zones(scene: Scene, bodies: BodySet) -> None:
    """Raise SceneError for a body in a zone of the sea, where the water is drawn to waves that know nothing of it."""
    tank, width = scene.tank, max(sea_zone(scene)[0], 2 * scene.smoothing_length)
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
