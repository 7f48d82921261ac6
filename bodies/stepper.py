"""MuJoCo steps of bodies that carry the added inertia of a fluid.

Over a step the joint force of the fluid falls with the joint acceleration a (nv,) as J^T F0 - Ma (a - a0), so that

    (M + Ma) a = tau(q, qd) + J^T F0 + Ma a0.

The symmetric part of Ma goes into MuJoCo's mass matrix where that has an entry: for the joints of one body and for those
along one branch of a tree. Its constraint solver then finds limits, contacts and friction for the inertia of body and
fluid together. The rest, between bodies of different trees, and an antisymmetric part, which comes from a pressure that is
not solved to the end, enters as an applied force that depends on a and is iterated: without contact or limit the map is
affine and one Newton correction is exact, Broyden's updates (Broyden 1965, doi:10.1090/S0025-5718-1965-0198670-6) follow
the kinks that constraints bring.
"""

from __future__ import annotations

import mujoco
import numpy as np

from bodies.moorings import substeps as needed
from bodies.penetration import Penetration
from bodies.pto import PowerTakeOffs
from bodies.stiff import StiffForces, out_of_plane
from fsi.errors import RunError

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
LEAST = 0.5  # share of the own inertia that a measured added inertia may take away: less than that is noise
PASSES, SLOW = 12, 40  # at most, of the quick and of the safe iteration of one substep


