"""MJCF files to one compiled MuJoCo model, and which of its geoms are wet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from bodies import joining, reading
from bodies.messages import listening
from bodies.reading import one_line
from bodies.world import Start
from fsi.errors import SceneError
from fsi.scene.model import BodyFile

OFF = 2e-6  # m; MuJoCo overlooks a micrometre
LEAST_FRICTION = 1e-3
ANEW = "python -c \"import trimesh; m = trimesh.load_mesh('FILE'); {}m.export('FILE')\""
FIXES = {  # what an error of MuJoCo's compiler says -> the way out
    "mass and inertia": "give its geoms mass or density",
    "control range": "give the actuator a ctrlrange=\"0 MOST\", of the values that its control may have",
    "ASCII": f"save it as binary STL of at most 200000 triangles, of an ASCII file by: {ANEW.format('')}",
    "volume is negative": f"turn its triangles outwards: {ANEW.format('m.invert(); ')}",
    "inconsistent orientation": "turn its triangles to one side in a CAD or mesh program (Blender: Mesh > Normals)",
}
GEOM = mujoco.mjtObj.mjOBJ_GEOM


def load_model(
    files: Mapping[str, BodyFile], gravity: float, source: object
) -> tuple[mujoco.MjModel, dict[str, Start], set[str], list[str]]:
    """Compile the body files of a scene into one model; with several files every name gets the prefix `NAME/`.

    gravity [m/s2] is the scene's; source names the scene in errors. Also returns the keyframes named "start" by prefix,
    the names of geoms that get their mass from their density, and notes on what was decided.
    Raises SceneError for a missing or malformed file and for options that contradict the scene.
    """
    mujoco.mj_clearCache(mujoco.mj_getCache())  # which tells the states of a mesh file apart by whole seconds
    with listening() as warned:
        model, starts, weighed, notes = _load(files, gravity, source)
    return model, starts, weighed, notes + [f"MuJoCo: {text}" for text in warned]


def _load(files: Mapping[str, BodyFile], gravity: float, source: object):
    several, notes = len(files) > 1, []
    parts, starts, alone = {}, {}, {}
    path = ", ".join(str(file.mjcf) for file in files.values())
    for key, file in files.items():
        part = reading.read(file, gravity, f"bodies.{key}.mjcf", source, notes)
        named = [one.name for one in part.keys]
        if named and "start" not in named:
            other = f"keyframe {named[0]!r} has no effect"
            notes.append(f"{file.mjcf.name}: {other}: bodies start from one called 'start', or else as drawn")
        if several or "start" in named:
            alone[key] = _compile(part, file.mjcf)
            starts[f"{key}/" if several else ""] = Start(alone[key], file.position)
        reading.settle(part, file)
        parts[key] = part
    whole = joining.join(parts, source) if several else next(iter(parts.values()))
    whole.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # else an unstable run would start over
    weighed = {geom.name for geom in whole.geoms if np.isnan(geom.mass) and not geom.parent.explicitinertial}
    exact = _count_meshes_exactly(whole)
    try:
        model = _compile(whole, path)
    except SceneError:  # of an open mesh, which is refused below with more to go by
        for mesh in exact:
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY
        exact, model = [], _compile(whole, path)
    if exact:
        notes.append("mesh geoms: mass and inertia by exact integration (inertia='exact')")
    if several and joining.keep_inertia(whole, model, alone):
        model = _compile(whole, path)
    if several:
        joining.check_same(model, alone, files, source)
    if _make_room(whole, model):
        model = _compile(whole, path)
    notes += _without_friction(model)
    return model, starts, weighed, notes


NAME_WET = 'if it is not meant to be, name those that are in the file: <custom><tuple name="wet">...'


def wet_geoms(model: mujoco.MjModel, files: Mapping[str, BodyFile], source: object) -> list[int]:
    """Ids of the wet geoms, file by file: those in its tuple named "wet", or without one all geoms of bodies that move.

    Raises SceneError for an element of the tuple that is no geom, and for a file without any wet geom.
    """
    geoms = []
    for key, file in files.items():
        prefix = f"{key}/" if len(files) > 1 else ""
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TUPLE, f"{prefix}wet")
        if index < 0:
            own = [g for g in range(model.ngeom) if name_of(model, GEOM, g).startswith(prefix)]
            moving = [g for g in own if moves(model, model.geom_bodyid[g])]
            geoms += moving
            if not moving:
                raise _dry(model, own, prefix, key, file, source)
            continue
        members = slice(model.tuple_adr[index], model.tuple_adr[index] + model.tuple_size[index])
        if (model.tuple_objtype[members] != GEOM).any():
            fix = 'list geoms with objtype="geom"'
            raise SceneError(f"tuple {prefix}wet has an element that is no geom", key="bodies", file=source, fix=fix)
        if not model.tuple_size[index]:
            raise _dry(model, [], prefix, key, file, source)
        geoms += model.tuple_objid[members].tolist()
    return list(dict.fromkeys(geoms))


def for_looks(model: mujoco.MjModel, files: Mapping[str, BodyFile], geoms: Sequence[int]) -> dict[str, str]:
    """Name -> note of each wet geom that no tuple names and that touches nothing where others of its body do, as geoms that
    are there to be seen."""
    touches = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    named = [f"{key}/" if len(files) > 1 else "" for key in files]
    named = [prefix for prefix in named if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TUPLE, f"{prefix}wet") >= 0]
    found = {}
    for geom in geoms:
        name, beside = name_of(model, GEOM, geom), model.geom_bodyid == model.geom_bodyid[geom]
        if not touches[geom] and touches[beside].any() and not any(map(name.startswith, named)):
            found[name] = f"geom {name!r} touches nothing, as one for looks, and is wet: {NAME_WET}"
    return found


def _dry(model: mujoco.MjModel, fixed: list[int], prefix: str, key: str, file: BodyFile, source: object) -> SceneError:
    """A file of which no geom meets the fluid; `fixed` are its geoms."""
    if fixed:
        name = name_of(model, GEOM, fixed[0]).removeprefix(prefix)
        fault = (
            f"{file.mjcf} has no body that moves, so that none of its geoms is wet: water would pass through {name!r}"
        )
        element = f'<element objtype="geom" objname="{name}"/>'
        fix = f'name its wet geoms in the file: <custom><tuple name="wet">{element}</tuple></custom>'
    else:
        fault, fix = f"{file.mjcf} has no wet geom", f"give it geoms, or take bodies.{key} out of the scene"
    return SceneError(fault, key=f"bodies.{key}.mjcf", file=source, fix=fix)


def moves(model: mujoco.MjModel, body: int) -> bool:
    """Whether a body can move relative to the world."""
    return model.body_weldid[body] != 0


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Name of an element of the compiled model."""
    return mujoco.mj_id2name(model, kind, int(index))


