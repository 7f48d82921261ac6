"""Packages that only some runs need."""

from __future__ import annotations

from importlib import import_module
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
