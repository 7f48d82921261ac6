"""Liquids whose pairs of particles have the viscosity of their own shear rate (`fsi.sph.pair_laws`)."""

from __future__ import annotations

import numpy as np

from fsi.sph import columns
from fsi.sph.pair_laws import make_pair_laws


class PairLaws:
    """Owns `known` (rows, .), what the shear pass leaves of each particle, and `weights`, of each pair in the lists of the
    step: viscosity times the weight of the discrete Laplacian."""

    def __init__(self, dim: int, no_slip: bool, lanes: int, dtype, team):
        self._lanes, self._dtype, self._team = lanes, dtype, team
        self._columns, self._kernel = columns.pair_law(dim), make_pair_laws(lanes, dim, no_slip)
        self.known, self.weights = np.empty((0, 1), dtype), np.empty(0, dtype)

    def reserve(self, rows: int) -> np.ndarray:
        """`known`, with room for so many rows."""
        if len(self.known) < rows:
            self.known = np.zeros((rows, self._columns.width("kind")), self._dtype)
        return self.known

    def weigh(self, near, flow, laws: np.ndarray, k, halo) -> None:
        """The weights of the pairs at the velocities in `flow`, whose fluid rows get the viscosity that they show to walls."""
        halo.refresh(self.known, slice(None))
        entries = near.groups[-1].size * self._lanes
        if len(self.weights) != entries:
            self.weights = np.empty(0, self._dtype)  # before the new one is made
            self.weights = np.empty(entries, self._dtype)
        self._team.run(self._kernel, near.bounds, near.groups, flow, self.known, laws, self.weights, k)

    def viscosity(self, n: int) -> np.ndarray:
        """[Pa s] (n,) at the shear rate of each particle, in the order of the last step."""
        return self.known[:n, self._columns.mu]

    @property
    def nbytes(self) -> int:
        return self.known.nbytes + self.weights.nbytes
