"""Triangle meshes of simple shapes about the origin, to draw them and to cut them."""

from __future__ import annotations

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]  # vertices (n, 3) [m], triangles (m, 3) that face outwards
ROUND, ARCS = 96, 48  # corners of a circle, and of the half circle of a ball


def box(half: np.ndarray) -> Mesh:
    """A box with half sizes `half` (3,)."""
    vertices = (np.indices([2, 2, 2]).reshape(3, -1).T * 2 - 1) * half
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return vertices, np.array([[a, b, c] for a, b, c, d in sides] + [[a, c, d] for a, b, c, d in sides])


def cylinder(radius: float, half: float) -> Mesh:
    """A cylinder along z of length 2 half."""
    return turned(np.array([0.0, radius, radius, 0.0]), np.array([-half, -half, half, half]), ROUND)


def capsule(radius: float, half: float) -> Mesh:
    """A cylinder along z of length 2 half with round ends."""
    angle = np.linspace(0.0, np.pi / 2, ARCS // 2 + 1)
    rim, height = radius * np.cos(angle), radius * np.sin(angle) + half
    return turned(np.concatenate([rim[::-1], rim]), np.concatenate([-height[::-1], height]), ARCS)


def ball(radius: float) -> Mesh:
    angle = np.linspace(-np.pi / 2, np.pi / 2, ARCS + 1)
    return turned(radius * np.cos(angle), radius * np.sin(angle), ROUND)


def turned(rim: np.ndarray, height: np.ndarray, sections: int) -> Mesh:
    """What a line from pole to pole, at radii `rim` (k,) and heights (k,), leaves when it turns about z in so many sections."""
    turn, between = 2 * np.pi * np.arange(sections) / sections, slice(1, -1)
    around = [np.outer(np.cos(turn), rim[between]), np.outer(np.sin(turn), rim[between])]
    around.append(np.tile(height[between], (sections, 1)))
    rings = len(rim) - 2
    low, high = rings * sections, rings * sections + 1
    vertices = np.concatenate([np.stack(around, axis=-1).reshape(-1, 3), [[0, 0, height[0]], [0, 0, height[-1]]]])
    number = np.arange(rings * sections).reshape(sections, rings)
    after = np.roll(number, -1, axis=0)
    a, b, c, d = (part.ravel() for part in (number[:, :-1], after[:, :-1], after[:, 1:], number[:, 1:]))
    bands = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    caps = [np.column_stack([np.full(sections, low), after[:, 0], number[:, 0]])]
    caps.append(np.column_stack([np.full(sections, high), number[:, -1], after[:, -1]]))
    return vertices, np.concatenate([bands, *caps])
