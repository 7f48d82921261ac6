"""Several MJCF files as one: each must mean beside the others what it means alone."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from fsi.errors import SceneError
from fsi.scene.model import BodyFile

OBJ = mujoco.mjtObj
SAME = {  # what of an element must not change; poses of what stands in the world move with the file
    OBJ.mjOBJ_BODY: ("body", ("mass", "gravcomp", "mocapid<0")),
    OBJ.mjOBJ_JOINT: ("jnt", ("type", "limited", "range", "axis", "pos", "stiffness", "margin", "solref", "solimp")),
    OBJ.mjOBJ_GEOM: ("geom", ("type", "size", "friction", "contype", "conaffinity", "condim", "margin", "solref")),
    OBJ.mjOBJ_SITE: ("site", ("type", "size")),
    OBJ.mjOBJ_TENDON: ("tendon", ("limited", "range", "stiffness", "damping", "lengthspring", "width")),
    OBJ.mjOBJ_ACTUATOR: ("actuator", ("trntype", "gainprm", "biasprm", "gear", "ctrlrange", "forcerange", "dyntype")),
    OBJ.mjOBJ_EQUALITY: ("eq", ("type", "active0", "solref", "solimp")),
    OBJ.mjOBJ_SENSOR: ("sensor", ("type", "dim", "cutoff")),
}
NEAR = 1e-6  # relative


def join(parts: Mapping[str, mujoco.MjSpec], source: object) -> mujoco.MjSpec:
    """One specification of several, under the smallest of their time steps; all other options must be the same."""
    options = [part.option for part in parts.values()]
    step = min(option.timestep for option in options)
    for key, part in parts.items():
        part.option.timestep = step
        part.option.gravity = options[0].gravity
        for field in (name for name in dir(part.option) if not name.startswith("_")):
            if not np.array_equal(getattr(part.option, field), getattr(options[0], field)):
                here, first = getattr(part.option, field), getattr(options[0], field)
                fault = f"option {field!r} is {_text(here)}, in the first file {_text(first)}"
                raise SceneError(fault, key=f"bodies.{key}.mjcf", file=source, fix="give all files the same options")
    whole = mujoco.MjSpec()
    whole.option = options[0]
    for key, part in parts.items():
        whole.attach(part, prefix=f"{key}/", frame=whole.worldbody.add_frame())
    return whole


def keep_inertia(whole: mujoco.MjSpec, model: mujoco.MjModel, alone: Mapping[str, mujoco.MjModel]) -> bool:
    """Give each body the mass and inertia that its file alone gives it, where the compiler settings of the file (a total
    mass, a least mass, inertia from geoms) would not reach it in the whole; whether any had to be given."""
    changed = False
    for key, own in alone.items():
        for index in range(1, own.nbody):
            body = whole.body(f"{key}/{own.body(index).name}")
            now = model.body(body.name).id if body else -1
            if body is None or now < 0 or _same_inertia(model, now, own, index):
                continue
            body.explicitinertial, body.mass = True, own.body_mass[index]
            body.ipos, body.iquat = own.body_ipos[index], own.body_iquat[index]
            body.inertia, body.fullinertia = own.body_inertia[index], np.full(6, np.nan)
            changed = True
    return changed


def check_same(
    model: mujoco.MjModel, alone: Mapping[str, mujoco.MjModel], files: Mapping[str, BodyFile], source: object
) -> None:
    """Raise SceneError where an element of a file is not in the whole what it is in the file alone."""
    for key, own in alone.items():
        for kind, (field, properties) in SAME.items():
            for index in range(1 if field == "body" else 0, _count(own, kind)):
                name = mujoco.mj_id2name(own, kind, index)
                if not name:
                    continue
                there = mujoco.mj_name2id(model, kind, f"{key}/{name}")
                fault = "is lost" if there < 0 else _differs(own, index, model, there, field, properties)
                if fault:
                    fault = f"{field} {name!r} of {files[key].mjcf} {fault} beside the other files"
                    fix = "put the bodies into one MJCF file"
                    raise SceneError(fault, key=f"bodies.{key}.mjcf", file=source, fix=fix)


def _differs(own, index: int, model, there: int, field: str, properties: tuple[str, ...]) -> str:
    for name in properties:
        plain, sign = name.removesuffix("<0"), name.endswith("<0")
        a, b = (np.asarray(getattr(m, f"{field}_{plain}")[i], float) for m, i in ((own, index), (model, there)))
        if (sign and (a < 0) != (b < 0)) or (not sign and not np.allclose(a, b, rtol=NEAR, atol=1e-12)):
            return f"has {plain} {_text(b)} where it has {_text(a)} alone,"
    return ""


def _same_inertia(model: mujoco.MjModel, there: int, own: mujoco.MjModel, index: int) -> bool:
    fields = ("body_mass", "body_inertia", "body_ipos")
    return all(np.allclose(getattr(model, f)[there], getattr(own, f)[index], rtol=NEAR, atol=1e-9) for f in fields)


def _count(model: mujoco.MjModel, kind: mujoco.mjtObj) -> int:
    counts = {
        OBJ.mjOBJ_BODY: model.nbody,
        OBJ.mjOBJ_JOINT: model.njnt,
        OBJ.mjOBJ_GEOM: model.ngeom,
        OBJ.mjOBJ_SITE: model.nsite,
        OBJ.mjOBJ_TENDON: model.ntendon,
        OBJ.mjOBJ_ACTUATOR: model.nu,
        OBJ.mjOBJ_EQUALITY: model.neq,
        OBJ.mjOBJ_SENSOR: model.nsensor,
    }
    return counts[kind]


def _text(value: object) -> str:
    return " ".join(f"{v:g}" for v in np.atleast_1d(np.asarray(value, float)))
