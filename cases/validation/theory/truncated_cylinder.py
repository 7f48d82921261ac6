"""Heave of a circular cylinder that ends above the floor: linear radiation by matched eigenfunctions (Yeung 1981, Applied Ocean
Research 3, 119-133).

For unit velocity exp(-i omega t), with z' from the floor up, S the gap under the cylinder and h the depth:

    under it:  phi = (z'^2 - r^2 / 2) / (2 S) + sum_n A_n cos(n pi z' / S) I0(n pi r / S) / I0(n pi a / S)
    outside:   phi = sum_m B_m Z_m(z') R_m(r) / R_m(a),   R_0 = H0(k r), R_m = K0(k_m r)

phi meets at r = a below the cylinder, d phi / dr over the whole depth, 0 along the side.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.waves.linear import wavenumber


def radiation(
    omega: float, radius: float, draft: float, depth: float, gravity: float = 9.81, modes: int = 60
) -> tuple[float, float]:
    """Added mass and damping in heave at omega [1/s], over the density of the water [m3, m3/s]; lengths in m."""
    from scipy.special import h1vp, hankel1, i0e, i1e, k0e, k1e

    gap = depth - draft
    outer = _wavenumbers(omega, depth, gravity, modes)
    n = np.arange(modes)[:, None] * math.pi / gap  # under the cylinder
    overlap = _overlap(n, outer[None, :], gap) / np.sqrt(_norm(outer, depth))  # of cos n z' and Z_m, over the gap
    steep = np.empty(modes, complex)  # R_m'(a) / R_m(a)
    k = outer[0].imag  # the travelling wave is the root i k
    steep[0] = k * h1vp(0, k * radius) / hankel1(0, k * radius)
    steep[1:] = -outer[1:].real * k1e(outer[1:].real * radius) / k0e(outer[1:].real * radius)
    inner = n[:, 0] * i1e(n[:, 0] * radius) / i0e(n[:, 0] * radius)
    share = np.where(np.arange(modes) == 0, 1.0, 2.0) / gap
    # A = share (overlap B - particular); depth steep B = overlap^T (inner A) + flux
    particular = _particular(n[:, 0], gap, radius)
    flux = -radius / (2 * gap) * overlap[0]
    matrix = np.diag(depth * steep) - overlap.T @ ((inner * share)[:, None] * overlap)
    b = np.linalg.solve(matrix, flux - overlap.T @ (inner * share * particular))
    a = share * (overlap @ b - particular)
    bottom = (gap / 2 * radius**2 / 2 - radius**4 / (16 * gap)) + a[0] * radius**2 / 2
    alternating = (-1.0) ** np.arange(1, modes)
    bottom += (alternating * a[1:] * radius / n[1:, 0] * i1e(n[1:, 0] * radius) / i0e(n[1:, 0] * radius)).sum()
    force = 2 * math.pi * bottom
    return float(force.real), float(omega * force.imag)


def _wavenumbers(omega: float, depth: float, gravity: float, modes: int) -> np.ndarray:
    """Roots of omega^2 = -g k tan k h: i k of the travelling wave, then the real ones in their order."""
    from scipy.optimize import brentq

    ratio = omega**2 * depth / gravity
    real = [
        brentq(lambda x: x * math.sin(x) + ratio * math.cos(x), (m - 0.5) * math.pi, m * math.pi) / depth
        for m in range(1, modes)
    ]
    return np.array([1j * wavenumber(omega, depth, gravity), *real])


def _norm(k: np.ndarray, depth: float) -> np.ndarray:
    """Mean of cos^2 k z' over the depth, whose root Z_m is made with."""
    return 0.5 * (1 + np.sin(2 * k * depth) / (2 * k * depth))


def _overlap(n: np.ndarray, k: np.ndarray, gap: float) -> np.ndarray:
    """Integral of cos(n z') cos(k z') over the gap, n a multiple of pi / gap."""
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = np.cos(n * gap) * k * np.sin(k * gap) / (k**2 - n**2)
    return np.where(abs(k**2 - n**2) < 1e-12, gap / 2, plain)


def _particular(n: np.ndarray, gap: float, radius: float) -> np.ndarray:
    """Integral of (z'^2 - a^2 / 2) / (2 S) cos(n z') over the gap."""
    out = np.full(len(n), gap**2 / 6 - radius**2 / 4)
    out[1:] = np.cos(n[1:] * gap) / n[1:] ** 2
    return out
