"""The closed shells of a triangle mesh: what they enclose, which lie in one another, and where they cross.

Inside is what a shell winds around (Jacobson et al. 2013, doi:10.1145/2461912.2461916), so that shells which overlap are one
solid; parity would make water of what they share.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from bodies.shapes import tree

NEAR = 1e-5  # of a triangle's size: crossings less deep are rounding
PROBES = 64  # points of a shell that are looked up in another


@dataclass
class Shells:
    """`parts`: triangles (m, 3), facing outwards, of the shells that bound the solid; `hollow`: the same, each with the shells
    of cavities in it and of what is in those; `cavity`: volume that shells within them enclose [m3], which no fluid reaches;
    `overlap`: a place where parts share volume, `crossing`: one where a shell runs through itself; `twice`: volume that parts
    within parts count again [m3]."""

    parts: list[np.ndarray] = field(default_factory=list)
    hollow: list[np.ndarray] = field(default_factory=list)
    cavity: float = 0.0
    twice: float = 0.0
    mixed: bool = False
    overlap: np.ndarray | None = None
    crossing: np.ndarray | None = None

    @property
    def outside(self) -> np.ndarray:
        """All parts as one (m, 3)."""
        return np.concatenate(self.parts)


def shells(vertices: np.ndarray, triangles: np.ndarray) -> Shells:
    """The shells of a closed mesh, vertices (n, 3) and triangles (m, 3) that all run the same way round."""
    index = merged(vertices)[triangles]
    label = _components(index, index.max() + 1)
    corners = np.ascontiguousarray(vertices[triangles], dtype=float)
    found = Shells()
    crossings = tree.crossings(corners, index, NEAR)
    own = label[crossings[:, 0]] == label[crossings[:, 1]]
    if own.any():
        found.crossing = corners[crossings[own][0]].mean(axis=(0, 1))
    members = [np.flatnonzero(label == k) for k in range(label.max() + 1)]
    volume = np.array([_volume(corners[m]) for m in members])
    pairs = {tuple(sorted(pair)) for pair in label[crossings[~own]].tolist()}
    if pairs:
        found.overlap = corners[crossings[~own][0]].mean(axis=(0, 1))
    within = _nesting(corners, members, pairs, found)
    top = [k for k in range(len(members)) if not within[k]]
    sign = np.sign(volume)
    found.mixed = len(set(sign[top])) > 1
    inner: dict[int, list[int]] = {k: [] for k in top}
    for k in range(len(members)):
        if within[k] and sign[k] == sign[within[k][0]] and len(within[k]) == 1:
            found.twice += abs(volume[k])
            continue
        if len(within[k]) == 1:
            found.cavity += abs(volume[k])
        for outer in within[k]:
            inner.get(outer, []).append(k)
    for k in top:
        way = slice(None, None, 1 if sign[k] >= 0 else -1)
        found.parts.append(triangles[members[k]][:, way])
        found.hollow.append(np.concatenate([triangles[members[j]][:, way] for j in (k, *inner[k])]))
    return found


def merged(vertices: np.ndarray) -> np.ndarray:
    """A number (n,) for each of the vertices (n, 3), the same for those at one place."""
    order = np.lexsort(vertices.T)
    new = np.any(np.diff(vertices[order], axis=0) != 0.0, axis=1)
    number = np.empty(len(vertices), np.int64)
    number[order] = np.concatenate([[0], np.cumsum(new)])
    return number


def _volume(corners: np.ndarray) -> float:
    origin = corners[0, 0]
    a, b, c = (corners[:, k] - origin for k in range(3))
    return float(np.einsum("tk,tk->", a, np.cross(b, c)) / 6)


def _nesting(corners: np.ndarray, members: list[np.ndarray], crossing: set, found: Shells) -> list[list[int]]:
    """For each shell those that it lies in, by the winding of the others around points of it; `found` gains an overlap where
    some of the points are inside and some outside."""
    low = np.array([corners[m].min(axis=(0, 1)) for m in members])
    high = np.array([corners[m].max(axis=(0, 1)) for m in members])
    within: list[list[int]] = [[] for _ in members]
    for k, own in enumerate(members):
        meets = np.all((low <= high[k]) & (high >= low[k]), axis=1)
        for other in np.flatnonzero(meets):
            if other == k or tuple(sorted((k, int(other)))) in crossing:
                continue
            probes = _probes(corners[own])
            winding = np.abs(tree.winding(probes, corners[members[other]]))
            inside, outside = np.abs(winding - 1.0) < 0.1, winding < 0.1  # on the surface it is about a half
            if inside.any() and outside.any():
                found.overlap = probes[np.flatnonzero(inside)[0]]
            elif inside.any():
                within[k].append(int(other))
    return within


def _probes(corners: np.ndarray) -> np.ndarray:
    """Some middles and corners of triangles (m, 3, 3)."""
    points = np.concatenate([corners.mean(axis=1), corners[:, 0]])
    return points[:: max(1, len(points) // PROBES)]


@njit(cache=True)
def _components(index, count):
    """Number of the connected component (m,) of each triangle (m, 3) of merged vertices, in order of first appearance."""
    parent = np.arange(count)
    for t in range(len(index)):
        for k in range(2):
            a, b = _root(parent, index[t, k]), _root(parent, index[t, k + 1])
            parent[max(a, b)] = min(a, b)
    number, label, following = np.full(count, -1), np.empty(len(index), np.int64), 0
    for t in range(len(index)):
        a = _root(parent, index[t, 0])
        if number[a] < 0:
            number[a] = following
            following += 1
        label[t] = number[a]
    return label


@njit(cache=True)
def _root(parent, a):
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    return a
