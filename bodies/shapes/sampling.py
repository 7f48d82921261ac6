"""Particles in layers under the surface of simple shapes: on lattices and on rings.

Every particle stands for spacing**dim of volume, and the outermost layer lies half a spacing below the surface.
"""

from __future__ import annotations

import math

import numpy as np

GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # turn from one ring to the next, so that rings do not line up [rad]


def line(length: float, spacing: float) -> np.ndarray:
    """Positions (n,) along a segment centred on 0, stretched so that the outermost lie half a spacing from its ends.
    A segment under 1.5 spacings carries one."""
    count = max(1, math.ceil(length / spacing - 0.5 - 1e-9))
    end = (length - spacing) / 2 if count > 1 else 0.0
    return np.linspace(-end, end, count)


def depths(reach: float, spacing: float, layers: int) -> np.ndarray:
    """Depths (k,) of the layers under a surface whose largest inscribed ball has the radius `reach`, outermost first.
    The innermost is moved to the centre rather than left out or crowded."""
    below = (np.arange(layers) + 0.5) * spacing
    below = below[below < reach + 0.25 * spacing]
    return np.minimum(below, reach) if below.size else np.array([reach])


def box(half: np.ndarray, spacing: float, layers: int) -> np.ndarray:
    """Outer layers (n, dim) of the lattice that fills a box with half sizes `half` (dim,)."""
    axes = [line(2 * h, spacing) for h in half]
    index = np.indices([axis.size for axis in axes])
    count = np.array([axis.size for axis in axes]).reshape(-1, *[1] * len(axes))
    outer = np.minimum(index, count - 1 - index).min(axis=0) < layers
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[outer]


def ring(radius: float, spacing: float, phase: float = 0.0) -> np.ndarray:
    """Even points (n, 2) on a circle."""
    count = max(1, round(2 * math.pi * radius / spacing))
    angle = phase + 2 * math.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def disc(radius: float, spacing: float, layers: int) -> np.ndarray:
    """Concentric rings (n, 2) under the edge of a disc."""
    return np.vstack([ring(radius - d, spacing) for d in depths(radius, spacing, layers)])


def cylinder(radius: float, half: float, spacing: float, layers: int) -> np.ndarray:
    """Concentric rings (n, 3) stacked along z, hollow inside the outer layers."""
    heights = line(2 * half, spacing)
    end = np.minimum(np.arange(heights.size), heights.size - 1 - np.arange(heights.size))
    parts = []
    for layer, depth in enumerate(depths(radius, spacing, math.ceil(radius / spacing) + 1)):
        stack = heights if layer < layers else heights[end < layers]
        circle = ring(radius - depth, spacing, layer * GOLDEN)
        parts.append(np.column_stack([np.tile(circle, (stack.size, 1)), np.repeat(stack, len(circle))]))
    return np.vstack(parts)


def capsule(radius: float, half: float, spacing: float, layers: int) -> np.ndarray:
    """Shells (n, 3) under the surface of a cylinder along z with round ends; a sphere where half = 0."""
    parts = []
    for depth in depths(radius, spacing, layers):
        shell = radius - depth
        arc = math.pi * shell / 2
        meridian = 2 * (arc + half)
        count = max(1, round(meridian / spacing))
        along = (np.arange(count) + 0.5) * meridian / count - meridian / 2
        beyond = np.clip(np.abs(along) - half, 0.0, None)
        turn = beyond / shell if shell > 0 else np.zeros(count)
        height = np.sign(along) * (np.minimum(np.abs(along), half) + shell * np.sin(turn))
        for i, (z, rho) in enumerate(zip(height, shell * np.cos(turn), strict=True)):
            circle = ring(rho, spacing, i * GOLDEN)
            parts.append(np.column_stack([circle, np.full(len(circle), z)]))
    return np.vstack(parts)
