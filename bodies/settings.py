"""What an MJCF file asks for that is odd for bodies in a fluid: refused where it can only be a mistake, else told."""

from __future__ import annotations

import mujoco
import numpy as np

from bodies.mjcf import moves, name_of
from fsi.errors import SceneError
from fsi.scene.model import Scene

BODY, JOINT, SENSOR, TUPLE = (getattr(mujoco.mjtObj, f"mjOBJ_{kind}") for kind in ("BODY", "JOINT", "SENSOR", "TUPLE"))
TYPE = mujoco.mjtJoint
ACROSS = 1e-6  # of an axis of length 1, along y or off it


def check_settings(
    model: mujoco.MjModel, data: mujoco.MjData, wet: np.ndarray, scene: Scene, source: object
) -> list[str]:
    """Notes on what acts otherwise than one may think; `data` has the bodies at the start, `wet` are the ids of those that meet
    the fluid. Raises SceneError for damping that drives, and for a tuple that is meant to name the wet geoms and does not."""
    for joint in range(model.njnt):
        damping = model.dof_damping[model.jnt_dofadr[joint]]
        if damping < 0:
            key, fix = f"joint {name_of(model, JOINT, joint)!r}", "give 0 or more; a drive is an actuator"
            raise SceneError(f"damping is {damping:g}: it drives the joint", key=key, file=source, fix=fix)
    for index in range(model.ntuple):
        name = name_of(model, TUPLE, index)
        tail = name.rpartition("/")[2]
        if tail != "wet" and tail.lower().strip() in ("wet", "wet_geoms", "wetgeoms"):
            raise SceneError("has no effect", key=f"tuple {name!r}", file=source, fix="call it 'wet'")
    across = _across(model, data, wet) if scene.dimension == 2 else []
    return [*_borne(model, scene.gravity), *_repelling(model), *_silent(model), *across]


def _borne(model: mujoco.MjModel, gravity: float) -> list[str]:
    """Bodies whose weight MuJoCo bears."""
    notes = []
    for body in np.flatnonzero(model.body_gravcomp):
        share, name = float(model.body_gravcomp[body]), name_of(model, BODY, body)
        if gravity and moves(model, body):
            weight = share * model.body_mass[body] * gravity
            notes.append(
                f"body {name!r} has gravcomp = {share:g}: MuJoCo bears that part of its weight, {weight:.4g} N"
            )
    return notes


def _repelling(model: mujoco.MjModel) -> list[str]:
    """Springs that push away from their rest."""
    joints = np.flatnonzero(model.jnt_stiffness < 0)
    return [
        f"joint {name_of(model, JOINT, joint)!r}: stiffness is {model.jnt_stiffness[joint]:g}: it pushes away from its rest"
        for joint in joints
    ]


def _silent(model: mujoco.MjModel) -> list[str]:
    """Sensors that a program would have to fill."""
    users = np.flatnonzero(model.sensor_type == mujoco.mjtSensor.mjSENS_USER)
    return [f"sensor {name_of(model, SENSOR, s) or int(s)!r} of type user reads 0: nothing fills it" for s in users]


def _across(model: mujoco.MjModel, data: mujoco.MjData, wet: np.ndarray) -> list[str]:
    """Joints of wet bodies that lead out of the plane y = 0, in which no fluid moves them."""
    mujoco.mj_kinematics(model, data)
    carriers = set()
    for body in wet:
        while body:
            carriers.add(int(body))
            body = model.body_parentid[body]
    notes = []
    for joint in range(model.njnt):
        along, kind = abs(float(data.xaxis[joint][1])), TYPE(model.jnt_type[joint])
        out = along < 1 - ACROSS if kind == TYPE.mjJNT_HINGE else kind == TYPE.mjJNT_SLIDE and along > ACROSS
        if out and int(model.jnt_bodyid[joint]) in carriers:
            notes.append(
                f"joint {name_of(model, JOINT, joint)!r} leads out of the plane y = 0: the fluid of a two-dimensional scene "
                "does not move it, and sees the body as if it stayed"
            )
    return notes
