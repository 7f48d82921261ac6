"""From a scene to what it asks other packages for: bodies, coupler and ground."""

from __future__ import annotations

from typing import Any

from fsi import plugins
from fsi.extras import require
from fsi.scene.geometry import retreats
from fsi.scene.model import GRIDS, Scene


def bind(scene: Scene, label: str, *, bodies: bool = True, ground: bool = True) -> tuple[Any, Any, Any]:
    """The bodies, the coupler and the ground of a scene, which messages call `label`; each None where it has none, or where
    it is not asked for. Raises SceneError where one of them cannot be made."""
    moved = coupler = solid = None
    if scene.bodies and bodies:
        require("mujoco", "bodies", "a scene with bodies")
        moved = plugins.engine().load(scene, label)
        coupler = scene.coupler.make(moved, label)
    if scene.tank.bathymetry and ground:
        margin = (scene.layers + 1) * scene.spacing  # ground beyond the walls of the tank is not felt
        low, high = (
            [x + side * margin for x in corner] for corner, side in ((scene.tank.min, -1), (scene.tank.max, 1))
        )
        back, forth = retreats(scene)  # water follows moving walls there
        low, high = low - back, high + forth
        engine = plugins.engine()
        if scene.tank.bathymetry.suffix.lower() in GRIDS:
            solid = engine.grid_solid(scene, (low, high))
        else:
            solid = engine.mesh_solid(scene.tank.bathymetry, scene.dimension, crop=(low, high))
    return moved, coupler, solid
