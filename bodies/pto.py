"""Power take-offs: forces along hinge and slide joints beside those of the MJCF file.

Each kind gives the force f(t, x, v) on its joint and how fast that falls with position and velocity, k = -df/dx and
c = -df/dv; `bodies.implicit` takes f at the end of the step with them, so that no spring or damper is too stiff.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from fsi.errors import RunError, SceneError
from fsi.scene.model import BodyFile, CoulombPto, LatchingPto, LinearPto, PythonPto, TablePto
from fsi.tables import read_table
from fsi.user_code import load

FRICTIONLESS = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
NUDGE = 1e-6  # of position and velocity, for the slopes of a user's function


class Pull(NamedTuple):
    """Force [N or N m] on a joint, its slopes -df/dx and -df/dv, and whether the joint is held where it is."""

    force: float
    stiffness: float = 0.0
    damping: float = 0.0
    held: bool = False


class Linear:
    """f = -damping v - stiffness (x - rest)."""

    def __init__(self, settings: LinearPto):
        self._damping, self._stiffness, self._rest = settings.damping, settings.stiffness, settings.rest

    def pull(self, time: float, x: float, v: float) -> Pull:
        force = -self._damping * v - self._stiffness * (x - self._rest)
        return Pull(force, self._stiffness, self._damping)


class Latching(Linear):
    """A linear power take-off that holds the joint for `hold` seconds at the end of each swing.

    `state` (2,): the time up to which it holds, and the velocity of largest magnitude since.
    """

    def __init__(self, settings: LatchingPto):
        super().__init__(settings)
        self._hold, self._least = settings.hold, settings.least_speed
        self.state = np.array([-np.inf, 0.0])

    def pull(self, time: float, x: float, v: float) -> Pull:
        return super().pull(time, x, v)._replace(held=time < self.state[0])

    def watch(self, time: float, v: float) -> None:
        """Hold from now on if the velocity has just changed sign."""
        until, fastest = self.state
        if time < until:
            return
        if abs(fastest) >= self._least and v * fastest <= 0.0:
            self.state[:] = time + self._hold, 0.0
        elif abs(v) > abs(fastest):
            self.state[1] = v


class Table:
    """Force by velocity, linear between the rows of a table and beyond its ends."""

    def __init__(self, settings: TablePto):
        self._velocity, self._force = _read_table(settings.file)
        self._slope = np.diff(self._force) / np.diff(self._velocity)

    def pull(self, time: float, x: float, v: float) -> Pull:
        n = self._row(v)
        force = self._at(n, v)
        return Pull(force, 0.0, _steepest(-self._slope[n], force, self._at(self._row(0.0), 0.0), v))

    def drives(self) -> str:
        """Where the table pushes the joint along its motion, empty where it nowhere does."""
        v, rest = self._velocity, self._at(self._row(0.0), 0.0)
        power = (self._force - rest) * v
        if not (power > 0).any():
            return ""
        row = int(power.argmax())
        force = f"{self._force[row]:g} at the velocity {v[row]:g}"
        return f"the force {force} drives the joint; one that absorbs has the other sign"

    def _row(self, v: float) -> int:
        return int(np.clip(np.searchsorted(self._velocity, v) - 1, 0, len(self._slope) - 1))

    def _at(self, n: int, v: float) -> float:
        return self._force[n] + self._slope[n] * (v - self._velocity[n])


class Python:
    """A user's function of (time, position, velocity), slopes by central differences."""

    def __init__(self, settings: PythonPto, function: Callable[[float, float, float], float]):
        self._name, self._call = str(settings.function), function
        self._given: list[tuple[tuple[float, float, float], float]] = []  # the first and the latest (t, x, v) and force
        self._force(0.0, 0.0, 0.0)

    def pull(self, time: float, x: float, v: float) -> Pull:
        f = self._force
        self._check_memory()
        self._given[1:] = [((time, x, v), f(time, x, v))]
        stiffness = (f(time, x - NUDGE, v) - f(time, x + NUDGE, v)) / (2 * NUDGE)
        damping = (f(time, x, v - NUDGE) - f(time, x, v + NUDGE)) / (2 * NUDGE)
        force = f(time, x, v)
        if force != self._given[-1][1]:
            self._check_memory()
        return Pull(force, stiffness, _steepest(damping, force, f(time, x, 0.0), v))

    def _check_memory(self) -> None:
        """A function that remembers answers an earlier question differently. Steps are repeated and runs are resumed without
        what it remembers, so that it would give wrong answers."""
        for asked, answer in self._given:
            if (now := self._force(*asked)) != answer:
                place = f"{self._name}({', '.join(f'{value:g}' for value in asked)})"
                raise RunError(
                    f"{place} gave {answer:g} and later {now:g}: it remembers, and steps are repeated; "
                    "let it follow from time, position and velocity alone, or use kind = 'latching'"
                )

    def _force(self, time: float, x: float, v: float) -> float:
        try:
            force = float(self._call(time, x, v))
        except Exception as fault:  # of any kind: it is the user's code
            raise RunError(f"{self._name}({time:g}, {x:g}, {v:g}): {type(fault).__name__}: {fault}") from fault
        if not math.isfinite(force):
            raise RunError(f"{self._name}({time:g}, {x:g}, {v:g}) returned {force}; it must return a finite force")
        return force


