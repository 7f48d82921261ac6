"""Where the joints of bodies can take them, and whether that is through a wall of the tank: no wall holds a body, unless the
MJCF file has a geom there."""

from __future__ import annotations

import mujoco
import numpy as np

from bodies.geoms import triangles
from bodies.mjcf import name_of
from fsi.scene.model import Scene

SAMPLES = 33  # of a joint's range
SLACK = 0.5  # spacings that a body may stand in a wall
SINGLE = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
BODY, JOINT = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT


class Reach:
    """The wet geoms of bodies that move, against the walls of the tank."""

    def __init__(self, model: mujoco.MjModel, geoms: list[int], scene: Scene):
        self._model, self._slack = model, SLACK * scene.spacing
        self._vertices = {geom: triangles(model, geom)[0] for geom in geoms}
        axes = [0, 2] if scene.dimension == 2 else [0, 1, 2]
        ends = [(-1, scene.tank.min), (1, scene.tank.max)]
        sides = [("xyz"[axis], axis, side, end[k]) for k, axis in enumerate(axes) for side, end in ends]
        self._walls = [wall for wall in sides if f"{wall[0]}{'-' if wall[2] < 0 else '+'}" in scene.tank.walls]
        self._crossed: dict[tuple[int, str], str] = {}
        self._now: set[tuple[int, str]] = set()

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(self._crossed.values())

    def ranges(self) -> list[str]:
        """Notes on limited joints whose range alone, from the pose of the file, takes a body through a wall."""
        model, trial, notes = self._model, mujoco.MjData(self._model), []
        for joint in np.flatnonzero(model.jnt_limited & np.isin(model.jnt_type, SINGLE)):
            mujoco.mj_resetData(model, trial)
            for x in np.linspace(*model.jnt_range[joint], SAMPLES):
                trial.qpos[model.jnt_qposadr[joint]] = x
                mujoco.mj_kinematics(model, trial)
                if beyond := self._beyond(trial):
                    body, wall = next(iter(beyond))
                    notes.append(
                        f"joint {name_of(model, JOINT, joint)!r}: its range lets body {name_of(model, BODY, body)!r} through "
                        f"the tank's {wall} wall, which does not hold it; narrow the range, or add a geom to touch"
                    )
                    break
        return notes

    def watch(self, data: mujoco.MjData) -> None:
        """Note each body and wall the first time that the body stands in it."""
        self._now = self._beyond(data)
        for body, wall in sorted(self._now):
            if (body, wall) not in self._crossed:
                name = name_of(self._model, BODY, body)
                self._crossed[body, wall] = (
                    f"body {name!r} went through the tank's {wall} wall at t = {data.time:.3g} s: "
                    "no wall holds a body, add a geom to the MJCF file for it to touch"
                )

    def conditions(self) -> list[str]:
        """The bodies that stood in walls when last watched."""
        name = lambda body: name_of(self._model, BODY, body)  # noqa: E731
        return [
            f"body {name(body)!r} in the tank's {wall} wall, which does not hold it" for body, wall in sorted(self._now)
        ]

    def state(self) -> dict:
        """The walls that bodies stand in now, and those that they have gone through: [body, wall, note]."""
        return {
            "now": [list(pair) for pair in sorted(self._now)],
            "crossed": [[*pair, text] for pair, text in self._crossed.items()],
        }

    def restore(self, state: dict) -> None:
        self._now = {(body, wall) for body, wall in state["now"]}
        self._crossed = {(body, wall): text for body, wall, text in state["crossed"]}

    def _beyond(self, data: mujoco.MjData) -> set[tuple[int, str]]:
        """(body, wall) of the wet geoms that reach through walls."""
        found = set()
        for geom, vertices in self._vertices.items():
            turn, centre = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            radius = self._model.geom_rbound[geom]
            for name, axis, side, end in self._walls:
                least = end + side * self._slack
                near = side * (centre[axis] - least) > -radius
                if near and (side * (vertices @ turn[axis] + centre[axis] - least)).max() > 0:
                    found.add((int(self._model.geom_bodyid[geom]), f"{name}{'-' if side < 0 else '+'}"))
        return found
