"""MuJoCo's own viewer beside a run: it is shown a copy, so that nothing in its window reaches the run."""

from __future__ import annotations

import os
import sys
import time as clock
from copy import copy

import mujoco
import numpy as np

from fsi.errors import SceneError
from fsi.extras import require

FRAME = 1 / 30  # wall time [s] between two pictures
DROPS = 4000  # particles that are drawn, at most
SHOWN = ("qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat", "sensordata")
WATER = np.array([0.2, 0.5, 0.9, 0.35], np.float32)
ELSEWHERE = "run without --viewer, then `fsi view DIR`; or use --live, which shows the run in a browser"


class Viewer:
    """A window with the bodies and the water of a run; a context manager, which closes it. A window that the user closes does
    not end the run.

    Raises SceneError where there is no display.
    """

    def __init__(self, bodies):
        if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise SceneError("MuJoCo's viewer needs a display, and there is none", key="--viewer", fix=ELSEWHERE)
        glfw = require("glfw", "viewer", "MuJoCo's viewer")
        from mujoco import viewer

        if not glfw.init():  # else `launch_passive` would wait for a window for ever
            raise SceneError("MuJoCo's viewer cannot open the display", key="--viewer", fix=ELSEWHERE)
        self._bodies, self._model = bodies, copy(bodies.model)
        self._data = mujoco.MjData(self._model)
        self._next = 0.0
        try:
            self._window = viewer.launch_passive(self._model, self._data)
        except Exception as fault:  # of GLFW, or on macOS of a Python that is not mjpython
            text = str(fault).strip().partition("\n")[0] or type(fault).__name__
            raise SceneError(f"MuJoCo's viewer could not be opened: {text}", key="--viewer", fix=ELSEWHERE) from None

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *error) -> None:
        self._window.close()

    def show(self, sim) -> None:
        """Show the run as it stands, if the last picture is old enough."""
        if clock.monotonic() < self._next or not self._window.is_running():
            return
        self._next = clock.monotonic() + FRAME
        with self._window.lock():
            self._copy()
            self._draw_water(sim)
        self._window.sync(state_only=True)

    def _copy(self) -> None:
        for name in SHOWN:
            getattr(self._data, name)[:] = getattr(self._bodies.data, name)
        self._data.time = self._bodies.data.time
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_tendon(self._model, self._data)

    def _draw_water(self, sim) -> None:
        """Spheres for the particles, in the same order in each picture."""
        scene, position = self._window.user_scn, np.zeros((sim.fluid.count, 3))
        position[:, [0, 2] if sim.fluid.dim == 2 else [0, 1, 2]] = sim.fluid.position
        every = -(-len(position) // min(DROPS, scene.maxgeom))
        chosen = position[sim.fluid.label % every == 0][: scene.maxgeom]
        size, turn = np.full(3, 0.5 * sim.scene.spacing), np.eye(3).ravel()
        for geom, place in zip(scene.geoms, chosen, strict=False):
            mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_SPHERE, size, place, turn, WATER)
        scene.ngeom = len(chosen)
