"""The numerics of a scene, `[numerics]`, and the defaults that depend on what the rest of it is.

Every figure's reason is in docs/theory/numerics.md.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fsi.parts import NonNegative, Part, Positive

LASTING = ("regular", "nonlinear", "irregular", "spectrum", "measured", "focused")  # kinds of waves that go on and on
ACCURACY = {  # defaults that differ from those of `normal`
    "draft": {"smoothing_ratio": 1.5, "mach": 0.3},
    "fine": {
        "mach": 0.1,
        "courant": 0.1,
        "artificial_viscosity": 0.025,
    },  # which acts by the speed of sound, twice as high
}


SOLVER = {  # defaults of a solver that differ from those of the others
    "iisph": {
        "smoothing_ratio": 1.0,
        "kernel": "cubic_spline",
        "courant": 0.8,  # 0.4 of the support
        "viscosity": "none",
        "artificial_viscosity": 0.1,  # of half the smoothing length
        "velocity_reconstruction": "none",
    },
}


class Numerics(Part):
    """The scheme. `accuracy` chooses the defaults of what it trades for time; a key that is given holds."""

    accuracy: Literal["draft", "normal", "fine"] = "normal"
    smoothing_ratio: Annotated[float, Field(ge=1.0, le=2.0)] = (
        2.0  # smoothing length / spacing; 1.2 or more but for `iisph`
    )
    kernel: Literal["wendland", "cubic_spline"] = "wendland"  # the second one for `iisph` alone
    solver: Literal["explicit", "chebyshev", "converged", "iisph"] = (
        "chebyshev"  # sweeps: Jacobi's, Chebyshev's, all; implicit
    )
    sweeps: Annotated[int, Field(ge=1, le=64)] = 6  # of the pressure per step; for `converged` they set the step alone
    pressure_tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-5  # of `converged`: last change over the largest value
    density_tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-3  # xi of `iisph`: mean density in excess, as a share
    lambda_max: Annotated[float, Field(gt=0, le=2)] = (
        0.075  # of `iisph`: time step over sqrt(support / gravity) at most
    )
    wall_friction: NonNegative = 0.0  # sigma of `iisph`: Monaghan's alpha, of walls (Akinci et al. 2012)
    precision: Literal["single", "double"] = "single"  # inside sweeps; the state is always double
    viscosity: Literal["laminar", "none"] = "laminar"
    wall_slip: Literal["no_slip", "free_slip"] = "no_slip"  # of walls and bodies, for laminar viscosity
    viscous_step: Literal["auto", "explicit", "implicit"] = "auto"  # auto: implicit where explicit would take over
    turbulence: Literal["none", "smagorinsky", "dynamic"] = (
        "none"  # eddies smaller than the spacing; dynamic: C_s of the flow
    )
    smagorinsky: Annotated[float, Field(gt=0, le=0.5)] = 0.12  # C_s
    artificial_viscosity: NonNegative = 0.05  # Monaghan's alpha
    velocity_reconstruction: Literal["linear", "none"] = (
        "linear"  # of how fast a pair approaches, the artificial viscosity acts on what a linear velocity leaves, or on all
    )
    density_relaxation: NonNegative | None = (
        None  # gamma; None: what damps the depth's slowest mode in a step; of `iisph` 0.1, with bodies 1 as its source
    )
    standing_pressure: Literal["apart", "paired"] = (
        "paired"  # hydrostatic pressure: its exact gradient, or summed over pairs as the rest
    )
    shifting: Annotated[float, Field(ge=0, le=0.7)] | None = (
        None  # beta of the shift -beta h^2 grad C in each step (Lind et al. 2012); None: 0.5 without free surface
    )
    wall_guard: Annotated[float, Field(ge=0, lt=1)] = (
        0.7  # distance [spacing] to a wall particle that a fluid particle keeps; 0 is off
    )
    mach: Annotated[float, Field(gt=0, le=1)] = 0.2  # sqrt(g depth) over the numerical sound speed
    courant: Annotated[float, Field(gt=0, le=1)] = 0.2  # max speed * time step / smoothing length
    max_time_step: Positive | None = None  # [s]
    fixed_time_step: Positive | None = None  # [s]; switches the adaptive step off

    @model_validator(mode="before")
    @classmethod
    def _defaults(cls, values):
        return presets(values.get("accuracy"), values.get("solver")) | values if isinstance(values, dict) else values


def presets(accuracy: object, solver: object) -> dict:
    """Defaults that an accuracy and a solver change; those of the solver hold."""
    found = ACCURACY.get(accuracy, {}) if isinstance(accuracy, str) else {}
    return found | (SOLVER.get(solver, {}) if isinstance(solver, str) else {})


def _written(part: object) -> dict:
    """The keys that are set of a part of a scene, as a table or made."""
    return part.model_dump(exclude_unset=True) if isinstance(part, Part) else part if isinstance(part, dict) else {}


def wave_numerics(values: object) -> dict:
    """The numerics of a scene, as it is written, with the defaults that keep its waves; empty where they are those of all
    scenes. Longer steps keep more of waves, where they need not be short for another reason; on their way along a flume
    they keep more, at fine spacings, without artificial viscosity (docs/guide/waves.md)."""
    if not isinstance(values, dict):
        return {}
    given, waves, tank, fluid = (_written(values.get(key)) for key in ("numerics", "waves", "tank", "fluid"))
    kind = waves.get("kind", "regular") if waves else ""
    rough = bool(values.get("bodies") or values.get("liquids") or tank.get("bathymetry"))
    waved = values.get("sea") or (kind in LASTING and not rough and not fluid.get("blocks"))
    if not waved or given.get("solver") == "iisph":
        return {}
    short = rough or waves.get("absorb")  # pressure has to reach bodies and absorbing pistons in time
    step = {} if short or given.get("accuracy", "normal") != "normal" else {"mach": 0.3}
    return ({} if values.get("sea") else {"artificial_viscosity": 0.0}) | step | given
