"""Whether this process is one of several of a run, and what the others but the first do without: folder, log and messages."""

from __future__ import annotations

import os
import sys
import time as clock
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np

from fsi.compute.team import available_threads
from fsi.errors import SceneError
from fsi.extras import require
from fsi.particles.cells import Grid
from fsi.particles.layout import Layout
from fsi.protocols import BodySet, Event, Frame
from fsi.ranks.balance import Balancer, planned
from fsi.ranks.comm import Ranks
from fsi.ranks.faults import Watch
from fsi.ranks.halo import RankHalo
from fsi.ranks.reductions import RankReductions
from fsi.record.run_folder import RunFolder
from fsi.scene.model import Scene


def join(shape: str | None, started: int | None) -> Membership:
    """Become one of the processes of a run, `started` of which were started together as far as the environment says. Raises
    SceneError where mpi4py is missing, or where it is another MPI that has started them."""
    require("mpi4py", "mpi", "a run on several processes")
    MPI = _library()
    size = MPI.COMM_WORLD.Get_size()
    if started not in (None, size):
        raise SceneError(
            f"{started} processes were started, and mpi4py knows of {size}",
            fix="start them with the mpiexec of the MPI that mpi4py uses, such as the one that spindrift[mpi] brings",
        )
    return Membership(Ranks(MPI.COMM_WORLD), shape)


def _library():
    """The module `mpi4py.MPI`."""
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError):  # in an environment on top of that which holds the wheel of mpich
        os.environ.setdefault("MPI4PY_LIBMPI", from_wheel("libmpi.so.12") or "")
        try:
            from mpi4py import MPI
        except (ImportError, RuntimeError) as fault:
            text = str(fault).partition("\n")[0]
            fix = "install one with: pip install 'spindrift[mpi]'"
            raise SceneError(f"mpi4py finds no MPI: {text}", fix=fix) from None
    return MPI


def from_wheel(name: str) -> str | None:
    """Where the wheel of mpich has put its file of this name, such as mpiexec; None without that wheel."""
    try:
        found = [file.locate() for file in files("mpich") or () if file.name == name]
    except PackageNotFoundError:
        return None
    return next((str(Path(file).resolve()) for file in found if Path(file).exists()), None)


class Membership:
    """This process as one of a run's: what `fsi.runner` and `Simulation` ask of it. `root` is the one that writes."""

    def __init__(self, ranks: Ranks, shape: str | None):
        self.ranks, self._shape, self.root = ranks, shape, ranks.root
        self.watch = Watch(ranks)
        self.balancer: Balancer | None = None
        self._mark: float | None = None  # processor time [s] without waiting, at the end of the last step
        if not self.root:  # one voice speaks
            silence = open(os.devnull, "w")  # noqa: SIM115 as long as the process lives
            sys.stdout = sys.stderr = silence

    def threads(self, wanted: int | None) -> int:
        """Those that are wanted, or this process's share of the processors that it may use."""
        if wanted:
            return wanted
        processors = self.ranks.processors()
        return max(1, available_threads() // processors.count(processors[self.ranks.place]))

    def parts(self, scene: Scene, layout: Layout) -> dict:
        """`halo` and `reductions` of the fluid of a scene (`fsi.fluid.fluid.Fluid`). Raises SceneError where a scene cannot be
        shared in the arrangement that is asked for."""
        grid = Grid.over(layout.domain_min, layout.domain_max, scene.spacing, 2 * scene.smoothing_length)
        decomposition = planned(scene, layout, self.ranks.size, self._shape)
        halo = RankHalo(scene, self.ranks, decomposition, grid)
        tank = scene.tank
        ends = zip(tank.axes, tank.min, tank.max, strict=True)
        periods = np.array([(high - low) * (axis in tank.periodic) for axis, low, high in ends])
        self.balancer = Balancer(scene, self.ranks, halo)
        return {"halo": halo, "reductions": RankReductions(self.ranks, halo, periods)}

    def after_step(self, sim) -> None:
        """Renew the balance of the ranks where it is time for that."""
        used = clock.process_time() - self.ranks.spun
        if self._mark is not None and self.balancer:
            self.balancer(sim, used - self._mark)
        self._mark = clock.process_time() - self.ranks.spun

    def facts(self, steps: int) -> dict:
        """For `run.json`: the arrangement, how often its boxes moved and what that brought (`Balancer`), and of this rank the
        seconds that it waited for others and those that exchanges took, the particles that it holds and its ghosts, and the
        bytes that it sent in a step, by purpose."""
        halo = self.balancer.halo
        return {
            "shape": list(halo.decomposition.shape),
            "cuts": [cut.tolist() for cut in halo.decomposition.cuts],
            "moves": self.balancer.moves,
            "balance": self.balancer.history,
            "waited": self.ranks.waited,
            "exchanged": halo.used,
            "own": len(halo.own_key),
            "ghosts": halo.ghosts,
            "sent_per_step": {purpose: size / max(steps, 1) for purpose, size in self.ranks.sent.items()},
        }

    def agreed(self, number: int | None, due: bool) -> tuple[int | None, bool]:
        """The signal that has come to any of the ranks, and whether the root wants a checkpoint."""
        number, due = self.ranks.agree(number or 0, due and self.root)
        return number or None, bool(due)

    def folder(self, choose: Callable[..., RunFolder], *arguments) -> RunFolder:
        """The folder that the root chooses; the other ranks' writes nothing."""
        taken: list[RunFolder] = []

        def take() -> tuple[Path, dict]:
            taken.append(choose(*arguments))
            return taken[0].path, taken[0].manifest

        path, manifest = self.ranks.once(take)
        return taken[0] if self.root else NoFolder(path, manifest)

    def recorders(self, opened: Callable[[], list]) -> list:
        """The root's recorders; the other ranks have one that keeps nothing where the root has any."""
        recorders = opened() if self.root else []
        wanted = self.ranks.broadcast(len(recorders) > 0)
        return recorders if self.root else [NoRecorder()] * wanted


class NoFolder(RunFolder):
    """The folder of a run that another process writes."""

    def __init__(self, path: Path, manifest: dict):
        super().__init__(path)
        self.manifest = manifest

    def leave(self) -> None:
        pass

    def create(self, scene: Scene, **facts) -> None:
        self.write(**facts)

    def write(self, **facts) -> None:
        self.manifest |= facts

    def beat(self) -> None:
        pass


class NoRecorder:
    """A recorder that keeps nothing."""

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        pass

    def series(self, frame: Frame) -> None:
        pass

    def particles(self, frame: Frame) -> None:
        pass

    def event(self, event: Event) -> None:
        pass

    def end(self) -> None:
        pass
