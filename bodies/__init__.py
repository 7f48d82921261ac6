"""Rigid bodies: MJCF files, MuJoCo stepping, boundary particles of their wet geoms."""

from importlib import import_module

from fsi.errors import SceneError

_HOME = {"BodySet": "bodyset", "load": "bodyset", "mesh_solid": "meshes"}
__all__ = ["BodySet", "load", "mesh_solid"]


def __getattr__(name: str):
    """Import on first use, so that MuJoCo and trimesh are needed only where there are bodies."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    except ModuleNotFoundError as error:
        if error.name not in ("mujoco", "trimesh"):
            raise
        fix = 'pip install "spindrift[bodies]"'
        raise SceneError(f"bodies and meshes need {error.name}, which is not installed", fix=fix) from None
