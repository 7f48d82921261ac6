"""What a model's springs, dampers, power take-offs and constraints ask of the time step.

Springs and dampers of joints and power take-offs that are too stiff for the step are taken at its end: with the force
f(x, v), k = -df/dx and c = -df/dv of a joint, the linearised implicit Euler step

    (M + dt c + dt^2 k) a = tau + f - dt k v

is MuJoCo's own under an armature dt c + dt^2 k, so that limits and contacts see the true inertia. What cannot be put on
the diagonal of the mass matrix (tendons, actuators, constraints) sets the number of substeps.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from bodies.pto import PowerTakeOffs

SOFT = 0.25  # dt sqrt(k / M) and dt c / M up to which a joint's spring and damper are left to MuJoCo
RIGID = 1e6  # inertia of a joint that is held, relative to its own
SWING = 0.5  # dt omega of the fastest explicit oscillation
MOST = 200  # substeps
OFF = mujoco.mjtDisableBit
JOINT, EQUALITY = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_EQUALITY


class StiffForces:
    """Armature and force (nv,) of what is taken implicitly, and the substeps that the rest needs; `notes` says which."""

    def __init__(self, model: mujoco.MjModel, ptos: PowerTakeOffs, notes: dict[str, str]):
        self.model, self.ptos, self.notes = model, ptos, notes
        self._damping = model.dof_damping.copy()
        self._stiffness = model.jnt_stiffness[model.dof_jntid] if model.nv else np.zeros(0)
        self._damped = not model.opt.disableflags & OFF.mjDSBL_DAMPER
        if model.opt.disableflags & OFF.mjDSBL_SPRING:
            self._stiffness = np.zeros(model.nv)
        self._time_step = model.opt.timestep
        self._fastest = _fastest_constraint(model)
        poly = (model.jnt_stiffnesspoly, model.tendon_stiffness, model.tendon_stiffnesspoly)
        self._explicit = model.nu > 0 or any(values.any() for values in poly)
        self._trial = mujoco.MjData(model) if self._explicit else None
        self.fixed = np.zeros(model.nv, bool)  # degrees of freedom that stay as they are
        self.holding = np.zeros(model.nv)  # damping of the joints that are held

    def substeps(self, dt: float, data: mujoco.MjData) -> int:
        """How many substeps a step of dt [s] needs, with the added inertia in the model."""
        wanted = {"the time step of the MJCF file": dt / self._time_step}
        time, name = self._fastest
        wanted[f"half the time constant of {name}"] = 2 * dt / time
        if self._explicit:
            wanted["tendons and actuators"] = dt * self._frequency(data) / SWING
        reason = max(wanted, key=wanted.get)
        count = max(1, math.ceil(wanted[reason] - 1e-9))
        if count > MOST:
            self.notes.setdefault("most", f"{reason}: would need {count} substeps, {MOST} are taken; make it softer")
        elif count > 1:
            step = dt / wanted[reason]
            self.notes.setdefault(f"substeps {reason}", f"MuJoCo substeps of at most {step:.3g} s, for {reason}")
        return min(count, MOST)

    def implicit(self, dt: float, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Armature (nv,) of what is taken implicitly in substeps of dt [s], power take-offs aside, and how its force falls with
        the velocity (nv,); inertia (nv,) with the fluid's. Takes what it covers out of the model's damping."""
        stiff = dt * np.sqrt(self._stiffness / inertia) > SOFT
        thick = (dt * self._damping / inertia > SOFT) & self._damped
        k, c = np.where(stiff, self._stiffness, 0.0), np.where(thick, self._damping, 0.0)
        self.model.dof_damping[:] = self._damping - c
        self._say(stiff, "spring")
        self._say(thick, "damper")
        armature = dt * (c + dt * k)
        armature[self.fixed] += RIGID * inertia[self.fixed]
        return armature, c + dt * k

    def pulled(self, dt, data, inertia, armature, force) -> tuple[np.ndarray, np.ndarray]:
        """Armature and force (nv,) with those of the power take-offs in a substep of dt [s]."""
        armature, force = armature.copy(), force.copy()
        self._add_power_take_offs(dt, data, inertia, armature, force)
        return armature, force

    def restore(self) -> None:
        """Give the model its own damping back."""
        self.model.dof_damping[:] = self._damping

    def _add_power_take_offs(self, dt, data, inertia, armature, force) -> None:
        for dof, pull in zip(self.ptos.dofs, self.ptos.pulls(data), strict=True):
            v = data.qvel[dof]
            self.holding[dof] = RIGID * inertia[dof] / dt if pull.held else 0.0
            if pull.held:
                armature[dof] += dt * self.holding[dof]
                force[dof] -= self.holding[dof] * v
                continue
            k = pull.stiffness if dt * math.sqrt(max(pull.stiffness, 0.0) / inertia[dof]) > SOFT else 0.0
            armature[dof] += dt * (max(pull.damping, 0.0) + dt * k)
            force[dof] += pull.force - dt * k * v
            if k:
                self._say_one(self.model.dof_jntid[dof], "power take-off")

    def _say(self, which: np.ndarray, what: str) -> None:
        if which.any():
            for joint in np.unique(self.model.dof_jntid[which]):
                self._say_one(joint, what)

    def _say_one(self, joint: int, what: str) -> None:
        if (key := f"{what} {joint}") not in self.notes:
            name = mujoco.mj_id2name(self.model, JOINT, int(joint))
            self.notes[key] = f"joint {name!r}: {what} too stiff for the time step, taken implicitly"

    def _frequency(self, data: mujoco.MjData) -> float:
        """Largest angular frequency [rad/s] of the forces of tendons, actuators and polynomial springs, by central
        differences about the present position."""
        model, trial, nv = self.model, self._trial, self.model.nv
        stiffness, inertia = np.zeros((nv, nv)), np.zeros((nv, nv))
        for dof in range(nv):
            pair = []
            for sign in (-1.0, 1.0):
                trial.qpos[:], trial.qvel[:], trial.ctrl[:], trial.act[:] = data.qpos, data.qvel, data.ctrl, data.act
                mujoco.mj_integratePos(model, trial.qpos, sign * np.eye(nv)[dof], 1e-6)
                mujoco.mj_fwdPosition(model, trial)
                mujoco.mj_fwdVelocity(model, trial)
                mujoco.mj_fwdActuation(model, trial)
                pair.append(trial.qfrc_passive + trial.qfrc_actuator)
            stiffness[:, dof] = (pair[0] - pair[1]) / 2e-6
        mujoco.mj_fullM(model, trial, inertia)
        stiffness -= np.diag(np.where(self._stiffness > 0, np.minimum(self._stiffness, np.diag(stiffness)), 0.0))
        values = np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).real if nv else np.zeros(1)
        return math.sqrt(max(values.max(), 0.0))


