"""Bodies whose wet surface is round about an axis or a point: the pressure of the fluid, at right angles to the surface, has no
moment about it, and their spin about it does not stir the fluid but for viscosity.

Boundary particles of a sampled surface are teeth, by which fluid would turn the body and be turned by it: a free cylinder of
0.02 of water's density spun up to 2 rad/s in still water, and rolled away. So the particles of a round body follow it
without its spin, and the moment is taken out of its wrench.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

TYPE = mujoco.mjtGeom
NEAR = 1e-9  # m, and sine of an angle, that count as nothing


@dataclass(frozen=True)
class Roundness:
    """Of one body: `centre` (3,) relative to the centre of mass and `axis` (3,), None for a sphere, in the frame of the
    body; `start` (3, 3) is the rotation, body to world, in which its boundary particles were laid out."""

    centre: np.ndarray
    axis: np.ndarray | None
    start: np.ndarray

    def turn(self, rotation: np.ndarray) -> np.ndarray:
        """The rotation (3, 3), body to world, that takes the axis where `rotation` takes it, without a spin about it."""
        if self.axis is None:
            return self.start
        a, b = self.start @ self.axis, rotation @ self.axis
        return _between(a, b) @ self.start

    def smooth(self, rotation: np.ndarray) -> np.ndarray:
        """The matrix (6, 6) that takes the moment about the axis out of a wrench about the centre of mass; its transpose
        takes the spin out of a twist or an acceleration."""
        axes = np.eye(3) if self.axis is None else (rotation @ self.axis)[None]
        arm, matrix = rotation @ self.centre, np.eye(6)
        for axis in axes:  # moment: axis . (T - arm x F)
            matrix[3:] -= np.outer(axis, np.concatenate([-np.cross(axis, arm), axis]))
        return matrix


def roundness(model: mujoco.MjModel, data: mujoco.MjData, body: int, geoms: list[int], dimension: int):
    """The `Roundness` of a body with these wet geoms, where it stands; None where it is not round. In two dimensions only
    the axis y counts."""
    parts = [_of(model, data, geom) for geom in geoms]
    if not parts or None in parts:
        return None
    centres, axes = [centre for centre, _ in parts], [axis for _, axis in parts if axis is not None]
    centre, axis = centres[0], None
    if dimension == 2:
        axis = np.array([0.0, 1.0, 0.0])
    elif axes:
        axis = axes[0]
    elif apart := [c - centre for c in centres if np.linalg.norm(c - centre) > NEAR]:
        axis = apart[0] / np.linalg.norm(apart[0])
    if axis is not None:
        off = [np.cross(axis, vector) for vector in (*axes, *(c - centre for c in centres))]
        if max(np.linalg.norm(vector) for vector in off) > NEAR:
            return None
    rotation = data.xmat[body].reshape(3, 3).copy()
    inward = None if axis is None else rotation.T @ axis
    return Roundness(rotation.T @ (centre - data.xipos[body]), inward, rotation)


def _of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Centre and axis of revolution of a geom, world frame; the axis is None for a sphere, all is for what has neither."""
    kind, size = TYPE(model.geom_type[geom]), model.geom_size[geom]
    centre, axes = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3).T
    if kind == TYPE.mjGEOM_SPHERE:
        return centre, None
    if kind in (TYPE.mjGEOM_CYLINDER, TYPE.mjGEOM_CAPSULE):
        return centre, axes[2].copy()
    if kind == TYPE.mjGEOM_ELLIPSOID:
        same = [k for k in range(3) if abs(size[k - 1] - size[k - 2]) < NEAR]
        if same:
            return centre, None if len(same) == 3 else axes[same[0]].copy()
    return None


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The least rotation (3, 3) that takes the unit vector a to b."""
    v, c = np.cross(a, b), a @ b
    if c < -1 + NEAR:  # half a turn about any axis across
        across = np.cross(a, np.eye(3)[np.abs(a).argmin()])
        across /= np.linalg.norm(across)
        return 2 * np.outer(across, across) - np.eye(3)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + c)
