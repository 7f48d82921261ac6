"""What holds between the bodies at an instant, in words."""

from __future__ import annotations

import mujoco

LIMITS = {
    mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT: mujoco.mjtObj.mjOBJ_JOINT,
    mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON: mujoco.mjtObj.mjOBJ_TENDON,
}
BALL = mujoco.mjtJoint.mjJNT_BALL


def conditions(model: mujoco.MjModel, data: mujoco.MjData) -> list[str]:
    """Joints and tendons at a limit, and pairs of geoms that touch."""
    return _limits(model, data) + _contacts(model, data) if data.nefc or data.ncon else []


def _limits(model: mujoco.MjModel, data: mujoco.MjData) -> list[str]:
    texts = []
    for kind, index in zip(data.efc_type[: data.nefc], data.efc_id[: data.nefc], strict=True):
        if (thing := LIMITS.get(mujoco.mjtConstraint(kind))) is None:
            continue
        joint = thing == mujoco.mjtObj.mjOBJ_JOINT
        name = mujoco.mj_id2name(model, thing, index) or index
        texts.append(f"{'joint' if joint else 'tendon'} {name!r} at {_which(model, data, index, joint)}")
    return texts


def _which(model: mujoco.MjModel, data: mujoco.MjData, index: int, joint: bool) -> str:
    if joint and model.jnt_type[index] == BALL:
        return "its limit"
    low, high = model.jnt_range[index] if joint else model.tendon_range[index]
    value = data.qpos[model.jnt_qposadr[index]] if joint else data.ten_length[index]
    upper = value > 0.5 * (low + high)
    unit = "rad" if joint and model.jnt_type[index] == mujoco.mjtJoint.mjJNT_HINGE else "m"
    return f"its {'upper' if upper else 'lower'} limit, {high if upper else low:.4g} {unit}"


def _contacts(model: mujoco.MjModel, data: mujoco.MjData) -> list[str]:
    pairs = {tuple(contact.geom) for contact in data.contact if contact.dist <= 0 and min(contact.geom) >= 0}
    names = (sorted(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, g) for g in pair) for pair in pairs)
    return sorted(f"contact of {a!r} and {b!r}" for a, b in names)
