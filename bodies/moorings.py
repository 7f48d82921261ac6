"""Mooring lines by MoorPy, quasi-static: at every instant each line hangs as it would at rest between its ends.

The line is an elastic catenary (Jonkman 2007, NREL/TP-500-41958, eq. 2-35 ff., as in MoorPy), on a flat bed where it reaches
the tank's floor; without weight it is a straight spring that only pulls. Water drag, inertia of the line and friction on the
bed are not in. Over a step of the fluid the force is linear in the position of the bodies,

    f = J^T (F0 - K J dq),

with the force F0 and the stiffness K of each line at its start; MuJoCo takes as many substeps as its frequency asks for.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from bodies.mjcf import moves, name_of
from fsi.errors import RunError, SceneError
from fsi.extras import require
from fsi.scene.model import Mooring, Scene

NEAR = 1e-3  # of the line's length: ends that close to the floor lie on it, and ends that close to a vertical hang
SWING = 0.5  # dt omega of the fastest oscillation on the lines
MOST = 200  # substeps
BODY, SITE = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE


class Line:
    """One line: `weight` in water [N/m], its end on `body` at `point` (3,) in the body's own frame."""

    def __init__(self, name: str, settings: Mooring, body: int, point: np.ndarray, weight: float, floor: float):
        self.name, self.body, self.point = name, body, point
        self._anchor, self._length, self._stretch = np.array(settings.anchor), settings.length, settings.EA
        self._weight, self._floor = weight, floor
        height = self._anchor[2] - floor
        self._above = height if height > NEAR * settings.length else 0.0
        self._last: tuple[bytes, np.ndarray, np.ndarray] | None = None

    def place(self, data: mujoco.MjData) -> np.ndarray:
        """Where its fairlead is (3,) [m]."""
        return data.xpos[self.body] + data.xmat[self.body].reshape(3, 3) @ self.point

    def slack(self, data: mujoco.MjData) -> str:
        """A note where it is a spring whose ends are nearer to each other than it is long; empty elsewhere."""
        apart = float(np.linalg.norm(self.place(data) - self._anchor))
        if self._weight or apart >= self._length * (1 - NEAR):
            return ""
        return (
            f"mooring {self.name!r} has no weight and is {self._length:g} m long between ends {apart:.4g} m apart: "
            "it pulls only once they are farther apart than that"
        )

    def pull(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force on a fairlead at `place` (3,) [N] and its stiffness -dF/dx (3, 3) [N/m]. Raises RunError where there is no such
        line."""
        if self._last is None or self._last[0] != place.tobytes():
            self._last = place.tobytes(), *(self._spring(place) if self._weight == 0.0 else self._catenary(place))
        return self._last[1], self._last[2]

    def _spring(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        way = place - self._anchor
        length = float(np.linalg.norm(way))
        if length <= self._length:
            return np.zeros(3), np.zeros((3, 3))
        along, tension = way / length, self._stretch * (length / self._length - 1)
        straight = np.outer(along, along)
        return -tension * along, self._stretch / self._length * straight + tension / length * (np.eye(3) - straight)

    def _catenary(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from moorpy.Catenary import catenary

        way = place - self._anchor
        across, height = float(np.hypot(way[0], way[1])), float(way[2])
        along = np.array([way[0] / across, way[1] / across, 0.0]) if across > 0 else np.array([1.0, 0.0, 0.0])
        if place[2] < self._floor - NEAR * self._length:
            raise RunError(
                f"mooring line {self.name!r}: its fairlead is at z = {place[2]:.3g} m, below the tank's floor"
            )
        height = max(height, -self._above)
        bed = -self._above if self._above else 0.0
        try:
            _, _, side, up, more = catenary(across, height, self._length, self._stretch, self._weight, CB=bed, Tol=1e-8)
        except Exception as fault:  # of any kind: MoorPy's
            where = f"{across:.4g} m aside and {height:.4g} m up, length {self._length:g} m"
            raise RunError(f"mooring line {self.name!r}: MoorPy finds no catenary ({where}): {fault}") from fault
        up_axis = np.array([0.0, 0.0, 1.0])
        aside = np.cross(up_axis, along)
        k = np.asarray(more["stiffnessB"])
        turn = np.array([along, up_axis])
        stiffness = turn.T @ k @ turn + np.outer(aside, aside) * (-side / across if across > 0 else k[0, 0])
        return side * along + up * up_axis, stiffness


class Moorings:
    """The lines of all bodies of a model; `names` in the order of their tensions."""

    def __init__(self, model: mujoco.MjModel, lines: list[Line]):
        self._model, self._lines = model, lines
        self.names = tuple(line.name for line in lines)

    def slack(self, data: mujoco.MjData) -> list[str]:
        """A note on each line that does not pull at the start."""
        return [note for line in self._lines if (note := line.slack(data))]

    def tensions(self, data: mujoco.MjData) -> np.ndarray:
        """At the fairleads (lines,) [N]."""
        return np.array([np.linalg.norm(line.pull(line.place(data))[0]) for line in self._lines])

    def forces(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Joint force (nv,) and joint stiffness (nv, nv) where the bodies stand."""
        nv = self._model.nv
        force, stiffness = np.zeros(nv), np.zeros((nv, nv))
        for line in self._lines:
            place, jacobian = line.place(data), np.zeros((3, nv))
            mujoco.mj_jac(self._model, data, jacobian, None, place, line.body)
            pull, k = line.pull(place)
            force += jacobian.T @ pull
            stiffness += jacobian.T @ k @ jacobian
        return force, stiffness

    def add_wrenches(self, data: mujoco.MjData) -> None:
        """Add the lines to the external forces on the bodies, for sensors."""
        for line in self._lines:
            place = line.place(data)
            pull = line.pull(place)[0]
            data.xfrc_applied[line.body, :3] += pull
            data.xfrc_applied[line.body, 3:] += np.cross(place - data.xipos[line.body], pull)


def substeps(dt: float, stiffness: np.ndarray, inertia: np.ndarray) -> int:
    """MuJoCo steps that a step of dt [s] needs on lines of this joint stiffness (nv, nv)."""
    values = np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).real
    return min(MOST, math.ceil(dt * math.sqrt(max(float(values.max()), 0.0)) / SWING))


