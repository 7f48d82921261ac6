"""Incident and reflected waves from the elevations of several gauges."""

from __future__ import annotations

import math

import numpy as np


def first_harmonic(t: np.ndarray, y: np.ndarray, omega: float) -> np.ndarray:
    """Complex amplitude A of the part Re(A exp(-i omega t)) of each column of y (n, m), by least squares together with
    the mean and the second harmonic, so that the record need not hold whole periods."""
    basis = np.stack([np.ones_like(t), *(f(n * omega * t) for n in (1, 2) for f in (np.cos, np.sin))], 1)
    found = np.linalg.lstsq(basis, y, rcond=None)[0]
    return found[1] + 1j * found[2]


def separate(x: np.ndarray, amplitude: np.ndarray, k: float) -> tuple[complex, complex, float]:
    """Complex amplitudes, at x = 0, of the waves towards +x and -x that explain these at the gauges x [m] best, and
    what stays unexplained (root mean square). For two gauges Goda & Suzuki (1976), for three Mansard & Funke (1980);
    any number by the same least squares."""
    basis = np.stack([np.exp(1j * k * x), np.exp(-1j * k * x)], 1)
    found = np.linalg.lstsq(basis, amplitude, rcond=None)[0]
    rest = float(np.sqrt((np.abs(basis @ found - amplitude) ** 2).mean()))
    return complex(found[0]), complex(found[1]), rest


def wavenumber_of(x: np.ndarray, amplitude: np.ndarray, guess: float, span: float = 0.1) -> float:
    """The wavenumber [1/m] within a share `span` of the guess with which `separate` leaves least unexplained; waves of
    finite height are a little longer than linear theory has them, which would otherwise look like reflection."""
    candidates = guess * np.linspace(1 - span, 1 + span, 401)
    return float(candidates[np.argmin([separate(x, amplitude, k)[2] for k in candidates])])


def wave_heights(
    t: np.ndarray, elevation: np.ndarray, x: np.ndarray, omega: float, guess: float
) -> tuple[float, float]:
    """Heights [m] of the incident and the reflected wave of angular frequency omega from the elevations (n, m) at m
    gauges."""
    amplitude = first_harmonic(t, elevation, omega)
    incident, reflected, _ = separate(x, amplitude, wavenumber_of(x, amplitude, guess))
    return 2 * abs(incident), 2 * abs(reflected)


def group_speed(k: float, depth: float, g: float) -> float:
    """Speed [m/s] at which the energy of linear waves travels (Dean & Dalrymple 1991, eq. 4.82)."""
    kd = k * depth
    omega = math.sqrt(g * k * math.tanh(kd))
    return 0.5 * omega / k * (1 + 2 * kd / math.sinh(2 * kd))
