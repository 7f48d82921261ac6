"""What waves of a sum do to each other to second order in the steepness, and a sea spread over directions.

Every pair of linear waves carries two bound waves, of the sum and of the difference of their wave vectors and frequencies
(Longuet-Higgins 1963; the forms used here: Sharma & Dean 1981). They sharpen crests and lower the level under groups.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fsi.waves.incident import IncidentWaves, Paddle

COUNTS = 0.005  # elevation from which on a bound wave does, over the largest


def spread(waves: IncidentWaves, exponent: float, seed: int) -> IncidentWaves:
    """A sum of waves with a direction for each component, drawn from the density cos^2s(angle / 2) for the exponent s
    (Longuet-Higgins, Cartwright & Smith 1963). One direction for each frequency keeps the sea alike everywhere (Miles &
    Funke 1989)."""
    angle = np.linspace(-math.pi, math.pi, 20_001)
    total = np.cumsum(np.cos(0.5 * angle) ** (2 * exponent))
    off = np.interp(np.random.default_rng([seed, 1]).random(len(waves.k)), total / total[-1], angle)
    return replace(waves, off=off, drift=float((waves.drift * np.cos(off)).mean()))


def with_bound_waves(waves: IncidentWaves) -> IncidentWaves:
    """A sum of linear waves with the waves that are bound to its pairs.

    With R = omega^2 / g and b = a g / omega, the pair's potential is
    b_i b_j D / (2 (omega_i +- omega_j)) sin(theta_i +- theta_j), half of it where i = j (Sharma & Dean 1981, eqs. 10 to 16)."""
    wave = [waves.k, waves.elevation_amplitude, waves.omega, waves.phase, _angles(waves)]
    found = [[*wave[:3], waves.potential, *wave[3:]]]
    for sign in (1, -1):
        i, j = np.triu_indices(len(waves.k), k=0 if sign > 0 else 1)
        up = waves.omega[i] < waves.omega[j]
        i, j = np.where(up, j, i), np.where(up, i, j)
        apart = waves.omega[i] + sign * waves.omega[j] > 1e-6 * waves.omega[i]
        found.append(_bound(waves, wave, i[apart], j[apart], sign))
    k, a, omega, potential, phase, angle = (np.concatenate(parts) for parts in zip(*found, strict=True))
    off = None if waves.off is None else angle
    return replace(
        waves, k=k, elevation_amplitude=a, omega=omega, potential=potential, phase=phase, off=off, free=len(waves.k)
    )


def _angles(waves: IncidentWaves) -> np.ndarray:
    return np.zeros(len(waves.k)) if waves.off is None else waves.off


def _bound(waves: IncidentWaves, wave: list[np.ndarray], i: np.ndarray, j: np.ndarray, sign: int) -> list[np.ndarray]:
    """Wavenumber, elevation, frequency, potential, phase and direction of the bound waves of pairs (i, j) that count."""
    g, depth = waves.g, waves.depth
    (ki, ai, wi, pi, ti), (kj, aj, wj, pj, tj) = ([x[n] for x in wave] for n in (i, j))
    kx, ky = ki * np.cos(ti) + sign * kj * np.cos(tj), ki * np.sin(ti) + sign * kj * np.sin(tj)
    k, omega = np.hypot(kx, ky), wi + sign * wj
    ri, rj, dot = wi**2 / g, wj**2 / g, ki * kj * np.cos(ti - tj)
    pace = np.sqrt(ri) + sign * np.sqrt(rj)
    bend = pace * (np.sqrt(rj) * (ki**2 - ri**2) + sign * np.sqrt(ri) * (kj**2 - rj**2))
    d = (bend + 2 * pace**2 * (dot - sign * ri * rj)) / (pace**2 - k * np.tanh(k * depth))
    share = np.where(i == j, 0.25, 0.5) * ai * aj
    elevation = share * ((d - (dot - sign * ri * rj)) / np.sqrt(ri * rj) + ri + rj)
    potential = share * g * g / (wi * wj) * d / omega**2
    keep = np.abs(elevation) > COUNTS * np.abs(elevation).max(initial=0.0)
    return [x[keep] for x in (k, elevation, omega, potential, pi + sign * pj, np.arctan2(ky, kx))]


class Drift:
    """What the walls of a closed tank move by to second order under groups of waves, at places (m, axes) of a frame and
    heights z (l,) [m]: the part of dD/dt = u(D) - w dD/dz at the difference of two frequencies that
    ((xi . grad) xi - zeta xi_z) / 2 does not hold, ((xi . grad) u - (u . grad) xi - w xi_z + zeta u_z) / 2."""

    def __init__(self, waves: IncidentWaves, frame: np.ndarray, places: np.ndarray, z: np.ndarray):
        n = waves.free
        k, w, e = waves.wavevectors(frame)[:n], waves.omega[:n], waves.potential[:n]
        i, j = np.triu_indices(n, 1)
        apart = np.abs(w[i] - w[j]) > 1e-6 * w[i]
        self._i, self._j, self._waves = i[apart], j[apart], waves
        self._omega = w[self._i] - w[self._j]
        self._wave = np.exp(1j * (places @ (k[self._i] - k[self._j]).T))
        c, s = (shape[:, :n] * e for shape in waves.profiles(z))
        self._parts = [self._pairs(k, w, c, s, d) for d in range(k.shape[1])]

    def _pairs(self, k, w, c, s, d: int) -> np.ndarray:
        """Amplitudes (pairs, l) of the velocity along direction d."""
        bend, u, total = 1j * k[:, d] * s, -1j * w, 0.0  # of xi_d by z (l, n); d/dt
        for e in range(k.shape[1]):
            way, slope = 1j * k[:, e] * c, -k[:, d] * k[:, e] * c
            total = total + self._product(way, u * slope) - self._product(u * way, slope)
        total = total - self._product(u * s, bend) + self._product(s, u * bend)
        return 0.5 * total.T

    def _product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """The part of Re(a exp(i theta)) Re(b exp(i theta)) at differences of two frequencies, (l, pairs)."""
        i, j = self._i, self._j
        return 0.5 * (a[:, i] * b[:, j].conj() + a[:, j].conj() * b[:, i])

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement [m], velocity [m/s] and acceleration [m/s2] along the frame (axes, m, l)."""
        phase, turn = self._waves.phase, -1j * self._omega
        wave = self._wave * np.exp(1j * (phase[self._i] - phase[self._j] - self._omega * t))
        wave *= self._waves.ramped(t)[0] ** 2
        return tuple(np.stack([((wave * turn**n) @ part).real for part in self._parts]) for n in (-1.0, 0, 1))


class GroupPaddle(Paddle):
    """Walls that also move as groups of waves with their bound ones ask of them."""

    def __init__(self, waves: IncidentWaves, frame: np.ndarray, places: np.ndarray, z: np.ndarray):
        super().__init__(waves, frame, places, z)
        self._drift = Drift(waves, frame, places, z)

    def at(self, t: float) -> tuple[np.ndarray, ...]:
        """As that of `Paddle`."""
        *motion, w, b = super().at(t)
        return (*(one + slow for one, slow in zip(motion, self._drift.at(t), strict=True)), w, b)