def _compile(spec: mujoco.MjSpec, path: object) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        known = (fix for sign, fix in FIXES.items() if sign in str(error))
        raise SceneError(one_line(error), file=path, fix=next(known, "correct the MJCF")) from None


def _count_meshes_exactly(spec: mujoco.MjSpec) -> list[mujoco.MjsMesh]:
    """Ask for exact inertia of every mesh that would give mass by MuJoCo's default rule, which overcounts concave meshes;
    returns those meshes."""
    legacy = [mesh for mesh in spec.meshes if mesh.inertia == mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY]
    for mesh in legacy:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    return legacy


def _without_friction(model: mujoco.MjModel) -> list[str]:
    """Contacts of no friction get one dimension: with three and a coefficient of nothing MuJoCo's solver blows up."""
    smooth = (model.geom_friction[:, 0] < LEAST_FRICTION) & (model.geom_condim > 1)
    model.geom_condim[smooth] = 1
    names = ", ".join(repr(name_of(model, GEOM, geom)) for geom in np.flatnonzero(smooth))
    return [f"contact of geoms without friction: condim 1 ({names})"] if names else []


def _make_room(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """MuJoCo keeps no more than the diagonal of the mass matrix for a body whose joints meet its principal axes. Move its
    centre of mass by `OFF`, so that the inertia of the fluid, which couples them, finds room there."""
    changed = False
    for body in spec.bodies:
        index = model.body(body.name).id if body.name else 0
        if index and model.body_simple[index] and model.body_dofnum[index] > 1:
            body.explicitinertial, body.mass = True, model.body_mass[index]
            body.ipos, body.iquat = model.body_ipos[index] + [0.0, 0.0, OFF], model.body_iquat[index]
            body.inertia, body.fullinertia = model.body_inertia[index], np.full(6, np.nan)
            changed = True
    return changed


def mesh_arrays(model: mujoco.MjModel, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and triangles (m, 3) of a mesh asset, in the frame of its geoms."""
    first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    return vertices.astype(float), model.mesh_face[start : start + model.mesh_facenum[mesh]].copy()
