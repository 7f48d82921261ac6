"""Steep regular waves in shallow water: stream function or Stokes' fifth order, made by a piston that follows the water."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from fsi.extras import require
from fsi.parts import NonNegative, Positive
from fsi.waves.incident import IncidentWaves, return_flow, steady_waves
from fsi.waves.kind import Fault, Surface, Train, Water, WaveKind, train_warnings
from fsi.waves.linear import cosine_ramp, piston_transfer

MODELS = {"stream_function": "Fenton", "stokes": "Stokes"}
DEEP = 1.5  # kd from which on a piston is too far from the water's motion for its higher harmonics
SAMPLES = 512  # of a wave
HARMONICS = 20


class Waves(WaveKind):
    """Regular waves of finite height by Raschii (Landet 2018): the stream function (Fenton 1999) or Stokes' fifth order. The
    piston moves with the mean velocity over the depth of a wave of permanent form, dX/dt = c eta / (d + eta) where it stands
    (Goring 1978), its first harmonic by the piston's own transfer function. For waves beyond `regular` of second order,
    in water of kd below 1.5."""

    kind: Literal["nonlinear"]
    wave_height: Positive  # crest to trough [m]
    period: Positive  # [s]
    theory: Literal["stream_function", "stokes"] = "stream_function"
    terms: Annotated[int, Field(ge=3, le=40)] | None = None  # of the series; 10, of Stokes' 5 if not given
    ramp: NonNegative | None = None  # cosine ramp of the stroke [s]; two periods if not given

    def _wave(self, depth: float, g: float, period: float | None = None) -> SteadyWave:
        terms = self.terms or (5 if self.theory == "stokes" else 10)
        return steady_wave(MODELS[self.theory], self.wave_height, period or self.period, depth, g, terms)

    def piston(self, depth: float, g: float) -> HarmonicPiston:
        wave = self._wave(depth, g)
        return follow(wave, depth, 2 * self.period if self.ramp is None else self.ramp)

    def incident(self, depth: float, g: float) -> IncidentWaves:
        omega, wave = 2 * math.pi / self.period, self._wave(depth, g)
        for _ in range(
            3
        ):  # the return flow of a closed tank carries the wave back: it is one of a shorter period there
            drift = return_flow(wave.amplitude[0], wave.k, omega, depth, g)
            wave = self._wave(depth, g, 2 * math.pi / (omega - wave.k * drift))
        return steady_waves(wave.amplitude, wave.velocity, wave.k, omega, depth, g)

    def trains(self, water: Water) -> list[Train]:
        return [Train(self.theory.replace("_", " "), self.wave_height, self.period)]

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        return [(self.wave_height, self.period)]

    def faults(self, water: Water) -> Iterator[Fault]:
        if self.theory == "stokes" and self.terms is not None and self.terms > 5:
            yield "waves.terms", "Stokes' series ends at the fifth order", "give at most 5, or take the stream function"
            return
        try:
            self._wave(water.depth, water.g)
        except ArithmeticError as fault:
            fix = "use a lower wave or deeper water, or another theory"
            yield "waves.wave_height", f"there is no such wave by the {self.theory.replace('_', ' ')}: {fault}", fix

    def warnings(self, water: Water) -> Iterator[str]:
        yield from train_warnings(water, "waves.wave_height", self.wave_height, self.period)
        kd = self._wave(water.depth, water.g).k * water.depth
        if kd > DEEP:
            yield (
                f"waves.kind: kd is {kd:.2f}, and a piston that moves with the mean velocity over the depth sets free waves "
                f"off from about {DEEP} on; use kind = 'regular' with order = 2"
            )

    def figures(self, water: Water) -> Iterator[str]:
        wave = self._wave(water.depth, water.g)
        crest = float(wave.elevation(np.zeros(1))[0])
        yield (
            f"{self.theory.replace('_', ' ')}, height {self.wave_height:g} m, period {self.period:g} s, length "
            f"{2 * math.pi / wave.k:.3g} m, crest {crest:.3g} m above still water, kd {wave.k * water.depth:.2f}"
        )

    def surface(self, motion, depth: float, g: float) -> Surface:
        wave = self._wave(depth, g)
        return lambda t, x: motion.envelope(t) * float(wave.elevation(np.array([motion.omega * t - wave.k * x]))[0])


@dataclass(frozen=True)
class SteadyWave:
    """A wave of permanent form: wavenumber k [1/m], angular frequency omega [1/s], amplitudes (n,) [m] of the cosines of its
    elevation, and those (n,) [m/s] of its horizontal velocity at the still water level."""

    k: float
    omega: float
    amplitude: np.ndarray
    velocity: np.ndarray

    def elevation(self, angle: np.ndarray) -> np.ndarray:
        """Elevation (m,) [m] at phases (m,), 0 at a crest; its mean is 0."""
        n = np.arange(1, len(self.amplitude) + 1)
        return np.cos(np.outer(angle, n)) @ self.amplitude


@lru_cache(maxsize=8)
def steady_wave(model: str, height: float, period: float, depth: float, g: float, terms: int) -> SteadyWave:
    """A wave by Raschii. Raises SceneError where that is missing, ArithmeticError where there is no such wave."""
    raschii = require("raschii", "waves", "waves.kind = 'nonlinear'")
    wave_model, _ = raschii.get_wave_model(model)
    try:
        wave = wave_model(height=height, depth=depth, period=period, N=terms, g=g)
    except raschii.RaschiiError as fault:
        raise ArithmeticError(str(fault)) from None
    except (ValueError, np.linalg.LinAlgError) as fault:
        raise ArithmeticError(f"the solution does not converge ({fault})") from None
    x = np.arange(SAMPLES) / SAMPLES * 2 * math.pi / wave.k
    eta = np.asarray(wave.surface_elevation(x, t=0.0), float) - depth
    found = 2 * np.fft.rfft(eta).real[1 : HARMONICS + 1] / SAMPLES
    if not np.isfinite(found).all() or abs(np.ptp(eta) - height) > 0.02 * height:
        raise ArithmeticError(f"the series gives a height of {np.ptp(eta):.3g} m")
    u = np.asarray(wave.velocity(x, np.full(SAMPLES, depth), t=0.0, all_points_wet=True), float)[:, 0]
    speed = 2 * np.fft.rfft(u).real[1 : HARMONICS + 1] / SAMPLES
    return SteadyWave(float(wave.k), 2 * math.pi / period, found, speed)


def follow(wave: SteadyWave, depth: float, ramp: float) -> HarmonicPiston:
    """The piston of a wave. With theta = omega t - k X, dX/dt = c eta / (d + eta) becomes dX/dtheta = eta / (k d): the path is
    X = sum a_n sin(n theta) / (n k d) at the time (theta + k X) / omega."""
    n = np.arange(1, len(wave.amplitude) + 1)
    theta = 2 * math.pi * np.arange(SAMPLES) / SAMPLES
    path = np.sin(np.outer(theta, n)) @ (wave.amplitude / (n * wave.k * depth))
    angle = theta + wave.k * path  # omega t
    even = 2 * math.pi * np.arange(SAMPLES) / SAMPLES
    x = np.interp(even, angle, path, period=2 * math.pi)
    found = -2 * np.fft.rfft(x).imag[1 : HARMONICS + 1] / SAMPLES
    kd = wave.k * depth
    found[0] *= kd / piston_transfer(kd)
    return HarmonicPiston(found, wave.omega, ramp)


@dataclass(frozen=True)
class HarmonicPiston:
    """x = r(t) sum s_n sin(n omega t) under the cosine ramp r of `ramp` seconds, s (n,) [m]."""

    amplitude: np.ndarray
    omega: float
    ramp: float

    @property
    def excursion(self) -> tuple[float, float]:
        most = float(np.abs(self._sums(np.linspace(0, 2 * math.pi, 721)[:, None])[0]).max())
        return -most, most

    def envelope(self, t: float) -> float:
        """The factor of the ramp."""
        return cosine_ramp(t, self.ramp)[0]

    def _sums(self, angle):
        n = np.arange(1, len(self.amplitude) + 1)
        w = n * self.omega
        s, c = self.amplitude * np.sin(n * angle), self.amplitude * np.cos(n * angle)
        return s.sum(-1), (w * c).sum(-1), -(w * w * s).sum(-1)

    def __call__(self, t: float) -> tuple[float, float, float]:
        x, u, a = map(float, self._sums(self.omega * t))
        r, dr, ddr = cosine_ramp(t, self.ramp)
        return r * x, dr * x + r * u, ddr * x + 2 * dr * u + r * a
