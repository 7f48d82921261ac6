"""The waves of a scene: what the piston at the x- wall makes, and what takes them away again.

`fsi.waves` turns each kind into a motion of the piston, `fsi.scene.check_waves` says what cannot work.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fsi.scene.parts import FilePath, NonNegative, Number, Part, Positive


class Piston(Part):
    """What all kinds of waves share."""

    absorb: bool = False  # the piston also gives way to waves that come back to it (active absorption)


class RegularWaves(Piston):
    """Sinusoidal waves by linear theory (Dean & Dalrymple 1991, eq. 6.25). The second order adds the motion that keeps
    the crests sharp without setting free off waves of twice the frequency (Madsen 1971)."""

    kind: Literal["regular"] = "regular"
    wave_height: Positive  # crest to trough [m]
    period: Positive  # [s]
    order: Literal[1, 2] | None = None  # 2 within its range, H L^2 / d^3 < 8 pi^2 / 3, and 1 beyond if not given
    ramp: NonNegative | None = None  # cosine ramp of the stroke [s]; two periods if not given


class IrregularWaves(Piston):
    """A sea state, the sum of many regular waves of linear theory with random frequencies and phases; the same seed
    gives the same waves, however long the run."""

    kind: Literal["irregular"]
    spectrum: Literal["jonswap", "pierson_moskowitz"] = "jonswap"
    Hm0: Positive  # significant wave height, 4 sqrt(m0) [m]
    peak_period: Positive  # [s]
    gamma: Annotated[float, Field(ge=1, le=10)] | None = None  # of JONSWAP's peak; 3.3 if not given
    seed: Annotated[int, Field(ge=0)] = 1
    components: Annotated[int, Field(ge=10, le=10_000)] = 200
    highest: Annotated[float, Field(gt=1.5, le=6)] = 2.5  # frequency at which the spectrum ends [peak frequency]
    ramp: NonNegative | None = None  # [s]; two peak periods if not given

    @model_validator(mode="after")
    def _gamma_has_a_use(self):
        if self.gamma is not None and self.spectrum != "jonswap":
            raise ValueError(f"gamma is of no use to {self.spectrum!r}; leave it out or set spectrum = 'jonswap'")
        return self


class SolitaryWave(Piston):
    """One solitary wave, by the piston's path of Goring (1978): the piston moves forward once and stays there."""

    kind: Literal["solitary"]
    wave_height: Positive  # crest above still water [m]
    theory: Literal["boussinesq", "rayleigh"] = "rayleigh"  # of the wave's shape; rayleigh suits higher waves better
    start: NonNegative = 0.0  # when the piston begins to move [s]


class WaveGroup(Part):
    """Some equal waves within a packet."""

    wave_height: Positive  # crest to trough [m]
    period: Positive  # [s]
    waves: Annotated[float, Field(gt=0, multiple_of=0.5)]  # how many, in halves


class WavePacket(Piston):
    """Groups of regular waves of linear theory, one after the other, the first crest ahead. The piston starts and ends
    at rest, in each group with the full amplitude from the first wave on."""

    kind: Literal["packet"]
    groups: tuple[WaveGroup, ...]
    start: NonNegative = 0.0  # when the piston begins to move [s]

    @model_validator(mode="after")
    def _some_group(self):
        if not self.groups:
            raise ValueError("a packet without groups; add [[waves.groups]] with wave_height, period and waves")
        return self


class TableWaves(Piston):
    """Piston that follows a table: columns time [s], displacement [m], commas, a header line."""

    kind: Literal["table"]
    file: FilePath


def _wave_kind(waves) -> str | None:
    return waves.get("kind", "regular") if isinstance(waves, dict) else getattr(waves, "kind", None)


Waves = Annotated[
    Annotated[RegularWaves, Tag("regular")]
    | Annotated[IrregularWaves, Tag("irregular")]
    | Annotated[SolitaryWave, Tag("solitary")]
    | Annotated[WavePacket, Tag("packet")]
    | Annotated[TableWaves, Tag("table")],
    Discriminator(_wave_kind),
]


class DampingZone(Part):
    """Sponge across the tank from `start`, where it begins, to `end` [m] along `axis`: velocities decay at a rate [1/s]
    that grows to `rate` as the square of the distance into it. With end below start it faces the other way."""

    start: Number
    end: Number
    axis: Literal["x", "y"] = "x"
    rate: Positive = 10.0
