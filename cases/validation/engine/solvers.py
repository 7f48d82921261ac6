"""The solver variants that are compared: name -> what they change in the scene's `[numerics]`; a value that depends on the
scene is a function of it."""

from __future__ import annotations

from fsi.fluid.constants import density_relaxation
from fsi.scene.geometry import fluid_height


def _relaxed(factor: float):
    return lambda scene: factor * density_relaxation(scene, fluid_height(scene))


DEFAULT = "chebyshev6"
SOLVERS: dict[str, dict] = {
    "explicit": {"solver": "explicit", "sweeps": 1},
    "explicit4": {"solver": "explicit", "sweeps": 4},
    "chebyshev4": {"solver": "chebyshev", "sweeps": 4},
    "chebyshev6": {"solver": "chebyshev", "sweeps": 6},
    "chebyshev8": {"solver": "chebyshev", "sweeps": 8},
    "converged": {"solver": "converged"},
    "draft": {"accuracy": "draft"},
    "fine": {"accuracy": "fine"},
    "double_step": {"mach": 0.4, "courant": 0.4},
    "narrow": {"smoothing_ratio": 1.5},
    "no_relaxation": {"density_relaxation": 0.0},
    "relaxation10": {"density_relaxation": _relaxed(10.0)},
    "shifting": {"shifting": 0.2},
    "iisph": {"solver": "iisph"},
    "unreconstructed": {"velocity_reconstruction": "none"},
    "apart": {"standing_pressure": "apart"},
}
