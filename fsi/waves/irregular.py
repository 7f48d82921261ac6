"""Irregular waves: a spectrum as a sum of regular waves with random frequencies and phases."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsi.waves.linear import piston_transfer, wavenumber
from fsi.waves.regular import cosine_ramp

LOWEST = 0.5  # frequency at which a spectrum begins [peak frequency]; there is less than 1e-8 of its energy below


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
    def reach(self) -> tuple[float, float]:
        """Six standard deviations: a sum of many components goes beyond them once in 1e8 waves."""
        most = min(6 * math.sqrt(0.5 * float((self.amplitude**2).sum())), float(np.abs(self.amplitude).sum()))
        return -most, most

    def envelope(self, t: float) -> float:
        """The factor of the ramp."""
        return cosine_ramp(t, self.ramp)[0]

    def __call__(self, t: float) -> tuple[float, float, float]:
        w, angle = self.omega, self.omega * t + self.phase
        s, c = self.amplitude * np.sin(angle), self.amplitude * np.cos(angle)
        x, u, a = float(s.sum()), float((w * c).sum()), -float((w * w * s).sum())
        r, dr, ddr = cosine_ramp(t, self.ramp)
        return r * x, dr * x + r * u, ddr * x + 2 * dr * u + r * a


def irregular_piston(waves, depth: float, g: float) -> IrregularPiston:
    """The piston for `IrregularWaves` in water of this depth [m].

    One component stands at a random place in each of equally wide bands of frequency, so that the sum does not repeat
    itself, with the amplitude of its band's energy; the amplitudes are scaled to Hm0 exactly."""
    rng = np.random.default_rng(waves.seed)
    peak = 1 / waves.peak_period
    edges = np.linspace(LOWEST * peak, waves.highest * peak, waves.components + 1)
    f = edges[:-1] + rng.random(waves.components) * np.diff(edges)
    phase = 2 * math.pi * rng.random(waves.components)
    gamma = 1.0 if waves.spectrum == "pierson_moskowitz" else waves.gamma or 3.3
    height = np.sqrt(spectrum(f, peak, gamma))
    wave_amplitude = height * waves.Hm0 / math.sqrt(8 * (height**2).sum())  # Hm0^2 / 16 = m0 = sum a^2 / 2
    omega = 2 * math.pi * f
    transfer = np.array([piston_transfer(wavenumber(w, depth, g) * depth) for w in omega])
    ramp = 2 * waves.peak_period if waves.ramp is None else waves.ramp
    return IrregularPiston(wave_amplitude / transfer, wave_amplitude, omega, phase, ramp)
