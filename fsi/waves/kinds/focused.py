"""A focused group: the most probable shape of an extreme crest of a sea (NewWave)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from fsi.parts import NonNegative, Number, Positive
from fsi.waves.incident import IncidentWaves
from fsi.waves.kind import LEAST_LENGTH, Surface, Train, Water, WaveKind, resolved, train_warnings
from fsi.waves.kinds.irregular import LOWEST, IrregularPiston, sea_surface, spectrum
from fsi.waves.linear import piston_transfer, wavenumber


class Waves(WaveKind):
    """The mean shape of a sea around a crest of a given height, by linear theory: components of amplitudes proportional to
    the spectrum's energy, all with their crest at one place and time (Tromans, Anaturk & Hagemeijer 1991). The group comes
    again after `components` / (`highest` - 0.5) peak periods."""

    kind: Literal["focused"]
    crest: Positive  # height of the crest at the focus above still water, by linear theory [m]
    peak_period: Positive  # [s]
    gamma: Annotated[float, Field(ge=1, le=10)] = 3.3  # of JONSWAP's peak; 1 is Pierson and Moskowitz's spectrum
    place: Number = 0.0  # of the focus: distance from the piston; along the heading from the origin in a `[sea]` [m]
    time: NonNegative  # of the focus [s]
    components: Annotated[int, Field(ge=10, le=10_000)] = 100
    highest: Annotated[float, Field(gt=1.5, le=6)] = 2.5  # frequency at which the spectrum ends [peak frequency]
    ramp: NonNegative | None = None  # cosine ramp of the piston [s]; a peak period if not given

    def piston(self, depth: float, g: float) -> IrregularPiston:
        peak = 1 / self.peak_period
        edges = np.linspace(LOWEST * peak, self.highest * peak, self.components + 1)
        f = 0.5 * (edges[1:] + edges[:-1])
        energy = spectrum(f, peak, self.gamma)
        amplitude, omega = self.crest * energy / energy.sum(), 2 * math.pi * f
        k = np.array([wavenumber(w, depth, g) for w in omega])
        transfer = np.array([piston_transfer(x * depth) for x in k])
        ramp = self.peak_period if self.ramp is None else self.ramp
        return IrregularPiston(amplitude / transfer, amplitude, omega, k * self.place - omega * self.time, ramp)

    def incident(self, depth: float, g: float) -> IncidentWaves:
        return replace(self.piston(depth, g).incident(depth, g), aligned=True)

    def trains(self, water: Water) -> list[Train]:
        return [Train("at the focus", 2 * self.crest, self.peak_period)]

    def warnings(self, water: Water) -> Iterator[str]:
        yield from train_warnings(water, "waves.crest", 2 * self.crest, self.peak_period)
        yield from resolved(water, "the shortest wave", water.length(self.peak_period / self.highest), LEAST_LENGTH)

    def surface(self, motion, depth: float, g: float) -> Surface:
        return sea_surface(motion, depth, g)
