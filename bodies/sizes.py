"""Sizes of bodies before anything is allocated: elements of an MJCF file, boundary particles, matrices of the joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from bodies.assets import WHOLE
from fsi.compute.memory import free_memory
from fsi.errors import SceneError
from fsi.scene.check_size import BYTES_PER_PARTICLE, fluid_particles
from fsi.scene.geometry import fluid_volume
from fsi.scene.model import Scene
from fsi.trust import check_bytes

MOST_BYTES = 50e6  # of an MJCF file
MOST_ELEMENTS = 20_000  # in it, copies of <replicate>, <composite> and <flexcomp> among them
MOST_DEPTH = 400  # elements one in another
MOST_VALUES = 10e6  # of a height field or a texture
MOST_JOINTS = 1000  # degrees of freedom; the fluid answers each by itself, and the mass matrix is dense
MOST_USER = 1000  # keyframes, and values of the user's own for each element
SINGULAR = 1e-9  # smallest eigenvalue of the mass matrix over its diagonal; round-off leaves 1e-16
FREEDOM = {"freejoint": 6, "free": 6, "ball": 3, "hinge": 1, "slide": 1}
SAMPLING = {2: 12e3, 3: 5e3}  # bytes per boundary particle that the layers under a mesh take while they are laid
FAR = 20  # times the tank's length, from which on a size must be in another unit
MILLIMETRES = 'MJCF is in metres; a mesh in millimetres takes scale="0.001 0.001 0.001" in its <mesh>'


def check_file(path: Path) -> None:
    """Raise SceneError for an MJCF file that would grow beyond measure when it is compiled, with the files that it includes
    where it includes them, and the models that it attaches. One that is no XML passes: MuJoCo says more about it."""
    total, joints, seen, open_elements = 0.0, 0.0, {path}, [(_root(path), 1.0, 1)]
    while open_elements:
        element, copies, depth = open_elements.pop()
        named = path.parent / element.get("file", "") if element.tag in WHOLE else path
        if named not in seen:  # MuJoCo refuses a second include of it
            seen.add(named)
            open_elements.append((_root(named), copies, depth))
        _check_values(element, path)
        total += copies
        joints += copies * FREEDOM.get(element.get("type", "hinge") if element.tag == "joint" else element.tag, 0)
        if joints > MOST_JOINTS:
            fault, fix = f"more than {MOST_JOINTS} degrees of freedom", "use fewer joints"
            raise SceneError(fault, key=element.tag, file=path, fix=fix)
        if depth > MOST_DEPTH:
            fault = f"elements stand more than {MOST_DEPTH} deep in each other"
            raise SceneError(fault, key=element.tag, file=path, fix="make the tree flatter")
        copies *= _copies(element)
        if max(total, copies) > MOST_ELEMENTS:
            fault = f"more than {MOST_ELEMENTS} elements, copies counted"
            raise SceneError(fault, key=element.tag, file=path, fix="use fewer, or a lower count")
        open_elements += [(child, copies, depth + 1) for child in element]
        if element.tag in ("composite", "flexcomp"):
            total += copies


def _root(path: Path) -> ElementTree.Element:
    """The outermost element of an MJCF file, an empty one for what is none. Raises SceneError for a file that is too long."""
    check_bytes(path, MOST_BYTES, "give less MJCF")
    try:
        return ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, ValueError, RecursionError, LookupError):
        return ElementTree.Element("mujoco")


def _copies(element: ElementTree.Element) -> float:
    """How often the inside of an element is made."""
    if element.tag not in ("replicate", "composite", "flexcomp"):
        return 1.0
    return math.prod(max(1.0, count) for count in _numbers(element.get("count", "1")))


def _check_values(element: ElementTree.Element, path: Path) -> None:
    if element.tag == "size":
        for key, text in element.items():
            most = MOST_USER if key.startswith(("nuser", "nkey")) else MOST_VALUES
            if key != "memory" and any(count > most for count in _numbers(text)):
                raise SceneError(f"{text[:40]} values", key=f"size {key}", file=path, fix=f"use at most {most:.0f}")
    for one, other in {"hfield": [("nrow", "ncol")], "texture": [("width", "height")]}.get(element.tag, []):
        count = math.prod([*_numbers(element.get(one, "1")), *_numbers(element.get(other, "1"))])
        if count > MOST_VALUES:
            key = f"{element.tag} {element.get('name', '')!r}"
            fault = f"{count:.3g} values ({one} times {other})"
            raise SceneError(fault, key=key, file=path, fix=f"use at most {MOST_VALUES:.0e}")


def _numbers(text: str) -> list[float]:
    """Numbers of an attribute; those that are none are left to MuJoCo."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []


