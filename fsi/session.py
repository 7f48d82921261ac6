"""`fsi.open`: a scene as an open simulation, stepped from Python."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

from fsi.errors import SceneError
from fsi.record.run_folder import RunFolder
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
from fsi.trust import trusting


def open(
    scene: Scene | str | Path,
    *,
    out: str | Path | None = None,
    threads: int | None = None,
    overrides: Iterable[str] = (),
    level: str | None = None,
    trust: bool = False,
) -> Session:
    """Open a scene, a scene file or a built-in scene, with the bodies, the coupler and the bathymetry that it names:

        with fsi.open("floating_box_2d") as sim:
            while sim.time < 1.0:
                sim.step()
                print(sim.time, sim.data.qpos)

    With `out` the run is recorded into that folder as by `fsi.run`; without, nothing is written. `threads` are all cores
    if not given; `overrides` and `level` are as in `fsi.load_scene`; `trust` lets the Python code run that the scene names
    (`fsi.trust`). Raises SceneError where the input is wrong.
    """
    with trusting(trust):
        return Session(load_scene(scene, overrides, level), out, threads)


class Session:
    """A simulation that owns its threads and recorders; a context manager, `close` ends it.

    scene: as resolved; simulation: the `fsi.Simulation` inside, whose fluid and bodies may be looked at.
    """

    def __init__(self, scene: Scene, out: str | Path | None = None, threads: int | None = None):
        self.scene = scene
        with ExitStack() as self._stack:  # what is open so far is closed where the rest fails
            self._open(scene, out, threads)
            self._stack = self._stack.pop_all()
        self._closed = False

    def _open(self, scene: Scene, out: str | Path | None, threads: int | None) -> None:
        folder, recorders = None, []
        if out is not None:
            from fsi.record.background import open_recorders

            folder = self._stack.enter_context(RunFolder.choose(scene, out))
            recorders = open_recorders(scene, folder.path)
        self.simulation = Simulation(scene, recorders=recorders, threads=threads)
        self._stack.callback(self.simulation.close)
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
        """The `mujoco.MjData` of the scene's one body file, live: controls that are set here act in the next step.
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

    def step(self) -> float:
        """One coupled step of fluid and bodies, as long as the time step allows; returns the simulated time [s].
        Raises RunError where the run has become unstable."""
        self._opened().step()
        return self.time

    def run(self, until: float | None = None) -> float:
        """Step to `until` [s], exactly (the scene's duration if not given); returns the simulated time [s].
        Raises RunError where the run has become unstable."""
        self._opened().run(until)
        return self.time

    def close(self) -> None:
        """End the run: its threads stop, and the log and `run.json` are completed. A second call does nothing."""
        if not self._closed:
            self._closed = True
            self._stack.close()

    def _opened(self) -> Simulation:
        if self._closed:
            raise SceneError("the simulation is closed", fix="open the scene again")
        return self.simulation
