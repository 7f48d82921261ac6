"""Scenes of the trials of identity, as texts of files, and what tells two of their runs apart."""

from __future__ import annotations

import numpy as np

CHANNEL = """
spacing = 0.05
duration = 5.0
gravity = 0.0
[tank]
min = [0.0, 0.0]
max = [1.0, 0.5]
walls = ["z-", "z+"]
periodic = ["x"]
[fluid]
still_water_level = 0.5
acceleration = [0.1, 0.0]
kinematic_viscosity = 1e-3
[probes.middle]
position = [0.5, 0.25]
"""
LAYERS = """
spacing = 0.02
duration = 0.4
[tank]
min = [0.0, -0.4]
max = [0.8, 0.2]
[fluid]
kinematic_viscosity = 1e-4
[liquids.brine]
density = 1200.0
kinematic_viscosity = 2e-3
[[liquids.brine.blocks]]
min = [0.0, -0.4]
max = [0.4, -0.1]
[gauges.middle]
x = 0.4
"""
SEA = """
spacing = 0.04
duration = 3.0
[tank]
min = [0.0, -0.6]
max = [5.0, 0.4]
[waves]
kind = "irregular"
Hm0 = 0.08
peak_period = 1.6
absorb = true
[[damping]]
start = 4.0
end = 5.0
[gauges.front]
x = 2.0
"""


def differences(one, two) -> list[str]:
    """Names of the series that are not the same bit for bit."""
    names = sorted(set(one.data_vars) | set(two.data_vars))
    found = [n for n in names if n not in one or n not in two or not _same(one[n].values, two[n].values)]
    return found if np.array_equal(one["time"], two["time"]) else ["time", *found]


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
