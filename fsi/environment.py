"""A scene as a Gymnasium environment: the sensors of its body file and its gauges are observed, its actuators act."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fsi.errors import RunError, SceneError
from fsi.extras import require
from fsi.scene.model import Scene
from fsi.session import Session, open

try:
    import gymnasium
    from gymnasium import Env
except ModuleNotFoundError:  # said when an environment is made
    Env = object  # type: ignore[assignment,misc]


class Environment(Env):
    """An episode is a run of the scene; the action is held for `interval` seconds, which are met exactly.

    observation (n,): `sensordata` of the MJCF file, then the elevation at each gauge [m], at its floor where it is dry;
    `observation_names` says which is which. action (actuators,): their controls, within the `ctrlrange` of the file.
    The reward of a step is the mean of `reward(run)` over it; `run` is the `fsi.Session`, as after a step of the fluid.
    session: that of the environment.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 as Gymnasium has it

    def __init__(
        self,
        scene: Scene | str | Path,
        *,
        reward: Callable[[Session], float],
        interval: float,
        duration: float | None = None,
        warm_up: float = 0.0,
        terminated: Callable[[Session], bool] | None = None,
        begin: Callable[[Session], None] | None = None,
        same_waves: bool = False,
        threads: int = 1,
        overrides: Iterable[str] = (),
        level: str | None = None,
        trust: bool = False,
    ):
        """`interval` [s] from one action to the next; an episode is truncated after `duration` [s] (that of the scene if not
        given) beyond `warm_up` [s], which are run with the controls of the file before it begins. `terminated(run)` ends an
        episode; `begin(run)` is called at its start and may set `run.data.qvel`, with `run.rng` for random numbers. Waves that
        have a seed are others in each episode, unless `same_waves`. `overrides`, `level`
        and `trust` are as in `fsi.open`.

        Raises SceneError for a scene that is wrong, has a controller of its own, or an actuator without `ctrlrange`;
        RunError from `step` where the run becomes unstable.
        """
        require("gymnasium", "gym", "fsi.Environment")
        for key, value, least in (("interval", interval, "above 0"), ("warm_up", warm_up, "0 or more")):
            if not (value > 0 or (key == "warm_up" and value == 0)):
                raise SceneError(f"{value} s", key=key, fix=f"give a time {least}")
        self.session = open(scene, threads=threads, overrides=overrides, level=level, trust=trust)
        scene, model = self.session.scene, self.session.model
        if scene.control:
            self.close()
            raise SceneError("the scene's controller takes the place of the actions", key="control", fix="remove it")
        if scene.sea and hasattr(scene.sea.waves, "seed") and not same_waves:
            self.close()
            fix = "give same_waves=True, or a flume with [waves]"
            raise SceneError("an open sea has the same waves in each episode", key="sea.waves.seed", fix=fix)
        self._reward, self._terminated, self._begin = reward, terminated, begin
        self._interval, self._warm_up = interval, warm_up
        self._duration = scene.duration if duration is None else duration
        self._others = hasattr(scene.waves, "seed") and not same_waves
        self._steps, self._warm = 0, None
        self._floor = scene.tank.min[-1] - scene.fluid.still_water_level
        self.action_names = self.session.bodies.actuator_names
        self.action_space = self._actions(model)
        self.observation_names = (*self.session.bodies.sensor_names, *(f"elevation.{name}" for name in scene.gauges))
        if not self.observation_names:
            self.close()
            raise SceneError(
                "nothing is observed", key="bodies", fix="add <sensor> to the MJCF file, or gauges to the scene"
            )
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (len(self.observation_names),), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; `options` are not used."""
        super().reset(seed=seed)
        session = self.session
        if self._warm is not None and not self._others:
            session.restore(self._warm)
        else:
            session.reset(int(self.np_random.integers(2**31)) if self._others else None)
            if self._warm_up:
                session.run(self._warm_up)
                self._warm = session.state()
        session.rng = self.np_random
        self._steps = 0
        if self._begin:
            self._begin(session)
            session.settle()
            session.refresh()
        return self._observe(), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold an action (actuators,) for the interval."""
        session, total = self.session, 0.0
        start = session.time
        self._steps += 1
        end = self._warm_up + self._steps * self._interval
        if np.shape(action) != session.data.ctrl.shape:
            fault = f"an action of shape {np.shape(action)}, and {session.data.ctrl.size} actuators"
            raise SceneError(fault, key="action", fix=f"give one number each for {', '.join(self.action_names)}")
        session.data.ctrl[:] = action
        while session.time < end * (1 - 1e-12):
            session.step(end)
            total += self._rewarded(session) * session.dt
        over = bool(self._terminated(session)) if self._terminated else False
        truncated = session.time >= (self._warm_up + self._duration) * (1 - 1e-9)
        return self._observe(), float(total / (session.time - start)), over, truncated, self._info()

    def _rewarded(self, session: Session) -> float:
        reward = self._reward(session)
        if reward is None or not np.isfinite(reward):
            raise RunError(f"reward is {reward} at t = {session.time:.4g} s; it must be a finite number")
        return float(reward)

    def close(self) -> None:
        """End the simulation."""
        self.session.close()

    def _actions(self, model) -> gymnasium.spaces.Box:
        if not self.action_names:
            self.close()
            raise SceneError("the body file has no actuator to act with", key="bodies", fix="add <actuator> to it")
        for name, limited in zip(self.action_names, model.actuator_ctrllimited, strict=True):
            if not limited:
                self.close()
                fix = 'give it ctrlrange="LOW HIGH"'
                raise SceneError(f"actuator {name!r} has no range to choose actions from", key="bodies", fix=fix)
        low, high = model.actuator_ctrlrange.T.astype(np.float32)
        return gymnasium.spaces.Box(low, high, dtype=np.float32)

    def _observe(self) -> np.ndarray:
        heights = [self._floor if np.isnan(z) else z for z in self.session.gauges.values()]
        return np.concatenate([self.session.data.sensordata, heights]).astype(np.float32)

    def _info(self) -> dict[str, Any]:
        return {"time": self.session.time}
