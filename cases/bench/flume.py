"""Runs of the flap's flume with and without its parts: whole runs, with bodies, coupling and logging as `fsi run` has them."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from statistics import median

from fsi.record.background import open_recorders
from fsi.scene.binding import bind
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

QUIET = {"series": 0.0, "particles": 0.0, "mcap": False, "timeline": False}
PLAIN = {"viscosity": "none", "artificial_viscosity": 0.0, "wall_guard": 0.0}


def flap(**parts) -> Scene:
    """The scene `flap` with some of its tables replaced; a table that is a dict is merged."""
    values = load_scene("flap").model_dump()
    for name, part in parts.items():
        values[name] = values[name] | part if isinstance(part, dict) and part else part
    return Scene.model_validate(values)


def bare(spacing: float, **parts) -> Scene:
    """The flume as still water between walls, without any further term and without logging; `parts` are put back."""
    nothing = {"waves": None, "damping": (), "bodies": {}, "gauges": {}, "probes": {}}
    numerics, output = PLAIN | parts.pop("numerics", {}), QUIET | parts.pop("output", {})
    return flap(**(nothing | parts), spacing=spacing, numerics=numerics, output=output)


class Flume:
    """A run of a scene that is advanced a few steps at a time."""

    def __init__(self, scene: Scene, folder: Path, threads: int = 1):
        bodies, coupler, ground = bind(scene, scene.name)
        folder.mkdir(parents=True)
        self.recorders = open_recorders(scene, folder)
        self.sim = Simulation(
            scene, bodies=bodies, coupler=coupler, ground=ground, recorders=self.recorders, threads=threads
        )
        before = set(threading.enumerate())
        self.sim.begin()
        self._writers = [thread for thread in threading.enumerate() if thread not in before]
        self.wall: list[float] = []  # seconds of a step, one value a visit
        self.processor: list[float] = []
        self.logging: list[float] = []  # share of the wall time that the loop spends in handing frames over
        self.phases: list[dict[str, float]] = []  # wall seconds of a step by phase of the loop

    def visit(self, steps: int) -> None:
        """Advance and note the time of a step, the recorder's work included."""
        before = dict(self.sim.phases)
        processor, wall = time.process_time(), time.perf_counter()
        for _ in range(steps):
            self.sim.step()
        taken = time.perf_counter() - wall
        self._drain()
        self.wall.append(taken / steps)
        self.processor.append((time.process_time() - processor) / steps)
        self.phases.append({name: (s - before.get(name, 0.0)) / steps for name, s in self.sim.phases.items()})
        self.logging.append(self.phases[-1]["record"] * steps / taken)

    def _drain(self) -> None:
        """Wait until the threads that write the log have nothing left to do, so that their work counts here."""
        if not hasattr(time, "pthread_getcpuclockid"):
            return
        for thread in self._writers:
            number, before = time.pthread_getcpuclockid(thread.ident), -1.0
            while (now := time.clock_gettime(number)) > before:
                before = now
                time.sleep(0.02)

    def close(self) -> None:
        for recorder in self.recorders:
            recorder.end()
        self.sim.team.close()

    @property
    def particles(self) -> int:
        return self.sim.fluid.count


def visit_in_turns(flumes: list[Flume], steps: int, rounds: int) -> None:
    """Advance all in turns, after a visit that is not counted."""
    for flume in flumes:
        flume.visit(steps)
        for samples in (flume.wall, flume.processor, flume.logging, flume.phases):
            samples.clear()
    for _ in range(rounds):
        for flume in flumes:
            flume.visit(steps)
    for flume in flumes:
        flume.close()


def flap_cost(folder: Path, threads: int, spacing: float, steps: int, rounds: int) -> list[dict]:
    """The flap as it stands against the same flume without bodies and logging, and with bodies alone, on one and on all
    threads: time of a step and speed over that of the plain flume."""
    kinds = {
        "flume, no logging": flap(spacing=spacing, bodies={}, output=QUIET, gauges={}, probes={}),
        "bodies, no logging": flap(spacing=spacing, output=QUIET),
        "bodies and default logging": flap(spacing=spacing),
    }
    rows = []
    for count in sorted({1, threads}):
        flumes = {name: Flume(scene, folder / f"{count}-{i}", count) for i, (name, scene) in enumerate(kinds.items())}
        visit_in_turns(list(flumes.values()), steps, rounds)
        clock = "processor" if count == 1 else "wall"
        ns = {name: 1e9 * median(getattr(f, clock)) / f.particles for name, f in flumes.items()}
        for name, flume in flumes.items():
            rows.append(
                {
                    "run": name,
                    "threads": count,
                    "particles": flume.particles,
                    "particle_steps_per_s": 1e9 / ns[name],
                    "ns_per_particle": ns[name],
                    "speed_over_plain": ns["flume, no logging"] / ns[name],
                    "logging_share_of_wall": median(flume.logging),
                    "extra_over_no_logging": ns[name] / ns["bodies, no logging"] - 1 if flume.recorders else None,
                    "phases_ns": {
                        phase: 1e9 * median(sample[phase] for sample in flume.phases) / flume.particles
                        for phase in flume.phases[0]
                        if phase != "start"
                    },
                }
            )
    return rows
