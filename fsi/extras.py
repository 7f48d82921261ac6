"""Packages that only some runs need."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from types import ModuleType

from fsi.errors import SceneError


def require(module: str, extra: str, purpose: str) -> ModuleType:
    """Import an optional package; SceneError with the install command where it is missing."""
    try:
        return import_module(module)
    except ModuleNotFoundError as fault:
        missing = (fault.name or module).partition(".")[0]
        raise SceneError(
            f"{purpose} needs the package {missing!r}, which is not installed",
            fix=f"install it with: pip install 'spindrift[{extra}]'",
        ) from None


def installed(module: str) -> bool:
    """Whether an optional package is there; it is not imported."""
    return find_spec(module) is not None


def version_of(package: str) -> str | None:
    """The version of a package, None where it is not there; MuJoCo's computing part can be there without its viewer."""
    try:
        return version("mujoco-core" if package == "mujoco" else package)
    except PackageNotFoundError:
        return None
