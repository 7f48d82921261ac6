"""Particles that have left the tank through its walls."""

from __future__ import annotations

import math

import numpy as np

from fsi.simulation.loop import Simulation


class Leaks:
    """`share(sim)`: of the particles, those that are lost or whose centre lies beyond a walled side of the tank."""

    def __init__(self, sim: Simulation):
        tank = sim.scene.tank
        axes = tank.axes
        self._low = np.array([a if f"{n}-" in tank.walls else -math.inf for n, a in zip(axes, tank.min, strict=True)])
        self._high = np.array([b if f"{n}+" in tank.walls else math.inf for n, b in zip(axes, tank.max, strict=True)])

    def share(self, sim: Simulation) -> float:
        fluid = sim.fluid
        outside = ((fluid.position < self._low) | (fluid.position > self._high)).any(1).sum()
        return float(fluid.lost + outside) / (fluid.count + fluid.lost)
