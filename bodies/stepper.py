"""MuJoCo steps of bodies that carry the added inertia of a fluid.

Over a step the joint force of the fluid falls with the joint acceleration a (nv,) as J^T F0 - Ma (a - a0), so that

    (M + Ma) a = tau(q, qd) + J^T F0 + Ma a0.

MuJoCo takes the diagonal of Ma as `dof_armature`; the rest enters as an applied force that depends on a and is
iterated: without contact or limit the map is affine and one Newton correction is exact, Broyden's updates (Broyden
1965, doi:10.1090/S0025-5718-1965-0198670-6) follow the kinks that constraints bring.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from fsi.errors import RunError

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
STIFF = 0.25  # dt sqrt(k / M) above which a joint spring is taken implicitly
LEAST = 0.5  # share of the own inertia that a measured added inertia may take away: less than that is noise
PASSES = 12  # at most, for the off-diagonal added inertia of one substep


class Stepper:
    """Advances one MuJoCo model; `notes` says what was decided, `unsettled` counts substeps that did not converge."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, tolerance: float = 1e-6):
        self.model, self.data, self.tolerance = model, data, tolerance
        self.notes: dict[str, str] = {}
        self.unsettled = 0
        self._scratch = mujoco.MjData(model)
        self._time_step = model.opt.timestep
        self._armature = model.dof_armature.copy()
        self._damping = model.dof_damping.copy()
        self._stiffness = model.jnt_stiffness[model.dof_jntid] if model.nv else np.zeros(0)
        self._inertia = model.dof_M0.copy()
        self._weight = np.linalg.norm(model.opt.gravity) ** 2 * model.body_mass.sum()
        self.refresh()

    def advance(self, dt: float, bodies: np.ndarray, wrench: np.ndarray, added: np.ndarray, a0: np.ndarray):
        """Step by dt [s] under the wrench (b, 6) on `bodies` (b,) at their centres of mass, world frame, with the added
        inertia (nv, nv) about the joint acceleration a0 (nv,). Returns the mean joint acceleration (nv,).

        Raises RunError where a force is not finite or an acceleration beyond what MuJoCo takes for stable.
        """
        data = self.data
        if not (np.isfinite(wrench).all() and np.isfinite(added).all()):
            raise RunError("unstable: the force of the fluid on the bodies is not finite")
        added = bounded(added, self.inertia())
        substeps = max(1, math.ceil(dt / self._time_step - 1e-9))
        if substeps > 1:
            text = f"MuJoCo substeps of at most {self._time_step:g} s, the time step of the MJCF file"
            self.notes.setdefault("substeps", text)
        before = data.qvel.copy()
        data.xfrc_applied[bodies] = wrench
        self._load(np.diag(added), dt / substeps)
        for _ in range(substeps):
            self._substep(added, a0)
        data.xfrc_applied[bodies] = 0.0
        data.qfrc_applied[:] = 0.0
        self._unload()
        self.refresh()
        acceleration = (data.qvel - before) / dt
        if not (np.abs(acceleration) < mujoco.mjMAXVAL).all():
            raise RunError("unstable: the bodies accelerate without bound; try a smaller numerics.courant")
        return acceleration

    def inertia(self) -> np.ndarray:
        """Mass matrix (nv, nv) where the bodies stand."""
        inertia = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, inertia)
        return inertia

    def refresh(self) -> None:
        """Bring everything that follows from position and velocity up to date (poses, jacobians, passive forces)."""
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        mujoco.mj_fwdActuation(self.model, self.data)

    def _load(self, diagonal: np.ndarray, dt: float) -> None:
        """Put added inertia and implicit springs into the model. `mj_setConst` is needed for armature to count on
        simple joints, and keeps limits and contacts as hard as they are without it."""
        model = self.model
        model.opt.timestep = dt
        model.dof_armature[:] = self._armature + diagonal
        stiff = dt * np.sqrt(self._stiffness / (self._inertia + diagonal)) > STIFF
        model.dof_damping[:] = self._damping + np.where(stiff, dt * self._stiffness, 0.0)
        for joint in np.unique(model.dof_jntid[stiff]):
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
            self.notes.setdefault(
                f"spring {joint}", f"joint {name!r}: spring too stiff for the time step, taken implicitly"
            )
        mujoco.mj_setConst(model, self._scratch)

    def _unload(self) -> None:
        model = self.model
        model.opt.timestep = self._time_step
        model.dof_armature[:] = self._armature
        model.dof_damping[:] = self._damping
        mujoco.mj_setConst(model, self._scratch)

    def _substep(self, added: np.ndarray, a0: np.ndarray) -> None:
        """One MuJoCo step with the off-diagonal added inertia settled."""
        model, data = self.model, self.data
        coupling = added - np.diag(np.diag(added))
        load = added @ a0
        if not coupling.any():
            data.qfrc_applied[:] = load
            mujoco.mj_step(model, data)
            return
        start = np.empty(mujoco.mj_stateSize(model, STATE))
        mujoco.mj_getState(model, data, start, STATE)
        guess = a0.copy()
        residual, inertia = self._trial(start, load - coupling @ guess, guess)
        implicit = inertia + model.opt.timestep * np.diag(model.dof_damping)
        inverse = np.linalg.solve(implicit + coupling, implicit)
        for _ in range(PASSES):
            step = inverse @ residual
            guess, last = guess + step, residual
            residual, inertia = self._trial(start, load - coupling @ guess, guess)
            limit = guess @ inertia @ guess + self._weight + np.finfo(float).tiny
            if residual @ inertia @ residual <= self.tolerance**2 * limit:
                return
            inverse = _broyden(inverse, step, residual - last)
        self.unsettled += 1
        self.notes["unsettled"] = f"{self.unsettled} substeps did not settle the added inertia within {PASSES} passes"

    def _trial(self, start: np.ndarray, force: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step from the state `start` under a joint force (nv,): realised minus guessed acceleration, mass matrix."""
        model, data = self.model, self.data
        mujoco.mj_setState(model, data, start, STATE)
        before = data.qvel.copy()
        data.qfrc_applied[:] = force
        mujoco.mj_step(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        return (data.qvel - before) / model.opt.timestep - guess, inertia


def bounded(added: np.ndarray, own: np.ndarray) -> np.ndarray:
    """A measured added inertia (n, n) whose symmetric part takes away no more than the share `LEAST` of the mass matrix
    `own` (n, n), in any direction. The antisymmetric part, of a pressure that was not solved to the end, does no work.
    All else stays as measured, for the fluid's answer will be just that."""
    symmetric, skew = (added + added.T) / 2, (added - added.T) / 2
    root = np.linalg.cholesky(own)
    values, vectors = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, symmetric).T))
    if values.min(initial=0.0) >= -LEAST:
        return added
    vectors = root @ vectors
    return (vectors * np.maximum(values, -LEAST)) @ vectors.T + skew


def _broyden(inverse: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Broyden's update of `inverse`, the negative inverse Jacobian of a residual: inverse @ change = -step."""
    image = inverse @ change
    norm = step @ image
    if norm == 0.0:
        return inverse
    return inverse - np.outer(step + image, step @ inverse) / norm
