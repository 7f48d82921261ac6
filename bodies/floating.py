"""How the bodies of a scene float in still water: buoyancy in any pose, the pose at rest, and its stability.

A body is cells on a grid of its own frame, so that geoms that overlap count once. A cell at the surface counts in part.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import mujoco
import numpy as np

from fsi.owners import FIRST_BODY
from fsi.particles.displaced import cells
from fsi.protocols import BodyMotion

CELLS = {2: 20_000, 3: 30_000}  # of the box around a body
PASSES = 6000  # of the search for the pose at rest
REST = 1e-4  # acceleration in g at which a body counts as at rest
FEW = 20  # passes in a row
NUDGE = 0.01  # rad, out of a pose at rest that is unstable
FREE = mujoco.mjtJoint.mjJNT_FREE


class Buoyancy(NamedTuple):
    """What still water does to a body: displaced volume [m3], its centre (3,) [m], draft below the level [m], second moments of
    the waterplane about its own centre (2,) [m4] for roll and pitch."""

    volume: float
    centre: np.ndarray
    draft: float
    moments: np.ndarray


class Hull:
    """The cells of a body: `place` (n, 3) [m] in its frame about the centre of mass, `size` (n,) [m3] of what is solid."""

    def __init__(self, solids, motion: BodyMotion, b: int, width: float | None):
        dim = 2 if width is not None else 3
        points, size, self.step = cells(solids, CELLS[dim])
        whole = np.tile(motion.position[b], (len(points), 1))
        whole[:, [0, 2] if dim == 2 else [0, 1, 2]] = points
        self.place = (whole - motion.position[b]) @ motion.rotation[b]
        self.size = size * (1.0 if width is None else width)

    def displaced(self, motion: BodyMotion, b: int, level: float) -> tuple[float, np.ndarray]:
        """Volume and its centre, of `buoyancy`."""
        position, rotation = motion.position[b], motion.rotation[b]
        depth = (level - position[2]) / self.step + 0.5 - self.place @ (rotation[2] / self.step)
        wet = self.size * np.minimum(np.maximum(depth, 0.0), 1.0)
        volume = float(wet.sum())
        return volume, position + (rotation @ (wet @ self.place / volume) if volume > 0.0 else 0.0)

    def buoyancy(self, motion: BodyMotion, b: int, level: float) -> Buoyancy:
        """With the body where it stands."""
        place = motion.position[b] + self.place @ motion.rotation[b].T
        height = (place[:, 2] - level) / self.step
        wet = self.size * np.clip(0.5 - height, 0.0, 1.0)
        volume = float(wet.sum())
        if volume == 0.0:
            return Buoyancy(0.0, motion.position[b].copy(), 0.0, np.zeros(2))
        cut = np.maximum(1.0 - np.abs(height), 0.0)  # of a column: 1 in all, wherever the level is
        area = self.size * cut / self.step
        across = place[:, [1, 0]] - (area @ place[:, [1, 0]] / area.sum() if area.any() else 0.0)
        draft = level - float(place[wet > 0.5 * self.size, 2].min(initial=level)) + 0.5 * self.step
        return Buoyancy(volume, wet @ place / volume, draft, area @ across**2)


class Floating:
    """The bodies of a `BodySet` in still water of this density [kg/m3] up to `level` [m]; `hulls` (b,)."""

    def __init__(self, bodies, insides: dict, density: float, level: float, width: float | None):
        self._bodies, self._level = bodies, level
        motion = bodies.motion()
        gravity = float(np.linalg.norm(bodies.model.opt.gravity))
        self.density, self.gravity = density, gravity
        self.hulls = []
        for b in range(len(bodies.names)):
            own = [solid for owner, solid in bodies.solids() if owner == FIRST_BODY + b]
            self.hulls.append(Hull([*own, *insides.get(b, ())], motion, b, width))

    def buoyancies(self, motion: BodyMotion) -> list[Buoyancy]:
        return [hull.buoyancy(motion, b, self._level) for b, hull in enumerate(self.hulls)]

    def settle(self, extra, moving: np.ndarray, reach: float) -> np.ndarray | None:
        """Joint positions (nq,) at which the bodies rest, None where there are none within a rise or fall of `reach` [m].
        `extra(data)` gives joint forces (nv,)
        besides those of the file, and only the degrees of freedom `moving` (nv,) leave their place.

        The bodies move without resistance, and stop whenever their kinetic energy falls (kinetic damping, Cundall 1976)."""
        model, ids = copy(self._bodies.model), self._bodies.ids
        trial = mujoco.MjData(model)
        source = self._bodies.data
        trial.qpos[:], trial.ctrl[:], trial.act[:] = source.qpos, source.ctrl, source.act
        trial.mocap_pos[:], trial.mocap_quat[:] = source.mocap_pos, source.mocap_quat
        size = max(hull.step for hull in self.hulls) * 10
        model.opt.timestep = min(model.opt.timestep * 5, 0.05 * np.sqrt(size / self.gravity))
        model.dof_damping[:] = 0.0
        mujoco.mj_fwdPosition(model, trial)
        mujoco.mj_integratePos(model, trial.qpos, NUDGE * (_tilting(model, trial) & moving), 1.0)
        calm, before, start = 0, 0.0, source.xipos[ids, 2].copy()
        for _ in range(PASSES):
            mujoco.mj_fwdPosition(model, trial)
            if np.abs(trial.xipos[ids, 2] - start).max() > reach:
                return None
            motion = self._motion(trial, ids)
            trial.xfrc_applied[ids] = self.wrenches(motion)
            trial.qfrc_applied[:] = extra(trial)
            mujoco.mj_step(model, trial)
            trial.qvel[~moving] = 0.0
            mujoco.mj_energyVel(model, trial)
            if trial.energy[1] < before:
                trial.qvel[:] = 0.0
            before = trial.energy[1] if trial.qvel.any() else 0.0
            speed = float(np.abs(trial.qacc[moving]).max(initial=0.0))
            calm = calm + 1 if speed < REST * self.gravity else 0
            if calm == FEW:
                return trial.qpos.copy()
        return None

    def stiffness(self, extra) -> np.ndarray:
        """How the joint forces of bodies at rest fall with the joint positions (nv, nv), where they stand; `extra` as in
        `settle`."""
        model, ids, nv = copy(self._bodies.model), self._bodies.ids, self._bodies.model.nv
        trial, found = mujoco.MjData(model), np.zeros((nv, nv))
        for dof in range(nv):
            pair = []
            for sign in (-1.0, 1.0):
                trial.qpos[:], trial.ctrl[:], trial.act[:] = (
                    getattr(self._bodies.data, n) for n in ("qpos", "ctrl", "act")
                )
                mujoco.mj_integratePos(model, trial.qpos, sign * np.eye(nv)[dof], NUDGE)
                mujoco.mj_fwdPosition(model, trial)
                trial.xfrc_applied[ids] = self.wrenches(self._motion(trial, ids))
                trial.qfrc_applied[:] = extra(trial)
                mujoco.mj_fwdVelocity(model, trial)
                mujoco.mj_fwdActuation(model, trial)
                mujoco.mj_fwdAcceleration(model, trial)
                pair.append(trial.qfrc_smooth.copy())
            found[:, dof] = (pair[0] - pair[1]) / (2 * NUDGE)
        return found

    @staticmethod
    def _motion(data: mujoco.MjData, ids: np.ndarray) -> BodyMotion:
        nothing = np.empty(0)
        return BodyMotion(data.xipos[ids], data.xmat[ids].reshape(-1, 3, 3), nothing, nothing, nothing)

    def wrenches(self, motion: BodyMotion) -> np.ndarray:
        """Buoyancy as wrenches (b, 6)."""
        wrenches = np.zeros((len(self.hulls), 6))
        for b, hull in enumerate(self.hulls):
            volume, centre = hull.displaced(motion, b, self._level)
            force = np.array([0.0, 0.0, self.density * self.gravity * volume])
            wrenches[b, :3], wrenches[b, 3:] = force, np.cross(centre - motion.position[b], force)
            if self._bodies.dimension == 2:
                wrenches[b, [1, 3, 5]] = 0.0
        return wrenches


def _tilting(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The degrees of freedom (nv,) that turn bodies about axes that are not vertical."""
    return np.abs(data.cdof[:, :2]).max(axis=1, initial=0.0) > 0.1


