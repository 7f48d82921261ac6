"""World coordinates in an MJCF file: they move with the file, and where its keyframe "start" puts the bodies."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from fsi.errors import SceneError

OBJ, EQ, TYPE = mujoco.mjtObj, mujoco.mjtEq, mujoco.mjtJoint
KEY = "start"
WORLD = ("", "world")
SIZES = {TYPE.mjJNT_FREE: (7, 6), TYPE.mjJNT_BALL: (4, 3), TYPE.mjJNT_SLIDE: (1, 1), TYPE.mjJNT_HINGE: (1, 1)}


def shift(spec: mujoco.MjSpec, position, file: object) -> None:
    """Move everything in the file's world by `position` (3,) [m], keyframes apart (`Start`). Raises SceneError for what
    cannot be moved."""
    position = np.asarray(position, float)
    world = spec.worldbody
    elements = [*world.bodies, *world.geoms, *world.sites, *world.cameras, *world.lights, *world.frames]
    free = [element for element in elements if element.frame is None]
    shifted = world.add_frame(pos=position)
    for element in free:
        element.set_frame(shifted)
    if not position.any():
        return
    for flex in spec.flexes:
        if any(name in WORLD for name in [*flex.vertbody, *flex.nodebody]):
            fix = "pin it to a body instead, or leave bodies.NAME.position out"
            raise SceneError(f"flex {flex.name!r} is fixed to the world", file=file, fix=fix)
    for equality in spec.equalities:
        _shift_anchor(equality, position)


def _shift_anchor(equality: mujoco.MjsEquality, position: np.ndarray) -> None:
    """`connect` holds a point in the frame of body 1; `weld` one in that of body 2, and beside it one in that of body 1 where
    its pose is given (else the quaternion is 0)."""
    if equality.objtype != OBJ.mjOBJ_BODY or equality.type not in (EQ.mjEQ_CONNECT, EQ.mjEQ_WELD):
        return
    data, weld = np.array(equality.data), equality.type == EQ.mjEQ_WELD
    if (equality.name2 if weld else equality.name1) in WORLD:
        data[:3] += position
    if weld and equality.name1 in WORLD and data[6:10].any():
        data[3:6] += position
    equality.data = data


class Start:
    """The keyframe "start" of one file, with the file at `position` (3,) [m]. `model` is the file compiled by itself, before
    it was moved."""

    def __init__(self, model: mujoco.MjModel, position):
        self._model, self._position = model, np.asarray(position, float)
        self._key = mujoco.mj_name2id(model, OBJ.mjOBJ_KEY, KEY)

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData, prefix: str) -> None:
        """Pose the bodies of the file, whose names have the prefix, in the whole model."""
        own, key = self._model, self._key
        if key < 0:
            return
        for j in range(own.njnt):
            other = _index(own, model, OBJ.mjOBJ_JOINT, j, prefix)
            places, speeds = SIZES[TYPE(own.jnt_type[j])]
            place = own.key_qpos[key, own.jnt_qposadr[j] :][:places].copy()
            if places == 7:
                place[:3] += self._position
            data.qpos[model.jnt_qposadr[other] :][:places] = place
            data.qvel[model.jnt_dofadr[other] :][:speeds] = own.key_qvel[key, own.jnt_dofadr[j] :][:speeds]
        for a in range(own.nu):
            other = _index(own, model, OBJ.mjOBJ_ACTUATOR, a, prefix)
            data.ctrl[other] = own.key_ctrl[key, a]
            if (size := own.actuator_actnum[a]) > 0:
                there, here = model.actuator_actadr[other], own.actuator_actadr[a]
                data.act[there : there + size] = own.key_act[key, here : here + size]
        for body in np.flatnonzero(own.body_mocapid >= 0):
            there, here = model.body_mocapid[_index(own, model, OBJ.mjOBJ_BODY, body, prefix)], own.body_mocapid[body]
            data.mocap_pos[there] = own.key_mpos[key].reshape(-1, 3)[here] + self._position
            data.mocap_quat[there] = own.key_mquat[key].reshape(-1, 4)[here]


def start_from_keyframes(model: mujoco.MjModel, data: mujoco.MjData, starts: Mapping[str, Start]) -> None:
    """Put a model into the keyframes named "start" of its files, by prefix: positions, velocities and controls at t = 0."""
    for prefix, start in starts.items():
        start.apply(model, data, prefix)


def _index(own: mujoco.MjModel, whole: mujoco.MjModel, kind: mujoco.mjtObj, index: int, prefix: str) -> int:
    return mujoco.mj_name2id(whole, kind, prefix + mujoco.mj_id2name(own, kind, int(index)))
