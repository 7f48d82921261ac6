"""The solver variants that are compared: name -> what they change in the scene's `[numerics]`."""

from __future__ import annotations

DEFAULT = "chebyshev6"
SOLVERS: dict[str, dict] = {
    "explicit": {"solver": "explicit", "sweeps": 1},
    "explicit4": {"solver": "explicit", "sweeps": 4},
    "chebyshev4": {"solver": "chebyshev", "sweeps": 4},
    "chebyshev6": {"solver": "chebyshev", "sweeps": 6},
    "chebyshev8": {"solver": "chebyshev", "sweeps": 8},
    "half_step": {"mach": 0.1, "courant": 0.1},
    "shifting": {"shifting": 6.0},
}