class Unread:
    """Stands for a user's function where a scene is checked and no code of it runs: no force."""

    def pull(self, time: float, x: float, v: float) -> Pull:
        return Pull(0.0)


def _steepest(slope: float, force: float, at_rest: float, v: float) -> float:
    """Damping: the slope at the velocity v, or that of the chord to rest where it is steeper. With the chord a force that
    drops to its value at rest within the step does not reverse the motion."""
    return max(slope, (at_rest - force) / v) if v else slope


class PowerTakeOffs:
    """The power take-offs of a model, by degree of freedom; `dofs` (n,) are those with one.

    A Coulomb force is left to MuJoCo's friction loss, whose solver knows sticking and slipping; `model` is told so.
    """

    def __init__(self, model: mujoco.MjModel, settings: Mapping[int, object], keys: Mapping[int, str], source: object):
        self.model = model
        self._kinds = {}
        self.notes: list[str] = []
        self._friction = {}  # dof -> share of the joint's friction that is the power take-off's
        for joint, chosen in settings.items():
            dof = int(model.jnt_dofadr[joint])
            if isinstance(chosen, CoulombPto):
                if model.opt.disableflags & FRICTIONLESS:
                    fault = (
                        "the MJCF file disables flag constraint or frictionloss, so that a coulomb force has no effect"
                    )
                    raise SceneError(fault, key=keys[joint], file=source, fix="enable the flag")
                own = float(model.dof_frictionloss[dof])
                self._friction[dof] = chosen.force / (own + chosen.force)
                model.dof_frictionloss[dof] = own + chosen.force
                model.dof_solimp[dof, :2] = 0.9999  # a joint that sticks creeps by 1 - this of its free acceleration
            else:
                self._kinds[dof] = kind = _make(chosen, keys[joint], source)
                if isinstance(kind, Unread):
                    self.notes.append(
                        f"{keys[joint]}: {chosen.function} is not run by a check, and its force is taken as 0"
                    )
                if isinstance(kind, Table) and (driven := kind.drives()):
                    self.notes.append(f"{keys[joint]}.file: {driven}")
        self.dofs = np.array(sorted(self._kinds), int)
        self._position = model.jnt_qposadr[model.dof_jntid] if model.nv else np.zeros(0, int)
        self._latching = {dof: kind for dof, kind in self._kinds.items() if isinstance(kind, Latching)}
        self.force = np.zeros(model.nv)  # on the joints now, for the series [N or N m]

    @property
    def any(self) -> bool:
        return bool(self._kinds or self._friction)

    @property
    def driving(self) -> np.ndarray:
        """Their force (nv,) without what MuJoCo's friction loss adds by itself."""
        driving = self.force.copy()
        driving[list(self._friction)] = 0.0
        return driving

    @property
    def state(self) -> np.ndarray:
        """What they remember (k,)."""
        return np.concatenate([np.zeros(0), *(kind.state for kind in self._latching.values())])

    @state.setter
    def state(self, values: np.ndarray) -> None:
        for kind, own in zip(self._latching.values(), np.reshape(values, (-1, 2)), strict=True):
            kind.state[:] = own

    def pulls(self, data: mujoco.MjData) -> list[Pull]:
        """Force and slopes of each of `dofs` now."""
        for dof, kind in self._latching.items():
            kind.watch(data.time, data.qvel[dof])
        states = ((self._kinds[dof], data.qpos[self._position[dof]], data.qvel[dof]) for dof in self.dofs)
        return [kind.pull(data.time, float(x), float(v)) for kind, x, v in states]

    def at_rest(self, data: mujoco.MjData) -> np.ndarray:
        """Their forces (nv,) where the joints stand, without velocity; friction is not in."""
        force = np.zeros(self.model.nv)
        for dof, kind in self._kinds.items():
            force[dof] = kind.pull(data.time, float(data.qpos[self._position[dof]]), 0.0).force
        return force

    def note(self, data: mujoco.MjData, holding: np.ndarray) -> None:
        """Keep the forces after a step for the series. holding (nv,): damping of the joints that are held [N s/m]; the
        constraint forces in `data` are still those of the step."""
        for dof, kind in self._kinds.items():
            x, v = float(data.qpos[self._position[dof]]), float(data.qvel[dof])
            self.force[dof] = -holding[dof] * v if holding[dof] else kind.pull(data.time, x, v).force
        friction = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        rows = {int(data.efc_id[row]): data.efc_force[row] for row in np.flatnonzero(friction)}
        for dof, share in self._friction.items():
            self.force[dof] = share * rows.get(dof, 0.0)