def check_model(model: mujoco.MjModel, geoms: Sequence[int], scene: Scene, source: object) -> None:
    """Raise SceneError where the boundary particles of the wet geoms or the matrices of the joints do not fit into the
    memory that is free."""
    have, total = free_memory(), 0.0
    for geom in geoms:
        count = boundary_particles(model, geom, scene)
        sampling = SAMPLING[scene.dimension] if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH else 0.0
        total += count
        need = total * BYTES_PER_PARTICLE + count * sampling
        if need > have:
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, int(geom))
            fault = f"geom {name!r} takes about {count:.3g} boundary particles, {_of(need, have)}"
            fix = "check its size, which is in metres, and its place, or use a larger spacing"
            fix = units(name, 2 * float(model.geom_aabb[geom, 3:].max()), scene) or fix
            raise SceneError(fault, key="bodies", file=source, fix=fix)
    if model.nv > MOST_JOINTS:
        fault, fix = f"{model.nv} degrees of freedom", f"use at most {MOST_JOINTS}"
        raise SceneError(fault, key="bodies", file=source, fix=fix)
    responses = 8.0 * model.nv * (fluid_particles(scene, fluid_volume(scene)) + total)
    matrices = 8.0 * (6 * model.nv**2 + 12 * model.nv * model.nbody)
    if scene.coupler.scheme == "added_mass" and responses + matrices > have:
        fault = f"{model.nv} degrees of freedom, to each of which the fluid responds: {_of(responses + matrices, have)}"
        raise SceneError(fault, key="bodies", file=source, fix="use fewer joints or a larger spacing")


def units(label: str, extent: float, scene: Scene) -> str:
    """The way out for a geom so much longer [m] than the tank that its size must be in another unit; "" for others."""
    far = FAR * float(np.subtract(scene.tank.max, scene.tank.min).max())
    return f"geom {label!r} is {extent:.4g} m long: {MILLIMETRES}" if extent > far else ""


def check_independent(model: mujoco.MjModel, inertia: np.ndarray, source: object) -> None:
    """Raise SceneError where joints move a body the same way, so that the mass matrix `inertia` (nv, nv) is singular."""
    scale = np.sqrt(inertia.diagonal())
    if not len(scale) or not (scale > 0).all() or not np.isfinite(inertia).all():
        return
    values, vectors = np.linalg.eigh(inertia / np.outer(scale, scale))
    if values[0] > SINGULAR:
        return
    heavy, light = float(np.max(model.body_mass)), float(np.min(model.body_mass[model.body_mass > 0]))
    if light < SINGULAR * heavy * 100:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, int(np.argmax(model.body_mass)))
        fault = f"body {name!r} weighs {heavy:.3g} kg and another {light:.3g} kg, too far apart for one mass matrix"
        raise SceneError(fault, key="bodies", file=source, fix=f"check their densities and sizes: {MILLIMETRES}")
    joints = sorted({int(model.dof_jntid[dof]) for dof in np.argsort(-np.abs(vectors[:, 0]))[:2]})
    names = " and ".join(repr(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)) for joint in joints)
    fault = f"joints {names} move a body the same way at the start, so that the mass matrix is singular"
    raise SceneError(fault, key="bodies", file=source, fix="remove one of them, or turn its axis")


def boundary_particles(model: mujoco.MjModel, geom: int, scene: Scene) -> float:
    """About how many a wet geom gets: those in the outer layers of its bounding box; in two dimensions of the largest
    side of that."""
    half = np.array(model.geom_aabb[geom, 3:])
    sides = np.sort(2 * half / scene.spacing)[::-1][: scene.dimension].tolist()
    return math.prod(sides) - math.prod(max(0.0, side - 2 * scene.layers) for side in sides)


def _of(need: float, have: float) -> str:
    return f"{need / 1e9:.3g} GB of {have / 1e9:.3g} GB that are free"
