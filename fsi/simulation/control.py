"""A controller of the actuators: Python that is called between steps, and what it remembers."""

from __future__ import annotations

import inspect
import math
from typing import TYPE_CHECKING

from fsi.errors import RunError, SceneError
from fsi.state import plain
from fsi.user_code import load

if TYPE_CHECKING:
    from fsi.protocols import Controller
    from fsi.scene.model import Scene
    from fsi.simulation.view import View

WAY_OUT = "give it state() and restore(state), or make it a function that remembers nothing"


def controller_of(scene: Scene, source: object) -> Controller | None:
    """The controller that the scene names; None without, and where a scene is checked, whose code does not run. Raises
    SceneError, which calls the scene `source`, where it cannot be made or is not trusted (`fsi.trust`)."""
    if scene.control is None:
        return None
    made = load(scene.control.function, "control", source)
    if made is None:
        return None
    settings = dict(scene.control.settings)
    if inspect.isclass(made):
        try:
            made = made(**settings)
        except Exception as fault:  # of any kind: it is the user's code
            fault = f"{scene.control.function.name}: {type(fault).__name__}: {fault}"
            raise SceneError(fault, key="control.settings", file=source, fix="give what its __init__ takes") from None
    elif settings:
        fault = f"{scene.control.function.name} is a function, which takes the run alone"
        raise SceneError(fault, key="control.settings", file=source, fix="name a class, whose __init__ takes them")
    if not callable(made):
        fault = f"objects of {scene.control.function.name} cannot be called"
        raise SceneError(fault, key="control.function", file=source, fix="give the class __call__(self, run)")
    return made


class Control:
    """Calls a controller at t = 0 and from then on every `interval` seconds, exactly, or before every step where it is None.

    The controls that it sets hold until it is called again: over a step, in all substeps of MuJoCo and in every pass of a
    coupler that iterates.
    """

    def __init__(self, controller: Controller, interval: float | None, view: View):
        self._controller, self._interval, self._view = controller, interval, view
        self._calls = 0
        self._name = getattr(controller, "__name__", type(controller).__name__)

    def act(self, time: float) -> float:
        """Call the controller if it is due at `time` [s]; when it is due next. Raises RunError where it fails."""
        if self._interval is None or time >= self._due * (1 - 1e-12):
            self._view.refresh()
            try:
                self._controller(self._view)
            except (SceneError, RunError):
                raise
            except Exception as fault:  # of any kind: it is the user's code
                raise RunError(f"controller {self._name} at t = {time:g} s: {type(fault).__name__}: {fault}") from fault
            self._view.settle()
            self._calls += 1
        return math.inf if self._interval is None else self._due

    @property
    def _due(self) -> float:
        return self._calls * (self._interval or 0.0)

    def state(self) -> dict:
        """How often it was called, and what the controller remembers. Raises TypeError where that is not known."""
        controller, inner = self._controller, None
        if hasattr(controller, "state") and hasattr(controller, "restore"):
            inner = plain(controller.state())
        elif not inspect.isroutine(controller) or inspect.ismethod(controller):
            raise TypeError(f"controller {self._name} may remember something; {WAY_OUT}")
        return {"calls": self._calls, "controller": inner}

    def restore(self, state: dict) -> None:
        """Go on from a state. Raises ValueError where it is one of another controller."""
        stateful = hasattr(self._controller, "restore")
        if stateful != (state["controller"] is not None):
            raise ValueError(f"the state is one of another controller than {self._name}")
        self._calls = int(state["calls"])
        if stateful:
            self._controller.restore(plain(state["controller"]))
