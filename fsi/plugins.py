"""Finds what `fsi` does not import: the engine that moves bodies, and the couplers (entry points of installed packages)."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import entry_points

from fsi.extras import require
from fsi.scene.model import Scene

ENGINES, COUPLERS = "spindrift.engines", "spindrift.couplers"


def engine(name: str = "mujoco"):
    """The module that loads bodies and grounds: `load(scene, source)` and `mesh_solid(file, dimension, crop)`."""
    found = next(iter(entry_points(group=ENGINES, name=name)), None)
    return found.load() if found else import_module("bodies")


def coupler(name: str):
    """What makes the coupler of a scheme: `make(settings, bodies, source)`."""
    found = next(iter(entry_points(group=COUPLERS, name=name)), None)
    return found.load() if found else import_module("couplers").make


def bind(scene: Scene, label: str, *, bodies: bool = True, ground: bool = True) -> tuple:
    """The bodies, the coupler and the ground of a scene, which messages call `label`; each None where it has none,
    or where it is not asked for. Raises SceneError where one of them cannot be made."""
    moved = made = solid = None
    if scene.bodies and bodies:
        require("mujoco", "bodies", "a scene with bodies")
        moved = engine().load(scene, label)
        made = coupler(scene.coupler.scheme)(scene.coupler, moved, label)
    if scene.tank.bathymetry and ground:
        require("trimesh", "bodies", "a bathymetry")
        solid = ground_of(scene)
    return moved, made, solid


def ground_of(scene: Scene):
    """The solid of the scene's bathymetry. Raises SceneError where its file cannot be read."""
    margin = (scene.layers + 1) * scene.spacing  # ground beyond the walls of the tank is not felt
    low, high = ([x + side * margin for x in corner] for corner, side in ((scene.tank.min, -1), (scene.tank.max, 1)))
    return engine().mesh_solid(scene.tank.bathymetry, scene.dimension, crop=(low, high))
