"""A simulation as a controller, `on_step` and the user of `fsi.open` see it."""

from __future__ import annotations

import numpy as np

from fsi.errors import RunError, SceneError
from fsi.owners import FIRST_BODY

FORCES = ("xfrc_applied", "qfrc_applied")  # of MuJoCo's data, which the fluid's forces take


class View:
    """What is known of a run between two steps, and the controls of its actuators.

    scene: as resolved; simulation: the `fsi.Simulation` inside, whose fluid and bodies may be looked at.
    """

    def __init__(self, simulation):
        self.scene, self.simulation = simulation.scene, simulation
        self._left: tuple[np.ndarray, np.ndarray] | None = None  # qpos and qvel as the last step left them
        self.refresh()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.simulation.time

    @property
    def dt(self) -> float:
        """The last time step [s]; 0 before the first one."""
        return self.simulation.dt

    @property
    def bodies(self):
        """The rigid bodies (`fsi.protocols.BodySet`), None in a scene without any."""
        return self.simulation.bodies

    @property
    def data(self):
        """The `mujoco.MjData` of the scene's one body file, live. `ctrl` may be set and acts from the next step on, held over
        the step; `sensordata` and `qacc` are those of `mj_forward` under the settled load of the fluid, at t = 0 without it.
        Raises SceneError in a scene without bodies or with several files, whose model is `bodies.model`."""
        count = len(self.scene.bodies)
        if count != 1:
            fix = "use sim.bodies.data, whose names begin with that of the file" if count else "add a body file"
            raise SceneError(f"data is that of one body file, the scene has {count}", key="bodies", fix=fix)
        return self.bodies.data

    @property
    def model(self):
        """The `mujoco.MjModel` that goes with `data`. Raises SceneError as `data` does."""
        self.data  # noqa: B018 its faults are the same
        return self.bodies.model

    @property
    def gauges(self) -> dict[str, float]:
        """Elevation of the free surface above still water at each gauge [m], nan where there is no water."""
        return self.simulation.instruments.elevations()

    @property
    def probes(self) -> dict[str, float]:
        """Pressure at each probe [Pa], also of one that rides on a body."""
        return self.simulation.instruments.pressures()

    @property
    def load(self) -> np.ndarray:
        """Force and torque of the fluid on each wet body over the last step (b, 6) [N, N m], world frame, about its centre of
        mass."""
        return self.simulation.balance.wrench[FIRST_BODY:].copy()

    def refresh(self) -> None:
        """Bring `data` up to date after a step; `fsi.open` and controllers do so."""
        if self.bodies:
            self.bodies.expose(self.simulation.balance.wrench[FIRST_BODY:])
            self._left = self.bodies.data.qpos.copy(), self.bodies.data.qvel.copy()

    def settle(self) -> None:
        """Take over what was set in `data` since `refresh`. Raises SceneError for what would be without effect or would move
        bodies through the water, RunError for a control that is not finite."""
        if not self.bodies:
            return
        data, (place, speed) = self.bodies.data, self._left
        if not np.array_equal(data.qpos, place):
            fix = 'start from a keyframe named "start", or move the body by an actuator'
            raise SceneError("qpos was set: the body would be moved through the water around it", key="data", fix=fix)
        for name in FORCES:
            if getattr(data, name).any():
                fix = "add an actuator to the MJCF file, e.g. a motor at a joint or a site, and set its ctrl"
                raise SceneError(f"{name} was set: the fluid's forces take its place", key="data", fix=fix)
        if not np.isfinite(data.ctrl).all():
            raise RunError(f"ctrl is {data.ctrl.tolist()} at t = {self.time:.4g} s; it must be finite")
        if not np.array_equal(data.qvel, speed):
            self.bodies.place({}, {})
            self._left = place, data.qvel.copy()