def out_of_plane(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The degrees of freedom (nv,) of free joints that lead out of the plane y = 0, in which nothing in a two-dimensional
    fluid holds a body: contacts at its two ends along y would make it tumble. `data` is at the start."""
    mujoco.mj_kinematics(model, data)
    out = np.zeros(model.nv, bool)
    for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
        across = np.abs(data.xmat[model.jnt_bodyid[joint]].reshape(3, 3)[1]) > 1 - 1e-6  # the body's axis along y
        if across.any():
            dof = model.jnt_dofadr[joint]
            out[dof + 1], out[dof + 3 : dof + 6] = True, ~across
    return out


def _fastest_constraint(model: mujoco.MjModel) -> tuple[float, str]:
    """Smallest time constant [s] of a joint limit, contact or equality constraint, and whose it is. MuJoCo takes
    constraints no faster than two steps, and would soften them."""
    found = [(math.inf, "")]
    for j in np.flatnonzero(model.jnt_limited):
        found.append((_time_constant(model.jnt_solref[j]), f"the limit of joint {_name(model, JOINT, j)}"))
    solid = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
    if len(set(model.body_weldid[model.geom_bodyid[solid]])) > 1:
        for g in solid:
            label = f"the contact of geom {_name(model, mujoco.mjtObj.mjOBJ_GEOM, g)}"
            found.append((_time_constant(model.geom_solref[g]), label))
    for e in range(model.neq):
        found.append((_time_constant(model.eq_solref[e]), f"equality constraint {_name(model, EQUALITY, e)}"))
    for t in np.flatnonzero(model.tendon_limited):
        label = f"the limit of tendon {_name(model, mujoco.mjtObj.mjOBJ_TENDON, t)}"
        found.append((_time_constant(model.tendon_solref_lim[t]), label))
    return min(found)


def _time_constant(solref: np.ndarray) -> float:
    """Of MuJoCo's two ways to write it: (time constant, damping ratio), or (-stiffness, -damping) for unit mass."""
    return float(solref[0]) if solref[0] > 0 else 1.0 / math.sqrt(max(-float(solref[0]), 1e-300))


def _name(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    name = mujoco.mj_id2name(model, kind, int(index))
    return repr(name) if name else f"number {index}"
