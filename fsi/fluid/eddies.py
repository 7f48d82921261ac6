"""Smagorinsky's eddies with a coefficient that the flow itself gives (`fsi.sph.eddies`)."""

from __future__ import annotations

import numpy as np

from fsi.scene.model import Scene
from fsi.sph import eddies


class DynamicEddies:
    """Owns `strains`, the strain rates that the shear pass leaves (rows, .), the means of velocity and strain rate, and
    `coefficient` (n,), C_s^2 of the particles in their present order."""

    def __init__(self, scene: Scene, lanes: int, dtype, team):
        self._dim, self._team, self._dtype = scene.dimension, team, dtype
        self._width2 = scene.spacing**2
        self._density = np.array([liquid.density for liquid in scene.all_liquids])
        self._mean = eddies.make_means(lanes, scene.dimension)
        self._leonard = eddies.make_leonard(lanes, scene.dimension)
        self._coefficient = eddies.make_coefficient(lanes, scene.dimension)
        self.strains = self._means = self._products = np.empty((0, 1), dtype)
        self.coefficient = np.empty(0)

    def reserve(self, rows: int) -> np.ndarray:
        """Room for the strain rates of so many rows."""
        if len(self.strains) < rows:
            self.strains = np.zeros((rows, eddies.strain(self._dim).width("rate")), self._dtype)
            self._means = np.zeros((rows, eddies.strain(self._dim).width("u")), self._dtype)
            self._products = np.zeros((rows, eddies.PRODUCTS.width("model")), self._dtype)
        return self.strains

    def add(self, near, flow, kind, k, halo) -> None:
        """Add the viscosity [Pa s] of the eddies to that of the fluid's rows in `flow`; `kind` (n,): the liquid of each."""
        self.coefficient = np.empty(len(kind))
        halo.refresh(self.strains, slice(None))
        width2 = self._dtype(self._width2)
        self._team.run(self._mean, near.bounds, near.groups, flow, self.strains, self._means, k)
        halo.refresh(self._means, slice(None))
        self._team.run(self._leonard, near.bounds, near.groups, flow, self._means, self._products, width2, k)
        halo.refresh(self._products, slice(None))
        self._team.run(
            self._coefficient, near.bounds, near.groups, flow, self.strains, self._products, self.coefficient, kind,
            self._density, width2, k,
        )  # fmt: skip

    def viscosity(self, rate: np.ndarray) -> np.ndarray:
        """Of the eddies [m2/s], at the shear rates (n,) [1/s] of the same particles."""
        return self.coefficient * self._width2 * rate

    @property
    def nbytes(self) -> int:
        return self.strains.nbytes + self._means.nbytes + self._products.nbytes + self.coefficient.nbytes
