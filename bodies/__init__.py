"""Rigid bodies: MJCF files, MuJoCo stepping, boundary particles of their wet geoms."""

from importlib import import_module

from fsi.extras import require

_HOME = {"BodySet": "bodyset", "load": "bodyset", "mesh_solid": "shapes.meshes", "grid_solid": "grids"}
__all__ = ["BodySet", "grid_solid", "load", "mesh_solid"]


def __getattr__(name: str):
    """Import on first use, so that MuJoCo is needed only where there are bodies."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in ("mesh_solid", "grid_solid"):
        require("mujoco", "bodies", "a scene with bodies")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
