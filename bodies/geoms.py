"""MuJoCo geoms as solids of the tank and as triangle meshes to draw."""

from __future__ import annotations

import mujoco
import numpy as np

from bodies.mjcf import GEOM, mesh_arrays, name_of
from bodies.shapes import outlines
from bodies.shapes.meshes import BY_HAND, at, mesh, polygon, section, sound
from bodies.shapes.primitives import Box, Capsule, Cylinder, Disc, Placed, Shape
from fsi.errors import SceneError

TYPE = mujoco.mjtGeom
ALIGNED = 1.0 - 1e-9  # cosine above which an axis counts as parallel to y


def triangles(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (n, 3) and triangles (m, 3) of a geom in its own frame; None for what has no volume to draw."""
    kind, size = TYPE(model.geom_type[geom]), model.geom_size[geom]
    if kind == TYPE.mjGEOM_MESH:
        return mesh_arrays(model, model.geom_dataid[geom])
    if kind == TYPE.mjGEOM_BOX:
        return outlines.box(size)
    if kind == TYPE.mjGEOM_CYLINDER:
        return outlines.cylinder(size[0], size[1])
    if kind == TYPE.mjGEOM_CAPSULE:
        return outlines.capsule(size[0], size[1])
    if kind == TYPE.mjGEOM_SPHERE:
        return outlines.ball(size[0])
    if kind != TYPE.mjGEOM_ELLIPSOID:
        return None
    import trimesh

    solid = trimesh.creation.icosphere(subdivisions=4)
    return solid.vertices * size, np.array(solid.faces)


def place(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, dimension: int, weighed: bool, source: object
) -> tuple[list[Placed], list[str]]:
    """A wet geom as a solid in its present pose, in two dimensions its section by the plane y = 0; one solid for each part of
    a mesh whose parts overlap. Also notes. `weighed`: MuJoCo takes its mass from its density.

    Raises SceneError for a geom without volume, a mesh that is no solid, and a geom that the plane y = 0 misses.
    """
    key = f"geom {name_of(model, GEOM, geom)!r}"
    surface, notes = triangles(model, geom), []
    if surface is None:
        kind = TYPE(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
        raise SceneError(f"type {kind} cannot be wet", key=key, file=source, fix="use a box or a mesh")
    surfaces = [surface]
    if model.geom_type[geom] == TYPE.mjGEOM_MESH:
        surfaces, notes = _parts(model, geom, surface, weighed, key, source)
    position, rotation = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3).copy()
    if dimension == 3:
        return [Placed(_solid(model, geom, part), position, rotation) for part in surfaces], notes
    if (round_or_box := _slice(model, geom, position, rotation)) is not None:
        return [round_or_box], notes
    placed = [cut for part in surfaces if (cut := _section(part, position, rotation)) is not None]
    if not placed:
        raise SceneError("does not meet the plane y = 0 of the 2D scene", key=key, file=source, fix="move it along y")
    return placed, notes


def _parts(model: mujoco.MjModel, geom: int, surface: tuple, weighed: bool, key: str, source: object):
    """The surfaces of a mesh geom that meet the fluid, and notes on those that do not."""
    mesh_id = model.geom_dataid[geom]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh_id])
    vertices = surface[0] @ turn.reshape(3, 3).T + model.mesh_pos[mesh_id]  # as in its file
    found = sound(vertices, surface[1], key, source)
    twice = found.overlap is not None or found.twice > 0.0
    if twice and weighed:
        where = f" near {at(found.overlap)}" if found.overlap is not None else ""
        fault = f"parts of its mesh overlap{where}: mass and inertia by density would count what they share twice"
        fix = f"unite them {BY_HAND}, or give the geom mass=, or its body an <inertial>"
        raise SceneError(fault, key=key, file=source, fix=fix)
    notes = []
    if twice:
        notes.append(
            f"{key}: parts of its mesh overlap and are taken as one solid; its inertia counts what they share twice"
        )
    if found.cavity:
        notes.append(
            f"{key} is hollow: its mesh encloses a cavity of {found.cavity:.3g} m3, which stays dry; "
            "its mass by density is that of the shell alone"
        )
    if found.overlap is None:
        return [(surface[0], found.outside)], notes
    return [(surface[0], part) for part in found.parts], notes


def _solid(model: mujoco.MjModel, geom: int, surface: tuple[np.ndarray, np.ndarray]) -> Shape:
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == TYPE.mjGEOM_BOX:
        return Box(size.copy())
    if kind == TYPE.mjGEOM_SPHERE:
        return Capsule(float(size[0]))
    if kind == TYPE.mjGEOM_CAPSULE:
        return Capsule(float(size[0]), float(size[1]))
    if kind == TYPE.mjGEOM_CYLINDER:
        return Cylinder(float(size[0]), float(size[1]))
    return mesh(*surface)


def _slice(model: mujoco.MjModel, geom: int, position: np.ndarray, rotation: np.ndarray) -> Placed | None:
    """The section by y = 0 where it is a circle or a rectangle; axes of the section are (x, z)."""
    kind, size, offset = model.geom_type[geom], model.geom_size[geom], abs(position[1])
    origin, plane = position[[0, 2]], rotation[[0, 2]]
    along = np.abs(rotation[1])  # of each axis of the geom along y
    if kind == TYPE.mjGEOM_SPHERE and offset < size[0]:
        return Placed(Disc(float(np.sqrt(size[0] ** 2 - offset**2))), origin, np.eye(2))
    if kind == TYPE.mjGEOM_BOX and along.max() > ALIGNED and offset < size[along.argmax()]:
        rest = np.delete(np.arange(3), along.argmax())
        return Placed(Box(size[rest]), origin, plane[:, rest])
    if kind == TYPE.mjGEOM_CYLINDER and along[2] > ALIGNED and offset < size[1]:
        return Placed(Disc(float(size[0])), origin, np.eye(2))
    if kind == TYPE.mjGEOM_CYLINDER and along[2] < 1e-9 and offset < size[0]:
        axis = plane[:, 2]
        half = np.array([np.sqrt(size[0] ** 2 - offset**2), size[1]])
        return Placed(Box(half), origin, np.column_stack([[-axis[1], axis[0]], axis]))
    return None


def _section(surface: tuple[np.ndarray, np.ndarray], position: np.ndarray, rotation: np.ndarray) -> Placed | None:
    vertices, faces = surface
    start, end = section(vertices @ rotation.T + position, faces)
    if len(start) == 0:
        return None
    origin = position[[0, 2]]
    return Placed(polygon(start - origin, end - origin), origin, np.eye(2))
