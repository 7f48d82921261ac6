"""Linear theory of a bottom-hinged flap in a flume: potential flow on a lattice, in the frequency domain.

The flap is a box across a flume of constant depth, as wide as the flume (two dimensions) or narrower. It swings with unit
angular velocity, Re(exp(-i omega t)); the potential phi obeys laplace phi = 0, phi_z = omega^2 phi / g at the surface,
phi_n = V_n at the flap, and phi_x = i k phi where only the plane wave is left. Flap and flume are symmetric about the
flap's plane, so phi is antisymmetric in x: phi = 0 there beside, over and under the flap, and one half is solved. The
torque gives added inertia and damping, the wave that leaves gives the damping once more by its energy, and the torque of
incoming waves by the Haskind relation (Mei, Stiassnie & Yue 2005, sections 8.6 and 8.7).

It holds for flumes less than a wave length wide, where no other wave runs along than the plane one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cases.validation.theory.separation import group_speed
from fsi.waves import wavenumber

RHO, G = 1000.0, 9.81


@dataclass(frozen=True)
class Flap:
    """A flap [m]: heights are over still water, `hinge` that of hinge and lower edge; and its flume."""

    hinge: float
    top: float
    thick: float
    wide: float
    flume: float
    depth: float


@dataclass(frozen=True)
class Response:
    """Torque about the hinge: `added` inertia [kg m2], `damping` [N m s], and `excitation`, its amplitude in waves of unit
    amplitude [N]."""

    added: float
    damping: float
    excitation: float

    def pitch(self, omega: float, amplitude: float, inertia: float, stiffness: float, friction: float = 0.0) -> float:
        """Amplitude of the pitch [rad] in waves of this amplitude [m] and angular frequency [1/s]; the flap alone has the
        inertia [kg m2], weight and buoyancy the stiffness [N m], the hinge the friction [N m s]."""
        impedance = complex(stiffness - omega**2 * (inertia + self.added), omega * (self.damping + friction))
        return amplitude * self.excitation / abs(impedance)


def stiffness(flap: Flap, density: float) -> float:
    """Stiffness [N m] of buoyancy and weight of a flap of this density [kg/m3] about its upright place."""
    high, wet = flap.top - flap.hinge, min(flap.top, 0.0) - flap.hinge
    area = flap.thick * flap.wide
    waterplane = flap.thick**3 * flap.wide / 12 if flap.top > 0 else 0.0
    return G * (RHO * (area * wet**2 / 2 + waterplane) - density * area * high**2 / 2)


def inertia(flap: Flap, density: float) -> float:
    """Moment of inertia [kg m2] of the flap about its hinge."""
    high = flap.top - flap.hinge
    return density * flap.thick * flap.wide * high * (high**2 / 3 + flap.thick**2 / 12)


def respond(flap: Flap, omega: float, spacing: tuple[float, float, float], reach: float = 1.2) -> Response:
    """The response at an angular frequency [1/s]. The faces of the flap must lie on the lattice of this `spacing` in x, y and
    z [m]; the plane wave is taken to be alone `reach` [m] from the flap."""
    added, _, far = radiate(flap, omega, spacing, reach)
    flux = RHO * G * group_speed(wavenumber(omega, flap.depth, G), flap.depth, G) * flap.flume
    return Response(added, 2 * flux * far**2, 2 * flux * far)


def radiate(flap: Flap, omega: float, spacing: tuple[float, float, float], reach: float) -> tuple[float, float, float]:
    """Added inertia [kg m2] and damping [N m s] from the torque, and the amplitude [m s] of the wave on each side, of the
    flap that swings with unit angular velocity."""
    from scipy.sparse.linalg import splu

    lattice = _Lattice(flap, spacing, reach)
    k = wavenumber(omega, flap.depth, G)
    phi = splu(lattice.matrix(omega, k)).solve(-lattice.pushed.astype(complex))
    torque = -4j * omega * RHO * (phi * lattice.pushed).sum()  # of all four quarters
    last = phi[lattice.number[-1]].mean(0)  # over the flume's width
    shape = np.cosh(k * (lattice.z + flap.depth))
    far = omega / G * abs((last * shape).sum() / (shape**2).sum()) * math.cosh(k * flap.depth)
    return torque.imag / omega, -torque.real, far


class _Lattice:
    """Cells over a quarter of the flume, x > 0 and y > 0: `number` (nx, ny, nz) of those in the water, -1 in the flap, heights
    `z` (nz,) [m], and `pushed` (n,), the flux [m3] from the flap's faces into each."""

    def __init__(self, flap: Flap, spacing: tuple[float, float, float], reach: float):
        size = reach, flap.flume / 2, flap.depth
        self.shape = tuple(round(length / step) for length, step in zip(size, spacing, strict=True))
        x, y, z = (step * (np.arange(n) + 0.5) for n, step in zip(self.shape, spacing, strict=True))
        self.z, self.step = z - flap.depth, spacing
        self.area = spacing[1] * spacing[2], spacing[0] * spacing[2], spacing[0] * spacing[1]
        solid = (x < flap.thick / 2)[:, None, None] & (y < flap.wide / 2)[:, None]
        solid = solid & ((self.z > flap.hinge) & (self.z < flap.top))
        self.number = np.full(self.shape, -1)
        self.number[~solid] = np.arange((~solid).sum())
        self.count = self.number.max() + 1
        self.pushed = self._pushed(x, flap.hinge)

    def _pushed(self, x: np.ndarray, hinge: float) -> np.ndarray:
        rate = np.zeros(self.count)
        speed = np.broadcast_to(self.z - hinge, self.shape), None, np.broadcast_to(-x[:, None, None], self.shape)
        for axis in (0, 2):
            low, high = self._neighbours(axis)
            here = speed[axis][low]
            for water, solid, sign in ((low, high, -1), (high, low, 1)):
                face = (self.number[water] >= 0) & (self.number[solid] < 0)
                np.add.at(rate, self.number[water][face], sign * here[face] * self.area[axis])
        return rate

    def _neighbours(self, axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
        """Cells that have another one beyond them along the axis, and those others."""
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(0, -1), slice(1, None)
        return tuple(low), tuple(high)

    def matrix(self, omega: float, k: float):
        """The fluxes [m] out of each cell over its faces, as a sparse matrix on phi at the centres."""
        from scipy.sparse import coo_matrix, diags_array

        rows, columns, values = [], [], []
        diagonal = np.zeros(self.count, complex)
        for axis in range(3):
            low, high = self._neighbours(axis)
            first, second = self.number[low], self.number[high]
            both = (first >= 0) & (second >= 0)
            first, second, weight = first[both], second[both], self.area[axis] / self.step[axis]
            rows += [first, second]
            columns += [second, first]
            values += [np.full(2 * len(first), -weight)]
            np.add.at(diagonal, np.concatenate([first, second]), weight)
        for cells, axis, slope in (
            (self.number[0], 0, -2 / self.step[0]),  # phi = 0 on the plane of symmetry
            (self.number[-1], 0, 1j * k / (1 - 0.5j * k * self.step[0])),
            (self.number[:, :, -1], 2, omega**2 / (G - 0.5 * omega**2 * self.step[2])),
        ):
            wet = cells[cells >= 0]
            diagonal[wet] -= slope * self.area[axis]
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return (coo_matrix(entries, shape=(self.count, self.count)) + diags_array(diagonal)).tocsc()