def facts(floating: Floating, bodies) -> dict[str, dict[str, float]]:
    """The figures of each body where it stands, SI units. `mass` is with the dry bodies that hang on it (`_carried`); heights
    are z in the tank, `heel` is in degrees. One wet body that floats freely has a `metacentric_height`, for pitch, and in three
    dimensions a `metacentric_height_roll`."""
    motion, found, model, data = bodies.motion(), {}, bodies.model, bodies.data
    roots, owner = model.body_rootid[bodies.ids], _carried(bodies)
    for b, (name, one) in enumerate(zip(bodies.names, floating.buoyancies(bodies.motion()), strict=True)):
        turn, mass = motion.rotation[b], np.where(owner == b, model.body_mass, 0.0)
        middle = float(mass @ data.xipos[:, 2] / mass.sum()) if mass.any() else float(motion.position[b, 2])
        found[name] = {
            "mass": float(mass.sum()),
            "displaced_mass": floating.density * one.volume,
            "draft": one.draft,
            "centre_of_mass": middle,
            "centre_of_buoyancy": float(one.centre[2]),
            "heel": float(np.degrees(np.arccos(np.clip(turn[2, 2], -1.0, 1.0)))),
        }
        free = model.body_jntnum[roots[b]] == 1 and model.jnt_type[model.body_jntadr[roots[b]]] == FREE
        if one.volume > 0 and free and (roots == roots[b]).sum() == 1:
            heights = one.moments / one.volume - (middle - one.centre[2])
            found[name]["metacentric_height"] = float(heights[1])
            if bodies.dimension == 3:
                found[name]["metacentric_height_roll"] = float(heights[0])
    return found


def _carried(bodies) -> np.ndarray:
    """The wet body that each body of the model counts for (nbody,): itself, else the nearest above it, else the first of its
    tree; -1 without any."""
    model, ids = bodies.model, list(bodies.ids)
    owner = np.full(model.nbody, -1)
    for body in range(1, model.nbody):
        above = owner[model.body_parentid[body]]
        owner[body] = ids.index(body) if body in ids else above
    for body in np.flatnonzero(owner < 0):
        owner[body] = next((b for b, n in enumerate(ids) if model.body_rootid[n] == model.body_rootid[body]), -1)
    return owner