def by_joint(
    model: mujoco.MjModel, files: Mapping[str, BodyFile], joints: Mapping[str, int], source: object
) -> PowerTakeOffs:
    """The power take-offs of a scene's body files; `joints` are the hinge and slide joints, name -> id, with the prefix
    `NAME/` where there are several files. Raises SceneError for a joint that does not exist."""
    settings, keys = {}, {}
    for file, body in files.items():
        prefix = f"{file}/" if len(files) > 1 else ""
        own = {name.removeprefix(prefix): joint for name, joint in joints.items() if name.startswith(prefix)}
        known = ", ".join(own) or "none"
        chosen, key = body.pto, f"bodies.{file}.pto"
        if not isinstance(chosen, Mapping):
            if len(own) != 1:
                fix = f"write it per joint, e.g. [{key}.JOINT]; known hinge and slide joints: {known}"
                raise SceneError(f"the file has {len(own)} joints to choose from", key=key, file=source, fix=fix)
            settings |= dict.fromkeys(own.values(), chosen)
            keys |= dict.fromkeys(own.values(), key)
            continue
        for name, one in chosen.items():
            if name not in own:
                fix = f"known hinge and slide joints: {known}"
                raise SceneError(f"no joint {name!r}", key=f"{key}.{name}", file=source, fix=fix)
            settings[own[name]], keys[own[name]] = one, f"{key}.{name}"
    return PowerTakeOffs(model, settings, keys, source)


def _make(settings: object, key: str, source: object):
    if isinstance(settings, LatchingPto):
        return Latching(settings)
    if isinstance(settings, LinearPto):
        return Linear(settings)
    if isinstance(settings, TablePto):
        return Table(settings)
    function = load(settings.function, key, source)
    return Unread() if function is None else Python(settings, function)


def _read_table(file: Path) -> tuple[np.ndarray, np.ndarray]:
    rows = read_table(file, ("velocity", "force"), 2)
    return rows[:, 0], rows[:, 1]
