"""How far bodies go beyond what holds them: MuJoCo's limits and contacts are soft."""

from __future__ import annotations

import mujoco
import numpy as np

JOINT, GEOM = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_GEOM


class Penetration:
    """The largest excess over each joint's range [m, rad] and the deepest contact [m] of a run.

    `state` (limited joints + 3,): the excesses, then the depth of the contact and its two geoms.
    """

    def __init__(self, model: mujoco.MjModel):
        self._model = model
        single = np.isin(model.jnt_type, (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE))
        self._joints = np.flatnonzero(model.jnt_limited.astype(bool) & single)
        low, high = model.jnt_range[self._joints].T.tolist()
        self._limits = list(zip(model.jnt_qposadr[self._joints].tolist(), low, high, strict=True))
        self.state = np.zeros(len(self._joints) + 3)

    def watch(self, data: mujoco.MjData) -> None:
        """Look at where everything stands."""
        qpos = data.qpos
        for k, (address, low, high) in enumerate(self._limits):
            x = qpos[address]
            if low - x > self.state[k] or x - high > self.state[k]:
                self.state[k] = max(low - x, x - high)
        if data.ncon and (depth := -float(data.contact.dist.min())) > self.state[-3]:
            self.state[-3:] = depth, *data.contact.geom[data.contact.dist.argmin()]

    @property
    def depth(self) -> float:
        """Of the deepest contact [m]."""
        return float(self.state[-3])

    def limits(self) -> dict[str, float]:
        """Excess over the range of each limited joint [m, rad]."""
        names = (mujoco.mj_id2name(self._model, JOINT, int(joint)) for joint in self._joints)
        return dict(zip(names, self.state[:-3].tolist(), strict=True))

    @property
    def notes(self) -> tuple[str, ...]:
        lines = []
        for joint, beyond in zip(self._joints, self.state[:-3], strict=True):
            if beyond > 0:
                name = mujoco.mj_id2name(self._model, JOINT, int(joint))
                unit = "rad" if self._model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE else "m"
                lines.append(f"joint {name!r} went up to {beyond:.2g} {unit} beyond its range")
        depth, *pair = self.state[-3:]
        if depth > 0:
            first, second = (mujoco.mj_id2name(self._model, GEOM, int(geom)) for geom in pair)
            lines.append(f"geoms {first!r} and {second!r} went up to {depth:.2g} m into each other")
        return tuple(lines)
