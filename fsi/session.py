"""`fsi.open`: a scene as an open simulation, stepped from Python."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fsi.errors import SceneError
from fsi.record.run_folder import RunFolder
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.simulation.view import View
from fsi.trust import trusting

if TYPE_CHECKING:
    from fsi.protocols import Controller


def open(
    scene: Scene | str | Path,
    *,
    out: str | Path | None = None,
    threads: int | None = None,
    overrides: Iterable[str] = (),
    level: str | None = None,
    controller: Controller | None = None,
    control_interval: float | None = None,
    trust: bool = False,
) -> Session:
    """Open a scene, a scene file or a built-in scene, with the bodies, the coupler and the bathymetry that it names:

        with fsi.open("floating_box_2d") as sim:
            while sim.time < 1.0:
                sim.step()
                print(sim.time, sim.data.qpos)

    With `out` the run is recorded into that folder as by `fsi.run`; without, nothing is written, and it can be `reset`.
    `controller` is called with the session before every step, or every `control_interval` seconds (`fsi.protocols.Controller`).
    `threads` are all cores if not given; `overrides` and `level` are as in `fsi.load_scene`; `trust` lets the Python code run
    that the scene names (`fsi.trust`). Raises SceneError where the input is wrong.
    """
    with trusting(trust):
        return Session(load_scene(scene, overrides, level), out, threads, controller, control_interval)


class Session(View):
    """A simulation that owns its threads and recorders; a context manager, `close` ends it.

    rng: random numbers (`numpy.random.Generator`) for the user, seeded by `reset`.
    """

    def __init__(
        self,
        scene: Scene,
        out: str | Path | None = None,
        threads: int | None = None,
        controller: Controller | None = None,
        control_interval: float | None = None,
    ):
        with ExitStack() as self._stack:  # what is open so far is closed where the rest fails
            self._open(scene, out, threads, controller, control_interval)
            self._stack = self._stack.pop_all()
        self._closed = False

    def _open(
        self,
        scene: Scene,
        out: str | Path | None,
        threads: int | None,
        controller: Controller | None,
        control_interval: float | None,
    ) -> None:
        folder, recorders = None, []
        if out is not None:
            from fsi.record.background import open_recorders

            folder = self._stack.enter_context(RunFolder.choose(scene, out))
            recorders = open_recorders(scene, folder.path)
        super().__init__(Simulation(scene, recorders=recorders, threads=threads))
        self._stack.callback(self.simulation.close)
        if controller is not None:
            self.simulation.steer(controller, control_interval)
        self.rng = np.random.default_rng()
        self._start: dict[str, Any] | SceneError = self._at_start(folder)
        if folder:
            from fsi.simulation.logged import logged

            folder.create(scene, threads=self.simulation.threads, particles=self.simulation.counts)
            self._stack.enter_context(logged(self.simulation, folder, recorders))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error) -> None:
        if not self._closed:
            self._closed = True
            self._stack.__exit__(*error)

    def step(self, until: float | None = None) -> float:
        """One coupled step of fluid and bodies, as long as the time step allows and not beyond `until` [s]; returns the
        simulated time [s]. Raises RunError where the run has become unstable."""
        self._opened()
        self.settle()
        self.simulation.step(*(() if until is None else (until,)))
        self.refresh()
        return self.time

    def run(self, until: float | None = None) -> float:
        """Step to `until` [s], exactly (the scene's duration if not given); returns the simulated time [s].
        Raises RunError where the run has become unstable."""
        self._opened()
        self.settle()
        self.simulation.run(until)
        self.refresh()
        return self.time

    def state(self) -> dict[str, Any]:
        """All that the steps to come depend on, in memory, for `restore`."""
        self._opened()
        self.settle()
        return self.simulation.state()

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state of this session, bit for bit; a state may be taken over again and again. Raises SceneError where
        the run is recorded, for its log cannot go back."""
        sim = self._opened()
        if isinstance(self._start, SceneError):
            raise self._start
        sim.rewind(state)
        self.refresh()

    def reset(self, seed: int | None = None) -> None:
        """Back to t = 0, in milliseconds: nothing is compiled or sampled again. `seed` seeds `rng`, and the waves where they
        have one; without, they stay as they are. Raises SceneError as `restore` does, and for another seed of an open sea, in
        whose waves the water is from the start."""
        if seed is not None and self.scene.sea and hasattr(self.scene.sea.waves, "seed"):
            fix = "open the scene anew with that seed, or reset without one and seed `rng` yourself"
            raise SceneError(
                "an open sea begins in its waves, and cannot take another seed", key="sea.waves.seed", fix=fix
            )
        self.restore(self._start)  # type: ignore[arg-type]
        if seed is not None:
            self.rng = np.random.default_rng(seed)
            self.simulation.reseed(seed)

    def close(self) -> None:
        """End the run: its threads stop, and the log and `run.json` are completed. A second call does nothing."""
        if not self._closed:
            self._closed = True
            self._stack.close()

    def _at_start(self, folder: RunFolder | None) -> dict[str, Any] | SceneError:
        """The state to go back to, or why there is none."""
        if folder:
            fault = "a run that is recorded cannot go back in time"
            return SceneError(fault, key="out", fix="open the scene without out, or anew for each recorded episode")
        self.simulation.settle()
        try:
            return self.simulation.state()
        except TypeError as fault:  # a part that does not say what it remembers
            return SceneError(
                f"the run cannot go back in time: {fault}", key="controller", fix="see fsi.protocols.Stateful"
            )

    def _opened(self) -> Simulation:
        if self._closed:
            raise SceneError("the simulation is closed", fix="open the scene again")
        return self.simulation