class Stepper:
    """Advances one MuJoCo model, in the `plane` y = 0 if asked to; `notes` says what was decided, `unsettled` counts
    substeps that did not converge."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        ptos: PowerTakeOffs,
        tolerance: float = 1e-6,
        plane: bool = False,
    ):
        self.model, self.data, self.tolerance = model, data, tolerance
        self.notes: dict[str, str] = {}
        self.unsettled = 0
        self.ptos, self.moorings = ptos, None
        self._stiff = StiffForces(model, ptos, self.notes)
        if plane:
            self._stiff.fixed = out_of_plane(model, data)
            model.opt.tolerance *= 1e-6  # measured by the mass matrix, with what holds the plane in it
        self._entries = np.repeat(np.arange(model.nv), model.M_rownnz), model.M_colind[: len(data.M)].copy()
        self.penetration = Penetration(model)
        self._scratch = mujoco.MjData(model)
        self._time_step = model.opt.timestep
        self._armature = model.dof_armature.copy()
        self._weight = np.linalg.norm(model.opt.gravity) ** 2 * model.body_mass.sum()
        self.refresh()

    @property
    def fixed(self) -> np.ndarray:
        """The degrees of freedom (nv,) that lead out of the plane."""
        return self._stiff.fixed

    def advance(self, dt: float, bodies: np.ndarray, wrench: np.ndarray, added: np.ndarray, a0: np.ndarray):
        """Step by dt [s] under the wrench (b, 6) on `bodies` (b,) at their centres of mass, world frame, with the added
        inertia (nv, nv) about the joint acceleration a0 (nv,). Returns the mean joint acceleration (nv,).

        Raises RunError where a force is not finite or an acceleration beyond what MuJoCo takes for stable.
        """
        data, model = self.data, self.model
        if not (np.isfinite(wrench).all() and np.isfinite(added).all()):
            raise RunError("unstable: the force of the fluid on the bodies is not finite")
        own = self.inertia()
        added = bounded(added, own)
        before = data.qvel.copy()
        data.xfrc_applied[bodies] = wrench
        diagonal, load, inertia = added.diagonal(), added @ a0, (own + added).diagonal()
        within, coupling = self._split(added)
        self._carry(diagonal)
        substeps = self._stiff.substeps(dt, data)
        lines = None
        if self.moorings:
            lines = (data.qpos.copy(), *self.moorings.forces(data))
            substeps = max(substeps, needed(dt, lines[2], own + added))
        model.opt.timestep = dt / substeps
        armature, drag = self._stiff.implicit(dt / substeps, inertia)
        self._carry(diagonal + armature)
        for _ in range(substeps):
            force = -drag * data.qvel
            if self.ptos.any:
                carried, force = self._stiff.pulled(dt / substeps, data, inertia, armature, force)
                self._carry(diagonal + carried)
            if lines:
                force += self._lines(*lines)
            self._substep(load + force, within, coupling, a0)
            self.penetration.watch(data)
        data.xfrc_applied[bodies] = 0.0
        data.qfrc_applied[:] = 0.0
        if self.ptos.any:
            self.ptos.note(data, self._stiff.holding)
        self._stiff.restore()
        model.opt.timestep = self._time_step
        self._carry(np.zeros(model.nv))
        self.refresh()
        self.penetration.watch(data)
        acceleration = (data.qvel - before) / dt
        if not (np.abs(acceleration) < mujoco.mjMAXVAL).all():
            raise RunError("unstable: the bodies accelerate without bound; try a smaller numerics.courant")
        return acceleration

    def _lines(self, start: np.ndarray, force: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Joint force (nv,) of the mooring lines, linear about the joint positions at the start of the step."""
        way = np.zeros(self.model.nv)
        mujoco.mj_differentiatePos(self.model, way, 1.0, start, self.data.qpos)
        return force - stiffness @ way

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

    def sense(self, bodies: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Readings of the model's sensors where everything stands now, under the wrench (b, 6) on `bodies`. Force and
        torque sensors see it, since MuJoCo counts `xfrc_applied` among the external forces."""
        return self._forward(bodies, wrench).sensordata.copy()

    def expose(self, bodies: np.ndarray, wrench: np.ndarray) -> None:
        """Put these readings, and the joint accelerations under that load, into the data, where no step reads them."""
        now = self._forward(bodies, wrench)
        self.data.sensordata[:], self.data.qacc[:] = now.sensordata, now.qacc

    def _forward(self, bodies: np.ndarray, wrench: np.ndarray) -> mujoco.MjData:
        """MuJoCo's `mj_forward` of where everything stands now, beside the data of the run."""
        trial = self._scratch
        mujoco.mj_setState(self.model, trial, self._state(), STATE)
        trial.xfrc_applied[bodies] = wrench
        trial.qfrc_applied[:] = self.ptos.driving
        if self.moorings:
            mujoco.mj_kinematics(self.model, trial)
            mujoco.mj_comPos(self.model, trial)
            self.moorings.add_wrenches(trial)
        mujoco.mj_forward(self.model, trial)
        return trial

    def state(self) -> dict:
        """MuJoCo's integration state (with its warm start), what power take-offs remember, the penetration so far, and
        what was decided."""
        return {
            "mujoco": self._state(),
            "ptos": self.ptos.state,
            "pto_force": self.ptos.force.copy(),
            "penetration": self.penetration.state.copy(),
            "unsettled": self.unsettled,
            "notes": dict(self.notes),
        }

    def restore(self, state: dict) -> None:
        """Go back to a state. Raises ValueError where it is one of another model."""
        if state["mujoco"].size != mujoco.mj_stateSize(self.model, STATE):
            raise ValueError("the state is one of another MuJoCo model, or of another version of MuJoCo")
        mujoco.mj_setState(self.model, self.data, state["mujoco"], STATE)
        self.ptos.state = state["ptos"]
        self.ptos.force[:], self.penetration.state[:] = state["pto_force"], state["penetration"]
        self.unsettled = state["unsettled"]
        self.notes.clear()
        self.notes.update(state["notes"])
        self.refresh()

    def _state(self) -> np.ndarray:
        state = np.empty(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def _carry(self, inertia: np.ndarray) -> None:
        """Add inertia (nv,) to the joints. `mj_setConst` is needed for armature to count on simple joints, and keeps limits
        and contacts as hard as they are without it."""
        wanted = self._armature + inertia
        if (self.model.dof_armature != wanted).any():
            self.model.dof_armature[:] = wanted
            mujoco.mj_setConst(self.model, self._scratch)

    def _split(self, added: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """What of an added inertia goes into the entries of the mass matrix beside its diagonal, and what is left to couple
        the joints (nv, nv); None where that is nothing."""
        row, column = self._entries
        symmetric = (added + added.T) / 2
        within = np.where(row == column, 0.0, symmetric[row, column])
        coupling = added - np.diag(added.diagonal())
        coupling[row, column] -= within
        coupling[column, row] -= within
        return within, coupling if coupling.any() else None

    def _substep(self, load: np.ndarray, within: np.ndarray, coupling: np.ndarray | None, a0: np.ndarray) -> None:
        """One MuJoCo step under a joint force (nv,), with an added inertia that is split (`_split`) and has its diagonal in
        the model."""
        data = self.data
        if coupling is None:
            data.qfrc_applied[:] = load
            self._step(within)
            return
        start = self._state()
        if not self._chase(start, load, coupling, a0, within) and not self._creep(start, load, coupling, a0, within):
            self.unsettled += 1
            self.notes["unsettled"] = f"{self.unsettled} substeps did not settle the added inertia within {SLOW} passes"

    def _chase(self, start, load, coupling, a0, within) -> bool:
        """Settle the acceleration by Broyden's method; whether that succeeded."""
        guess = a0.copy()
        residual, inertia = self._trial(start, load - coupling @ guess, guess, within)
        implicit = inertia + self.model.opt.timestep * np.diag(self.model.dof_damping)
        inverse = np.linalg.solve(implicit + coupling, implicit)
        for _ in range(PASSES):
            step = inverse @ residual
            guess, last = guess + step, residual
            residual, inertia = self._trial(start, load - coupling @ guess, guess, within)
            if self._settled(residual, guess, inertia):
                return True
            inverse = _broyden(inverse, step, residual - last)
        return False

    def _creep(self, start, load, coupling, a0, within) -> bool:
        """The same where contacts come and go, by steps that lead nearer each time: the mass matrix takes a diagonal that
        outweighs the coupling, and gives it back with the last acceleration. Constraints do not undo that, for what they
        make of a change of force is no more than its change of acceleration without them."""
        guess, (row, column) = a0.copy(), self._entries
        scale = np.sqrt(np.diag(self.inertia()))
        extra = np.abs(coupling + coupling.T) / 2 @ (1 / scale) * scale if coupling.size else np.zeros(0)
        heavier, rest = within + np.where(row == column, extra[row], 0.0), coupling - np.diag(extra)
        for _ in range(SLOW):
            residual, inertia = self._trial(start, load - rest @ guess, guess, heavier)
            guess = guess + residual
            if self._settled(residual, guess, inertia):
                return True
        return False

    def _settled(self, residual: np.ndarray, guess: np.ndarray, inertia: np.ndarray) -> bool:
        limit = guess @ inertia @ guess + self._weight + np.finfo(float).tiny
        return residual @ inertia @ residual <= self.tolerance**2 * limit

    def _trial(
        self, start: np.ndarray, force: np.ndarray, guess: np.ndarray, within: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Step from the state `start` under a joint force (nv,): realised minus guessed acceleration, mass matrix."""
        model, data = self.model, self.data
        mujoco.mj_setState(model, data, start, STATE)
        before = data.qvel.copy()
        data.qfrc_applied[:] = force
        self._step(within)
        return (data.qvel - before) / model.opt.timestep - guess, self.inertia()

    def _step(self, within: np.ndarray) -> None:
        """MuJoCo's step with `within` added to the entries of its mass matrix."""
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        data.M[:] += within
        mujoco.mj_factorM(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_fwdVelocity(model, data)
        if (control := mujoco.get_mjcb_control()) is not None:
            control(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        mujoco.mj_implicit(model, data)


def bounded(added: np.ndarray, own: np.ndarray) -> np.ndarray:
    """A measured added inertia (n, n) whose symmetric part takes away no more than the share `LEAST` of the mass matrix
    `own` (n, n), in any direction. The antisymmetric part, of a pressure that was not solved to the end, does no work.
    All else stays as measured, for the fluid's answer will be just that."""
    symmetric = (added + added.T) / 2
    try:
        np.linalg.cholesky(symmetric + LEAST * own)
        return added
    except np.linalg.LinAlgError:  # it takes away more in some direction
        root = np.linalg.cholesky(own)
    values, vectors = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, symmetric).T))
    vectors = root @ vectors
    return (vectors * np.maximum(values, -LEAST)) @ vectors.T + (added - added.T) / 2


def _broyden(inverse: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Broyden's update of `inverse`, the negative inverse Jacobian of a residual: inverse @ change = -step."""
    image = inverse @ change
    norm = step @ image
    if norm == 0.0:
        return inverse
    return inverse - np.outer(step + image, step @ inverse) / norm
