"""How far bodies go beyond what holds them: MuJoCo's limits and contacts are soft."""

from __future__ import annotations

import mujoco
import numpy as np

JOINT, GEOM = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_GEOM


class Penetration:
    """The largest excess over joint ranges and the deepest contact of a run, kept up to date in `notes`."""

    def __init__(self, model: mujoco.MjModel, notes: dict[str, str]):
        self._model, self._notes = model, notes
        single = np.isin(model.jnt_type, (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE))
        self._joints = np.flatnonzero(model.jnt_limited.astype(bool) & single)
        self._address = model.jnt_qposadr[self._joints]
        self._low, self._high = model.jnt_range[self._joints].T
        self.limits = np.zeros(len(self._joints))  # [m, rad]
        self.contact = 0.0  # [m]

    def watch(self, data: mujoco.MjData) -> None:
        """Look at where everything stands."""
        if self._joints.size:
            x = data.qpos[self._address]
            beyond = np.maximum(self._low - x, x - self._high)
            for j in np.flatnonzero(beyond > self.limits):
                self.limits[j] = beyond[j]
                name = mujoco.mj_id2name(self._model, JOINT, int(self._joints[j]))
                hinge = self._model.jnt_type[self._joints[j]] == mujoco.mjtJoint.mjJNT_HINGE
                unit = "rad" if hinge else "m"
                self._notes[f"limit {j}"] = f"joint {name!r} went up to {beyond[j]:.2g} {unit} beyond its range"
        if data.ncon and (depth := -float(data.contact.dist.min())) > self.contact:
            self.contact = depth
            pair = data.contact.geom[data.contact.dist.argmin()]
            first, second = (mujoco.mj_id2name(self._model, GEOM, int(g)) for g in pair)
            self._notes["contact"] = f"geoms {first!r} and {second!r} went up to {depth:.2g} m into each other"
