"""The acceleration of all fluid by gravity and other body forces."""

from __future__ import annotations

import numpy as np

from fsi.compute.reduce import Reductions
from fsi.scene.model import Scene


class BodyForce:
    """Owns the acceleration g (dim,) [m/s2], the same everywhere, and its gradient (dim, dim) [1/s2], None without one: the
    fluid at x is accelerated by g + gradient x."""

    def __init__(self, scene: Scene):
        self.uniform = np.array(scene.fluid.acceleration or (0.0,) * scene.dimension, float)
        self.uniform[-1] -= scene.gravity
        gradient = scene.fluid.acceleration_gradient
        self.gradient = None if gradient is None else np.array(gradient, float)

    def kick(self, velocity: np.ndarray, position: np.ndarray, dt: float) -> None:
        """Add what the gradient does in a step of dt [s] to velocities (n, dim); the predictor adds the rest."""
        if self.gradient is not None:
            velocity += dt * position @ self.gradient.T

    def total(self, r: np.ndarray, position: np.ndarray, reductions: Reductions) -> np.ndarray:
        """Sum (dim,) [m/s2] over particles at `position` (n, dim) of r (n,) times their acceleration."""
        total = reductions.total(r) * self.uniform
        return total if self.gradient is None else total + self.gradient @ reductions.weighted(r, position)
