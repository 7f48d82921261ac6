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


class Sea(Part):
    """The open sea: the tank is a box around the bodies, whose end walls move as the water of the incident waves does,
    and along its sides the water is drawn to these waves, so that what the bodies send out leaves (`fsi.fluid.sea`).

    No wall can carry a current: along it the tank is periodic, where its waves run along it a whole number of them long, and
    zones lie along both of its ends."""

    waves: (
        Waves  # the incident waves, by kind and keys as in [waves]; at x = y = 0 their phases are those at the piston
    )
    heading: Number = 0.0  # direction that they run to, from x towards y [degrees]
    zone: Positive | None = None  # width of the zones along the sides [m]; half a wave length if not given
    rate: Positive | None = None  # at which the water is drawn to the waves at the walls [1/s]; 1.45 omega if not given
    spreading: Positive | None = None  # exponent s of cos^2s(angle / 2) of a sum of waves; one direction if not given
    order: Literal[1, 2] = 1  # 2: a sum of waves with the waves bound to each pair of them
    start: Literal["waves", "rest"] = "waves"  # under waves, or at rest with the ramp of the waves
    current: Number | tuple[Number, ...] | None = None  # uniform velocity of the water [m/s], u or [u, v]
