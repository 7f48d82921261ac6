"""Spindrift's fluid and run: explicit incompressible SPH, coupled to rigid bodies in MuJoCo.

Names are resolved on first use, so that importing `fsi` costs nothing that a scene does not need.
"""

from importlib import import_module

_HOMES = {
    "Scene": "fsi.scene.model",
    "SceneError": "fsi.errors",
    "RunError": "fsi.errors",
    "load_scene": "fsi.scene.file",
    "Simulation": "fsi.simulation.loop",
    "run": "fsi.runner",
    "check": "fsi.runner",
    "sweep": "fsi.runner",
    "open": "fsi.session",
    "resume": "fsi.resuming",
    "load_run": "fsi.record.run_folder",
}

__all__ = list(_HOMES)


def __getattr__(name):
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'fsi' has no attribute {name!r}")
