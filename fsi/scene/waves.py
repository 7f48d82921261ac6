"""The waves of a scene: what the piston at the x- wall makes, and what takes them away again.

`fsi.waves.kinds` holds the keys of each kind and all that follows from them, `fsi.scene.check_waves` what goes for all.
"""

from __future__ import annotations

from typing import Annotated, Literal

from fsi.parts import Number, Part, Positive
from fsi.scene.kinds import ChosenBy
from fsi.waves import known_kinds, load_kind
from fsi.waves.kind import WaveKind

Waves = Annotated[WaveKind, ChosenBy("kind", "regular", known_kinds, load_kind)]


class DampingZone(Part):
    """Sponge across the tank from `start`, where it begins, to `end` [m] along `axis`: velocities decay at a rate [1/s]
    that grows to `rate` as the square of the distance into it. With end below start it faces the other way."""

    start: Number
    end: Number
    axis: Literal["x", "y"] = "x"
    rate: Positive = 10.0
