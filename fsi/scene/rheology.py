"""Liquids whose viscosity depends on the shear rate s: the laws, and what they tell the solver.

Each law is a part of the scene with `rest_viscosity`, `mu_inf` and `constants`, the row of figures that
`fsi.sph.viscosity.apparent_viscosity` reads.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fsi.parts import NonNegative, Part, Positive
from fsi.sph.laws import CROSS, GRANULAR, HERSCHEL_BULKLEY


class Cross(Part):
    """Viscosity that falls with the shear rate s (Cross 1965): mu = mu_inf + (mu_0 - mu_inf) / (1 + K s).

    Give K, or a yield stress tau for a Bingham plastic with K = mu_0 / tau; mu_0 is then how stiff it is below it."""

    law: Literal["cross"] = "cross"
    mu_inf: NonNegative  # at large shear rates [Pa s]
    mu_0: Positive | None = None  # at rest [Pa s]; 1000 mu_inf if not given
    yield_stress: Positive | None = None  # tau [Pa]
    cross_time: Positive | None = None  # K [s]

    @model_validator(mode="after")
    def _complete(self):
        if (self.yield_stress is None) == (self.cross_time is None):
            raise ValueError("needs either yield_stress or cross_time; give one of the two")
        if self.rest_viscosity <= self.mu_inf:
            raise ValueError(f"mu_0 must lie above mu_inf {self.mu_inf:g} Pa s; raise mu_0")
        return self

    @property
    def rest_viscosity(self) -> float:
        """mu_0 [Pa s]."""
        return 1000 * self.mu_inf if self.mu_0 is None else self.mu_0

    @property
    def time(self) -> float:
        """K [s]."""
        return self.rest_viscosity / self.yield_stress if self.cross_time is None else self.cross_time

    @property
    def constants(self) -> tuple[float, ...]:
        """Law, K, and nothing else."""
        return CROSS, self.time, 0.0, 0.0, 0.0


class HerschelBulkley(Part):
    """Stress tau + k s^n (Herschel & Bulkley 1926), regularised at rest (Papanastasiou 1987, eq. 8):
    mu = k s^(n - 1) + tau (1 - exp(-m s)) / s, at most mu_0."""

    law: Literal["herschel_bulkley"]
    consistency: Positive  # k [Pa s^n]
    exponent: Annotated[float, Field(ge=0.1, le=2.0)] = 1.0  # n; below 1 it thins with the shear rate
    yield_stress: NonNegative = 0.0  # tau [Pa]
    mu_0: Positive  # largest viscosity [Pa s]; the liquid creeps with it below its yield stress
    regularisation: Positive | None = None  # m [s]; mu_0 / yield_stress if not given

    mu_inf: ClassVar[float] = 0.0  # it thins without end

    @model_validator(mode="after")
    def _complete(self):
        if self.exponent == 1 and self.mu_0 <= self.consistency:
            raise ValueError(f"mu_0 must lie above the consistency {self.consistency:g} Pa s; raise mu_0")
        return self

    @property
    def rest_viscosity(self) -> float:
        """mu_0 [Pa s]."""
        return self.mu_0

    @property
    def constants(self) -> tuple[float, ...]:
        """Law, k, n, tau, m."""
        steep = self.mu_0 / max(self.yield_stress, 1e-12 * self.mu_0)
        return HERSCHEL_BULKLEY, self.consistency, self.exponent, self.yield_stress, self.regularisation or steep


class Granular(Part):
    """Dense flow of grains, the mu(I) law (Jop, Forterre & Pouliquen 2006, eq. 1 and 2): the stress is mu(I) p, with
    mu = mu_s + (mu_2 - mu_s) / (1 + I_0 / I) and I = s d sqrt(rho_s / p), the viscosity mu p / s at most mu_0.

    The confining pressure p is the weight of the grains above, less that of the liquid in the pores."""

    law: Literal["granular"]
    friction: Positive  # mu_s, tangent of the angle at which it comes to rest
    friction_fast: Positive  # mu_2, of fast flow
    inertial_number: Positive = 0.3  # I_0
    grain_diameter: Positive  # d [m]
    grain_density: Positive = 2500.0  # rho_s [kg/m3]
    pore_density: NonNegative | None = None  # of what fills the pores [kg/m3]; the fluid's for other liquids, 0 for it
    mu_0: Positive  # largest viscosity [Pa s]

    mu_inf: ClassVar[float] = 0.0

    @model_validator(mode="after")
    def _complete(self):
        if self.friction_fast < self.friction:
            raise ValueError(f"friction_fast lies below friction {self.friction:g}; raise it")
        return self

    @property
    def rest_viscosity(self) -> float:
        """mu_0 [Pa s]."""
        return self.mu_0

    @property
    def constants(self) -> tuple[float, ...]:
        """Law, mu_s, mu_2, s / sqrt(p) at I = I_0, and nothing else."""
        rate = self.inertial_number / (self.grain_diameter * self.grain_density**0.5)
        return GRANULAR, self.friction, self.friction_fast, rate, 0.0


def _law(rheology) -> str | None:
    return rheology.get("law", "cross") if isinstance(rheology, dict) else getattr(rheology, "law", None)


Rheology = Annotated[
    Annotated[Cross, Tag("cross")]
    | Annotated[HerschelBulkley, Tag("herschel_bulkley")]
    | Annotated[Granular, Tag("granular")],
    Discriminator(_law),
]
