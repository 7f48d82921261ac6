"""Shapes with an analytic distance, and the solids that place, trim and check them.

A shape lives in its own frame, in two or three dimensions; a `Placed` shape is a `fsi.protocols.Solid` of the tank.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np

from bodies.shapes import sampling
from fsi.protocols import Solid


def beyond(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, dim) from the box between two corners (dim,) [m], 0 inside."""
    return np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)


class Shape(Protocol):
    """A solid in its own frame."""

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        """Boundary particles (n, dim), as `Solid.boundary`."""

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (n,) of points (n, dim), negative inside."""

    def support(self, direction: np.ndarray) -> float:
        """How far the solid reaches along a unit vector (dim,) [m]."""

    def thickness(self, spacing: float) -> float:
        """Diameter of the largest ball that fits inside [m], to a fraction of the spacing."""


@dataclass(frozen=True)
class Box:
    """A rectangle or box with half sizes `half` (dim,) about the origin."""

    half: np.ndarray

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        return sampling.box(self.half, spacing, layers)

    def distance(self, points: np.ndarray) -> np.ndarray:
        beyond = np.abs(points) - self.half
        return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)

    def support(self, direction: np.ndarray) -> float:
        return float(np.abs(direction) @ self.half)

    def thickness(self, spacing: float) -> float:
        return 2 * float(np.min(self.half))


@dataclass(frozen=True)
class Disc:
    """A circle about the origin, in two dimensions."""

    radius: float

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        return sampling.disc(self.radius, spacing, layers)

    def distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - self.radius

    def support(self, direction: np.ndarray) -> float:
        return self.radius

    def thickness(self, spacing: float) -> float:
        return 2 * self.radius


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z of length 2 half."""

    radius: float
    half: float

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        return sampling.cylinder(self.radius, self.half, spacing, layers)

    def distance(self, points: np.ndarray) -> np.ndarray:
        rho = np.hypot(points[:, 0], points[:, 1])
        return Box(np.array([self.radius, self.half])).distance(np.column_stack([rho, points[:, 2]]))

    def support(self, direction: np.ndarray) -> float:
        return float(self.radius * np.hypot(direction[0], direction[1]) + self.half * abs(direction[2]))

    def thickness(self, spacing: float) -> float:
        return 2 * min(self.radius, self.half)


@dataclass(frozen=True)
class Capsule:
    """A cylinder along z of length 2 half with round ends; a sphere where half = 0."""

    radius: float
    half: float = 0.0

    def sample(self, spacing: float, layers: int) -> np.ndarray:
        return sampling.capsule(self.radius, self.half, spacing, layers)

    def distance(self, points: np.ndarray) -> np.ndarray:
        height = points[:, 2] - np.clip(points[:, 2], -self.half, self.half)
        return np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + height**2) - self.radius

    def support(self, direction: np.ndarray) -> float:
        return float(self.radius + self.half * abs(direction[2]))

    def thickness(self, spacing: float) -> float:
        return 2 * self.radius


class Placed:
    """A shape in the tank: world = origin (dim,) + axes (dim, dim) @ local.
    Particles inside `others`, earlier solids of the same owner, are left out."""

    def __init__(self, shape: Shape, origin: np.ndarray, axes: np.ndarray):
        self.shape, self._origin, self._axes = shape, origin, axes
        self.name = ""  # of its geom
        self.notes: tuple[str, ...] = ()  # on what was asked for and has no effect
        self.others: tuple[Solid, ...] = ()
        self.sampled = cache(self._sample)  # (spacing, layers) -> particles (n, dim) before any is left out
        self._trimmed = cache(self._trim)

    def boundary(self, spacing: float, layers: int) -> np.ndarray:
        """Boundary particles (n, dim) inside the solid, the outermost layer half a spacing below its surface."""
        return self._trimmed(spacing, layers).copy()

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (n,) of points (n, dim) to the surface, negative inside."""
        return self.shape.distance((points - self._origin) @ self._axes)

    @property
    def foot(self) -> Callable[[np.ndarray], np.ndarray] | None:
        """The closest places (n, dim) on the surface to points (n, dim), where the shape knows them without a search."""
        if not hasattr(self.shape, "foot"):
            return None
        return lambda points: self._origin + self.shape.foot((points - self._origin) @ self._axes) @ self._axes.T

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner (dim,) of the box around the solid [m]."""
        low = [-self.shape.support(-axis) for axis in self._axes]
        high = [self.shape.support(axis) for axis in self._axes]
        return self._origin + low, self._origin + high

    def _sample(self, spacing: float, layers: int) -> np.ndarray:
        return self._origin + self.shape.sample(spacing, layers) @ self._axes.T

    def _trim(self, spacing: float, layers: int) -> np.ndarray:
        points = self.sampled(spacing, layers)
        for other in self.others:
            points = points[other.clearance(points) > 0.0]
        return points


class Together:
    """Solids that overlap as one `fsi.protocols.Solid`."""

    def __init__(self, parts: list[Placed]):
        self.parts = parts
        for number, part in enumerate(parts):
            part.others = tuple(parts[:number])

    def boundary(self, spacing: float, layers: int) -> np.ndarray:
        return np.concatenate([part.boundary(spacing, layers) for part in self.parts])

    def clearance(self, points: np.ndarray) -> np.ndarray:
        clear = self.parts[0].clearance(points)
        for part in self.parts[1:]:  # asked only for points whose distance to its box is less than what is found
            near = beyond(points, *part.bounds()) <= np.maximum(clear, 0.0)
            clear[near] = np.minimum(clear[near], part.clearance(points[near]))
        return clear
