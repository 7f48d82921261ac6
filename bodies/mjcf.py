"""MJCF files to one compiled MuJoCo model, and which of its geoms are wet."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import mujoco
import numpy as np

from bodies.shapes.meshes import open_edges
from bodies.sizes import check_file
from fsi.errors import SceneError
from fsi.scene.model import BodyFile

OFF = 2e-6  # m; MuJoCo overlooks a micrometre
LEAST_FRICTION = 1e-3
GEOM = mujoco.mjtObj.mjOBJ_GEOM


def load_model(files: Mapping[str, BodyFile], gravity: float, source: object) -> tuple[mujoco.MjModel, list[str]]:
    """Compile the body files of a scene into one model; with several files every name gets the prefix `NAME/`.

    gravity [m/s2] is the scene's; source names the scene in errors. Also returns notes on what was decided.
    Raises SceneError for a missing or malformed file and for options that contradict the scene.
    """
    parts = {key: _read(file, gravity, f"bodies.{key}.mjcf", source) for key, file in files.items()}
    path = ", ".join(str(file.mjcf) for file in files.values())
    whole = next(iter(parts.values())) if len(parts) == 1 else _join(parts, source)
    whole.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # else an unstable run would start over
    if mujoco.get_mju_user_warning() is None:  # else MuJoCo writes a log file into the working directory
        mujoco.set_mju_user_warning(lambda text: warnings.warn(f"MuJoCo: {text}", RuntimeWarning, stacklevel=2))
    notes = []
    if whole.option.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        whole.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        notes.append(
            "integrator RK4 replaced by implicitfast: the fluid's inertia and stiff forces are taken implicitly"
        )
    model = _compile(whole, path)
    if _count_meshes_exactly(whole, model):
        model = _compile(whole, path)
        notes.append("mesh geoms: mass and inertia by exact integration (inertia='exact')")
    if _make_room(whole, model):
        model = _compile(whole, path)
    notes += _without_friction(model)
    return model, notes


def start_from_keyframe(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put a model into its keyframe named "start", if it has one: joint positions and velocities at t = 0."""
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "start")
    if key >= 0:
        mujoco.mj_resetDataKeyframe(model, data, key)


def wet_geoms(model: mujoco.MjModel, files: Mapping[str, BodyFile], source: object) -> list[int]:
    """Ids of the wet geoms, file by file: those in its tuple named "wet", or without one all geoms of bodies that move.

    Raises SceneError for an element of the tuple that is no geom.
    """
    geoms = []
    for prefix in [f"{key}/" for key in files] if len(files) > 1 else [""]:
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TUPLE, f"{prefix}wet")
        if index < 0:
            moving = [g for g in range(model.ngeom) if moves(model, model.geom_bodyid[g])]
            geoms += [g for g in moving if name_of(model, GEOM, g).startswith(prefix)]
            continue
        members = slice(model.tuple_adr[index], model.tuple_adr[index] + model.tuple_size[index])
        if (model.tuple_objtype[members] != GEOM).any():
            fix = 'list geoms with objtype="geom"'
            raise SceneError(f"tuple {prefix}wet has an element that is no geom", key="bodies", file=source, fix=fix)
        geoms += model.tuple_objid[members].tolist()
    return geoms


def moves(model: mujoco.MjModel, body: int) -> bool:
    """Whether a body can move relative to the world."""
    return model.body_weldid[body] != 0


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Name of an element of the compiled model."""
    return mujoco.mj_id2name(model, kind, int(index))


def _read(file: BodyFile, gravity: float, key: str, source: object) -> mujoco.MjSpec:
    path = file.mjcf
    if not path.is_file():
        fix = "give the path of an MJCF file, or package://bodies/models/NAME.xml for one that comes with the project"
        raise SceneError(f"no file {str(path)!r}", key=key, file=source, fix=fix)
    check_file(path)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise SceneError(_one_line(error), file=path, fix="correct the MJCF") from None
    option = spec.option
    if option.density or option.viscosity or np.any(option.wind):
        fault, fix = "MuJoCo's own fluid model is on", "remove density, viscosity and wind: the fluid would act twice"
        raise SceneError(fault, key="option", file=path, fix=fix)
    if not np.allclose(option.gravity, (0.0, 0.0, -gravity), rtol=1e-6, atol=1e-9):
        given = " ".join(f"{value:g}" for value in option.gravity)
        fault, fix = f"gravity is {given} m/s2 where the scene has 0 0 {-gravity:g}", "make them the same"
        raise SceneError(fault, key="option", file=path, fix=fix)
    for kind, elements in (("body", spec.bodies), ("geom", spec.geoms), ("joint", spec.joints)):
        for number, element in enumerate(elements):
            element.name = element.name or f"{kind}{number}"
    if option.integrator == mujoco.mjtIntegrator.mjINT_EULER:  # MuJoCo's default
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    _shift(spec, file.position)
    return spec


def _join(parts: Mapping[str, mujoco.MjSpec], source: object) -> mujoco.MjSpec:
    """One specification of several, under the smallest of their time steps; all other options must be the same."""
    options = [part.option for part in parts.values()]
    step = min(option.timestep for option in options)
    for key, part in parts.items():
        part.option.timestep = step
        for field in (name for name in dir(part.option) if not name.startswith("_")):
            if not np.array_equal(getattr(part.option, field), getattr(options[0], field)):
                fault, fix = f"option {field!r} differs from that of the first file", "give all files the same options"
                raise SceneError(fault, key=f"bodies.{key}.mjcf", file=source, fix=fix)
    whole = mujoco.MjSpec()
    whole.option = options[0]
    for key, part in parts.items():
        whole.attach(part, prefix=f"{key}/", frame=whole.worldbody.add_frame())
    return whole


def _shift(spec: mujoco.MjSpec, position) -> None:
    """Move everything in the file's world by `position`."""
    world = spec.worldbody
    elements = [*world.bodies, *world.geoms, *world.sites, *world.cameras, *world.lights, *world.frames]
    free = [element for element in elements if element.frame is None]
    shifted = world.add_frame(pos=position)
    for element in free:
        element.set_frame(shifted)


def _compile(spec: mujoco.MjSpec, path: object) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        fix = "give its geoms mass or density" if "mass and inertia" in str(error) else "correct the MJCF"
        raise SceneError(_one_line(error), file=path, fix=fix) from None


def _count_meshes_exactly(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Ask for exact inertia of every mesh that gives mass by MuJoCo's default rule, which overcounts concave meshes.
    Meshes that are not watertight are left alone: exact integration refuses them with less to go by."""
    changed = False
    for mesh in spec.meshes:
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MESH, mesh.name)
        if mesh.inertia == mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY and open_edges(*mesh_arrays(model, index)) == 0:
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
            changed = True
    return changed


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


def _one_line(error: Exception) -> str:
    return ", ".join(line.strip().removeprefix("Error: ") for line in str(error).splitlines() if line.strip())