def moorings_of(model: mujoco.MjModel, data: mujoco.MjData, scene: Scene, source: object) -> Moorings | None:
    """The lines of a scene, with the bodies as drawn; None without. Raises SceneError for a line that cannot be made."""
    lines = []
    for key, file in scene.bodies.items():
        prefix = f"{key}/" if len(scene.bodies) > 1 else ""
        for name, one in file.moorings.items():
            lines.append(
                _line(model, data, scene, prefix, f"bodies.{key}.moorings.{name}", f"{prefix}{name}", one, source)
            )
    if not lines:
        return None
    require("moorpy", "moorings", "a scene with mooring lines")
    return Moorings(model, lines)


def _line(model, data, scene: Scene, prefix: str, key: str, name: str, one: Mooring, source: object) -> Line:
    body, place = _fairlead(model, data, prefix, key, one, source)
    floor = scene.tank.min[-1]
    if one.anchor[2] < floor - NEAR * one.length:
        fix = f"put it at z = {floor:g} m or above"
        raise SceneError(
            f"z = {one.anchor[2]:g} m is below the tank's floor", key=f"{key}.anchor", file=source, fix=fix
        )
    weight = (one.mass - scene.fluid.density * math.pi * one.diameter**2 / 4) * scene.gravity
    if weight < -1e-9 * scene.gravity:
        fix = "give it mass, or a smaller diameter; without mass and diameter it is a straight spring"
        raise SceneError(f"the line weighs {weight:.3g} N/m in water: it floats", key=key, file=source, fix=fix)
    span = float(np.linalg.norm(place - one.anchor))
    if span > 1.2 * one.length:
        fault = f"anchor and fairlead are {span:.4g} m apart, 1.2 times the length of {one.length:g} m or more"
        raise SceneError(fault, key=f"{key}.length", file=source, fix="give the unstretched length of the line")
    point = data.xmat[body].reshape(3, 3).T @ (place - data.xpos[body])
    return Line(name, one, body, point, max(weight, 0.0), floor)


def _fairlead(model, data, prefix: str, key: str, one: Mooring, source: object) -> tuple[int, np.ndarray]:
    """The body that a line holds, and where (3,) [m]."""
    moving = {name_of(model, BODY, b): b for b in range(1, model.nbody) if moves(model, b)}
    moving = {name.removeprefix(prefix): b for name, b in moving.items() if name.startswith(prefix)}
    if isinstance(one.fairlead, str):
        site = mujoco.mj_name2id(model, SITE, prefix + one.fairlead)
        if site < 0:
            names = [mujoco.mj_id2name(model, SITE, s) or "" for s in range(model.nsite)]
            known = ", ".join(n.removeprefix(prefix) for n in names if n.startswith(prefix)) or "none"
            fix = f"sites of the file: {known}; or give a point [x, y, z] of the tank"
            raise SceneError(f"no site {one.fairlead!r}", key=f"{key}.fairlead", file=source, fix=fix)
        body, place = int(model.site_bodyid[site]), data.site_xpos[site].copy()
    else:
        place = np.array(one.fairlead)
        if (one.body is None and len(moving) != 1) or (one.body is not None and one.body not in moving):
            fault = f"no body {one.body!r} that moves" if one.body else f"the file has {len(moving)} bodies that move"
            raise SceneError(fault, key=f"{key}.body", file=source, fix=f"name one of {', '.join(moving) or 'none'}")
        body = moving[one.body] if one.body else next(iter(moving.values()))
    if not moves(model, body):
        fix = "use a site of a body that moves"
        raise SceneError(f"site {one.fairlead!r} does not move", key=f"{key}.fairlead", file=source, fix=fix)
    return body, place
