"""Irregular waves: a spectrum as a sum of regular waves with random frequencies and phases."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from fsi.parts import NonNegative, Positive
from fsi.waves.incident import IncidentWaves, linear_waves
from fsi.waves.kind import LEAST_HEIGHT, LEAST_LENGTH, Surface, Train, Water, WaveKind, resolved
from fsi.waves.linear import cosine_ramp, evanescent, piston_transfer, wavenumber

DEPTH_RATIO = 0.6  # Hm0 over depth that a sea hardly exceeds
STEEPNESS = 0.07  # Hm0 over the length at the peak that a sea hardly exceeds
LOWEST = 0.5  # frequency at which a spectrum begins [peak frequency]; there is less than 1e-8 of its energy below


class Waves(WaveKind):
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

    def piston(self, depth: float, g: float) -> IrregularPiston:
        return irregular_piston(self, depth, g)

    def incident(self, depth: float, g: float) -> IncidentWaves:
        return self.piston(depth, g).incident(depth, g)

    def trains(self, water: Water) -> list[Train]:
        return [Train("at the peak", self.Hm0, self.peak_period)]

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        sea = self.piston(depth, g)
        return [(2 * a, 2 * math.pi / w) for a, w in zip(sea.wave_amplitude, sea.omega, strict=True)]

    def warnings(self, water: Water) -> Iterator[str]:
        depth, length = water.depth, water.length(self.peak_period)
        if self.Hm0 > DEPTH_RATIO * depth:
            yield (
                f"waves.Hm0: {self.Hm0:g} m is {self.Hm0 / depth:.2f} of the depth {depth:g} m; "
                f"a sea hardly exceeds {DEPTH_RATIO}, higher waves break"
            )
        if self.Hm0 > STEEPNESS * length:
            yield (
                f"waves.Hm0: {self.Hm0:g} m is {self.Hm0 / length:.2f} of the wave length {length:.3g} m at the peak; "
                f"a sea hardly exceeds {STEEPNESS}, steeper waves break"
            )
        yield from resolved(water, "Hm0", self.Hm0, LEAST_HEIGHT)
        yield from resolved(water, "the shortest wave", water.length(self.peak_period / self.highest), LEAST_LENGTH)

    def surface(self, motion, depth: float, g: float) -> Surface:
        return sea_surface(motion, depth, g)


def sea_surface(motion: IrregularPiston, depth: float, g: float) -> Surface:
    """The elevation by linear theory that a sum of components makes near the piston."""
    k = np.array([wavenumber(w, depth, g) for w in motion.omega])
    decay, share = evanescent(motion.omega, depth, g)

    def elevation(t: float, x: float) -> float:
        angle = motion.omega * t + motion.phase
        near = (share * np.exp(-decay * x)).sum(1)
        eta = motion.wave_amplitude @ np.cos(angle - k * x) + (motion.amplitude * near) @ np.sin(angle)
        return motion.envelope(t) * float(eta)

    return elevation


def spectrum(f: np.ndarray, peak: float, gamma: float) -> np.ndarray:
    """Shape of the JONSWAP spectrum at the frequencies f [Hz], without its scale: f^-5 exp(-1.25 (peak/f)^4) gamma^r,
    r = exp(-(f/peak - 1)^2 / (2 s^2)), s = 0.07 below the peak and 0.09 above (Hasselmann et al. 1973). With gamma = 1 it
    is that of Pierson & Moskowitz (1964)."""
    ratio = np.asarray(f) / peak
    width = np.where(ratio <= 1, 0.07, 0.09)
    return ratio**-5.0 * np.exp(-1.25 * ratio**-4.0) * gamma ** np.exp(-0.5 * ((ratio - 1) / width) ** 2)


@dataclass(frozen=True)
class IrregularPiston:
    """x = r(t) sum s_n sin(omega_n t + phase_n) under the cosine ramp r, with the amplitudes s [m] of the piston; those
    of the waves are `wave_amplitude` [m]. All arrays have one value a component."""

    amplitude: np.ndarray
    wave_amplitude: np.ndarray
    omega: np.ndarray
    phase: np.ndarray
    ramp: float

    @property
    def excursion(self) -> tuple[float, float]:
        """Six standard deviations: a sum of many components goes beyond them once in 1e8 waves."""
        most = min(6 * math.sqrt(0.5 * float((self.amplitude**2).sum())), float(np.abs(self.amplitude).sum()))
        return -most, most

    def envelope(self, t: float) -> float:
        """The factor of the ramp."""
        return cosine_ramp(t, self.ramp)[0]

    def incident(self, depth: float, g: float) -> IncidentWaves:
        """The waves that it makes, as far as they go on."""
        return linear_waves(self.wave_amplitude, self.omega, -self.phase, depth, g)

    def __call__(self, t: float) -> tuple[float, float, float]:
        w, angle = self.omega, self.omega * t + self.phase
        s, c = self.amplitude * np.sin(angle), self.amplitude * np.cos(angle)
        x, u, a = float(s.sum()), float((w * c).sum()), -float((w * w * s).sum())
        r, dr, ddr = cosine_ramp(t, self.ramp)
        return r * x, dr * x + r * u, ddr * x + 2 * dr * u + r * a


def irregular_piston(waves: Waves, depth: float, g: float) -> IrregularPiston:
    """The piston for irregular waves in water of this depth [m].

    One component stands at a random place in each of equally wide bands of frequency, so that the sum does not repeat
    itself, with the amplitude of its band's energy; the amplitudes are scaled to Hm0 exactly."""
    peak = 1 / waves.peak_period
    gamma = 1.0 if waves.spectrum == "pierson_moskowitz" else waves.gamma or 3.3
    edges = np.linspace(LOWEST * peak, waves.highest * peak, waves.components + 1)
    ramp = 2 * waves.peak_period if waves.ramp is None else waves.ramp
    return random_sea(edges, lambda f: spectrum(f, peak, gamma), waves.Hm0, waves.seed, ramp, depth, g)


def random_sea(edges: np.ndarray, shape, Hm0: float, seed: int, ramp: float, depth: float, g: float) -> IrregularPiston:
    """The piston for a sea of the spectrum shape(f [Hz]), of any scale, with a component in each band between `edges` [Hz]."""
    rng, count = np.random.default_rng(seed), len(edges) - 1
    f = edges[:-1] + rng.random(count) * np.diff(edges)
    phase = 2 * math.pi * rng.random(count)
    height = np.sqrt(shape(f))
    wave_amplitude = height * Hm0 / math.sqrt(8 * (height**2).sum())  # Hm0^2 / 16 = m0 = sum a^2 / 2
    omega = 2 * math.pi * f
    transfer = np.array([piston_transfer(wavenumber(w, depth, g) * depth) for w in omega])
    return IrregularPiston(wave_amplitude / transfer, wave_amplitude, omega, phase, ramp)
