"""Spindrift's fluid and run: explicit incompressible SPH, coupled to rigid bodies in MuJoCo.

Names are resolved on first use, so that importing `fsi` costs nothing that a scene does not need.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what type checkers and editors see
    from fsi.environment import Environment
    from fsi.errors import RunError, SceneError
    from fsi.record.dataset import load_run
    from fsi.resuming import resume
    from fsi.runner import Run, bench, check, report, run, sweep, validate
    from fsi.scene.file import load_scene
    from fsi.scene.model import Scene
    from fsi.session import Session, open
    from fsi.simulation.loop import Simulation

    __version__: str

_HOMES = {
    "Scene": "fsi.scene.model",
    "SceneError": "fsi.errors",
    "RunError": "fsi.errors",
    "load_scene": "fsi.scene.file",
    "Simulation": "fsi.simulation.loop",
    "Run": "fsi.runner",
    "run": "fsi.runner",
    "check": "fsi.runner",
    "sweep": "fsi.runner",
    "report": "fsi.runner",
    "validate": "fsi.runner",
    "bench": "fsi.runner",
    "Environment": "fsi.environment",
    "Session": "fsi.session",
    "open": "fsi.session",
    "resume": "fsi.resuming",
    "load_run": "fsi.record.dataset",
}

__all__ = [
    "Environment",
    "Run",
    "RunError",
    "Scene",
    "SceneError",
    "Session",
    "Simulation",
    "__version__",
    "bench",
    "check",
    "load_run",
    "load_scene",
    "open",
    "report",
    "resume",
    "run",
    "sweep",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name == "__version__":
        from importlib.metadata import version

        return version("spindrift")
    raise AttributeError(f"module 'fsi' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
