"""The solver variants that are compared: name -> what they change in the scene's `[numerics]`."""

from __future__ import annotations

DEFAULT = "sweeps4"
SOLVERS: dict[str, dict] = {
    "explicit": {"sweeps": 1},
    "sweeps4": {"sweeps": 4},
    "sweeps8": {"sweeps": 8},
    "half_step": {"mach": 0.1, "courant": 0.1},
    "shifting": {"shifting": 6.0},
}
