"""Validation on the built-in scenes: `fsi run NAME --level LEVEL` and `fsi validate NAME --level LEVEL` run the same.

The scene file gives the coarse level as it stands, the others as its tables `[levels.NAME]`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cases.validation.engine.case import LEVELS
from fsi.scene.file import load_scene, scene_levels


def spacings(name: str) -> dict[str, float]:
    """Level -> particle spacing [m] of a built-in scene."""
    levels = scene_levels(name)
    finer = {level: load_scene(name, level=level).spacing for level in LEVELS if level in levels}
    return {LEVELS[0]: load_scene(name).spacing} | finer


def builder(name: str) -> Callable[[float, Path], dict]:
    """The `scene` of a `Case`: a built-in scene as plain data, at the level that has this spacing."""

    def scene(spacing: float, folder: Path) -> dict:
        level = next(level for level, dr in spacings(name).items() if dr == spacing)
        chosen = load_scene(name, level=level if level in scene_levels(name) else None)
        return chosen.model_dump(mode="json", exclude_unset=True, exclude={"name", "spacing"})

    return scene
