"""A free body on a carriage: slides and hinges in place of its free joint, so that it can be moved by force in one direction at
a time. The slides are along the axes of the tank, the hinges about the body's own centre of mass."""

from __future__ import annotations

from xml.etree import ElementTree

import mujoco
import numpy as np

from cases.study import mjcf_edit
from fsi.errors import SceneError
from fsi.scene.model import Scene

MOTIONS = {  # name -> joint type, axis, as a ship's
    "surge": ("slide", 0), "sway": ("slide", 1), "heave": ("slide", 2),
    "roll": ("hinge", 0), "pitch": ("hinge", 1), "yaw": ("hinge", 2),
}  # fmt: skip
PLANE = ("surge", "heave", "pitch")  # of a scene in two dimensions


def carried(scene: Scene) -> dict[str, tuple[ElementTree.Element, list[str]]]:
    """Body file of the scene -> its tree with every free joint replaced, and the names of the joints in place of it, `BODY
    heave` and so on; only files that have a free joint. Raises SceneError where such a file has keyframes, which do not fit any
    more, where a free body has no name, or MuJoCo does not take the file."""
    found = {}
    for name, file in scene.bodies.items():
        root = mjcf_edit.read(file.mjcf)
        free = [(body, joint) for body in root.iter("body") for joint in body if _is_free(joint)]
        if not free:
            continue
        if root.find("keyframe") is not None:
            fix = "remove them, and pose the body in its file"
            raise SceneError("has keyframes of a free body, which a carriage cannot take", file=file.mjcf.name, fix=fix)
        if any(not body.get("name") for body, _ in free):
            raise SceneError("has a free body without a name", file=file.mjcf.name, fix='name it: <body name="NAME">')
        try:
            model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
        except ValueError as fault:
            raise SceneError(f"is no model of MuJoCo: {fault}", file=file.mjcf.name, fix="correct it") from None
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        names = []
        for body, joint in free:
            number = model.body(body.get("name")).id
            turn = data.xmat[number].reshape(3, 3)
            body.remove(joint)
            for motion, (kind, axis) in MOTIONS.items():
                if scene.dimension == 3 or motion in PLANE:
                    names.append(f"{body.get('name')} {motion}")
                    facts = {
                        "name": names[-1],
                        "type": kind,
                        "axis": _text(turn[axis]),
                        "pos": _text(model.body_ipos[number]),
                    }
                    body.insert(len(names) - 1, ElementTree.Element("joint", facts))
        found[name] = root, names
    return found


def _is_free(element: ElementTree.Element) -> bool:
    return element.tag == "freejoint" or (element.tag == "joint" and element.get("type") == "free")


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.12g}" for value in values)
