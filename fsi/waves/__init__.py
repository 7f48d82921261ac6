"""Waves: linear theory, the kinds of waves that a scene can ask for, and the motion of the piston that makes them.

Pure theory, beside the particle sums and below the scene: it knows no particles, and of a scene its `[waves]` alone.
"""

from __future__ import annotations

from pathlib import Path

from fsi import plugins
from fsi.waves.kind import Motion, WaveKind
from fsi.waves.linear import piston_transfer, wavenumber

__all__ = ["Motion", "WaveKind", "known_kinds", "load_kind", "piston", "piston_transfer", "wavenumber"]


def known_kinds() -> list[str]:
    """Names of the kinds, ours first; none of them is imported."""
    ours = sorted(file.stem for file in Path(__file__).parent.glob("kinds/[!_]*.py"))
    return [*ours, *(name for name in plugins.registered("waves") if name not in ours)]


def load_kind(name: str) -> type[WaveKind]:
    """The model of a kind. Raises SceneError where the package that brings it cannot be imported."""
    if Path(__file__).parent.joinpath("kinds", f"{name}.py").is_file():
        from importlib import import_module

        plugins.check_ours("waves", name)
        return import_module(f"{__name__}.kinds.{name}").Waves
    return plugins.find("waves", name)


def piston(waves: WaveKind, depth: float, g: float) -> Motion:
    """The motion of the piston that a scene's `waves` asks for in water of this depth [m]."""
    return waves.piston(depth, g)
