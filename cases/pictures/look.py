"""How a run is drawn: what the pictures of two and of three dimensions share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cases.pictures.frames import Frame, RunFrames
from fsi.record.fields import top
from fsi.scene.fields import field_of


@dataclass(frozen=True)
class Look:
    """How a run is drawn: the `field` of the colours (that of the timeline if empty) and their `limits` (those of the
    timeline if None), particles or the `surface`, the `camera` of a three-dimensional run (place and target, six numbers
    [m]), the `window` (x0, x1, z0, z1) [m] of a two-dimensional one, and the picture's width and height in pixels (if None
    as high as the window needs, in three dimensions 1280 x 720)."""

    field: str = ""
    limits: tuple[float, ...] | None = None
    surface: bool = False
    camera: tuple[float, ...] | None = None
    window: tuple[float, ...] | None = None
    size: tuple[int, int] | None = None


def values_of(frame: Frame, field: str) -> np.ndarray:
    """Values (n,) of a field."""
    if field == "speed" and field not in frame.values:
        return np.linalg.norm(frame.values["velocity"], axis=1)
    return frame.values[field]


def limits(run: RunFrames, look: Look, field: str) -> tuple[float, float]:
    """The values at the ends of the colours."""
    return look.limits or (0.0, top(run.scene, field))


def caption(field: str) -> str:
    """Name and units of a field."""
    units = field_of(field).units
    return f"{field.replace('_', ' ')}" + (f" [{units}]" if units else "")
