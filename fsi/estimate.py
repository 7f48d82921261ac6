"""What a run will cost, before it is started."""

from __future__ import annotations

import math
import time as clock
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np

from fsi.compute.team import available_threads
from fsi.fluid.chebyshev import sweeps_to
from fsi.fluid.gauges import dry_gauges
from fsi.fluid.rheology import by_pairs, decay_rate, varies, viscous_sweeps
from fsi.fluid.timestep import TimeStep
from fsi.particles.layout import Layout, build
from fsi.particles.state import BoundaryState
from fsi.protocols import BodySet, Solid
from fsi.record.log_size import check_disk, log_size
from fsi.scene.geometry import fluid_depth
from fsi.scene.model import Scene

# One thread of a server processor with AVX-512 (4 cycles for two multiply-adds of 512 bits), single-precision sweeps,
# h = 1.5 dr, of a tank of still water: nanoseconds per particle for a step without pressure sweeps, for a pressure sweep, for
# a viscosity that varies, and for a sweep of implicit viscosity; bytes per particle.
STEP, SWEEP = {2: 200.0, 3: 570.0}, {2: 29.0, 3: 81.0}
VARIED, VISCOUS_SWEEP = {2: 120.0, 3: 230.0}, {2: 43.0, 3: 108.0}
BYTES = {2: 180, 3: 315}
PAIRS = {2: 390, 3: 1150}  # bytes per particle of the viscosity of pairs (`fsi.fluid.pair_laws`), in either precision
ITERATIONS = 20  # of implicit ISPH in a step, at its default tolerance and step
DENSITIES = 1.15  # time of sweeps between liquids of unequal density
DOUBLE, DOUBLE_BYTES = 1.65, 1.6  # time and memory of double-precision sweeps over single
BODIES = 1.1  # time of a step with bodies over one without
SERIAL = 5e-4  # of a step, on one thread [s]; twice that with bodies
SEA, PRODUCT = 1.5e-3, 1.5e-10  # of a step with an open sea, on one thread, and of a multiplication for its waves [s]

LAYOUT_BYTES = 100  # of each particle of the whole scene, which every rank of a run builds

COPIED = 1e9  # bytes of a state that are copied in a second, while the run waits
BASE = 20_000  # bytes of a checkpoint besides particles: the scene, and what is small


def estimate(scene: Scene, bodies: BodySet | None = None, ground: Solid | None = None) -> dict:
    """Particles by kind (`fluid`, `wall`, `body`), `memory_bytes`, `time_step` [s], `steps` and `seconds` of wall time
    on all processors of this machine, the last three within a factor of about two, the size of the logs
    (`fsi.record.log_size`), and the `notes` of the layout. Raises SceneError as `build`."""
    layout = build(scene, bodies, ground)
    fluid, boundary = len(layout.position), len(layout.owner)
    walls = int((layout.owner == 0).sum())
    time_step, steps = expected_steps(scene, layout.depth)
    dim, numerics = scene.dimension, scene.numerics
    work = _nanoseconds(scene, layout.depth, time_step) * (fluid + 0.4 * boundary) * 1e-9
    work *= (numerics.smoothing_ratio / 1.5) ** (dim - 1)  # more neighbours, but fuller lanes
    work *= (BODIES if bodies else 1.0) * (DOUBLE if numerics.precision == "double" else 1.0)
    size = BYTES[dim] * (DOUBLE_BYTES if numerics.precision == "double" else 1.0)
    size += PAIRS[dim] if by_pairs(scene) else 0
    return {
        "fluid": fluid,
        "wall": walls,
        "body": boundary - walls,
        "memory_bytes": int(size * (fluid + boundary)),
        "time_step": time_step,
        "steps": steps,
        "notes": (*layout.notes, *dry_gauges(scene, layout.position, layout.boundary)),
        **log_size(scene, bodies, fluid, steps),
        "seconds": steps * (work / available_threads() + SERIAL * (2 if bodies else 1) + _sea(scene, layout)),
    }


def _sea(scene: Scene, layout: Layout) -> float:
    """Seconds of a step for the walls and zones of a scene's sea."""
    if not scene.sea:
        return 0.0
    from fsi.fluid.sea import Sea

    return SEA + PRODUCT * Sea(scene, BoundaryState(layout), 1.0).products


def shared(scene: Scene, arrangement: str, bodies: BodySet | None = None, ground: Solid | None = None) -> dict:
    """What a run on ranks arranged as 4x1x1 would give each of them at the start: `shape`; `imbalance`, the largest over the
    mean number of particles in boxes of equal size (`equal`), in boxes balanced by `particles`, and the same of work in boxes
    balanced by `work`, which a run takes; and of these for each of the `ranks` box (`low`, `high`, None where open), `fluid`,
    `boundary`, `ghosts`, share of the mean work, and `memory_bytes`, the whole layout at the start included."""
    from fsi.ranks.balance import planned, shares
    from fsi.ranks.decomposition import arranged, imbalance

    layout = build(scene, bodies, ground)
    size = math.prod(arranged(arrangement))
    whole = len(layout.position) + len(layout.boundary)

    def numbers(**how) -> float:
        boxes = planned(scene, layout, size, arrangement, **how)
        return imbalance(np.array([s.fluid + s.boundary for s in shares(scene, layout, boxes, ghosts=False)], float))

    boxes = planned(scene, layout, size, arrangement)
    held = shares(scene, layout, boxes)
    work = np.array([share.work for share in held])
    bytes_each = BYTES[scene.dimension] * (DOUBLE_BYTES if scene.numerics.precision == "double" else 1.0)
    rows = []
    for rank, share in enumerate(held):
        low, high = ([float(x) if math.isfinite(x) else None for x in end] for end in boxes.box(rank))
        memory = int(bytes_each * (share.fluid + share.ghosts + share.boundary) + LAYOUT_BYTES * whole)
        counts = {"fluid": share.fluid, "boundary": share.boundary, "ghosts": share.ghosts}
        rows.append({"low": low, "high": high, **counts, "work": share.work / work.mean(), "memory_bytes": memory})
    return {
        "shape": list(boxes.shape),
        "imbalance": {"equal": numbers(balance=False), "particles": numbers(weighed=False), "work": imbalance(work)},
        "ranks": rows,
    }


def expected_steps(scene: Scene, depth: float) -> tuple[float, int]:
    """The usual time step [s] of a scene whose fluid is `depth` metres high, and how many a run takes."""
    falling = 1.0 if scene.fluid.blocks else 0.1  # speed over that of a fall through the depth
    time_step = TimeStep(scene, depth).choose(falling * math.sqrt(2 * scene.gravity * depth), scene.gravity)
    return time_step, math.ceil(scene.duration / time_step)


def check_room(scene: Scene, bodies: BodySet | None, fluid: int, folder: Path) -> None:
    """Raise SceneError where the logs of a run with so many fluid particles do not fit on the disk of `folder`."""
    check_disk(log_size(scene, bodies, fluid, expected_steps(scene, fluid_depth(scene))[1])["log_bytes"], folder)


def _nanoseconds(scene: Scene, depth: float, time_step: float) -> float:
    """Of a step for each particle, at h = 1.5 dr and in single precision."""
    dim, numerics = scene.dimension, scene.numerics
    sweeps = numerics.sweeps
    if numerics.solver == "iisph":
        sweeps = 2 * ITERATIONS
    if numerics.solver == "converged":  # the last step's pressure is a good start: half the way down to the tolerance
        sweeps = sweeps_to(math.sqrt(numerics.pressure_tolerance), scene, depth)
    time = STEP[dim] + SWEEP[dim] * sweeps
    if TimeStep(scene, depth).implicit:
        time += VISCOUS_SWEEP[dim] * viscous_sweeps(1 + time_step * decay_rate(scene))
    if varies(scene):
        time += VARIED[dim]
    return time * (DENSITIES if len({liquid.density for liquid in scene.all_liquids}) > 1 else 1.0)


def measured(scene: Scene, steps: int, *, bodies=None, coupler=None, ground=None, threads: int | None = None) -> dict:
    """Run the first `steps` steps of the scene without logging, and time them. Returns `measured_steps`, `threads`,
    `memory_bytes` of the particle arrays, `time_step` [s], the mean, and `seconds_per_step`, the median; the first step
    compiles and is left out. Raises RunError where a step fails."""
    from fsi.simulation.loop import Simulation

    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
    marks = []
    try:
        for _ in range(steps + 1):
            sim.step()
            marks.append(clock.perf_counter())
    finally:
        sim.team.close()
    return {
        "measured_steps": steps,
        "threads": sim.threads,
        "memory_bytes": sim.memory_bytes,
        "time_step": sim.time / sim.step_count,
        "seconds_per_step": median(after - before for before, after in pairwise(marks)),
    }


def checkpoint_cost(scene: Scene, cost: dict) -> dict:
    """Of a scene that is estimated to cost so much: `checkpoint_bytes` of one checkpoint on the disk, and the
    `checkpoint_share` of the run time that all take, at `COPIED` bytes a second; 0 without checkpoints."""
    every = scene.output.checkpoint
    if not every:
        return {"checkpoint_bytes": 0, "checkpoint_share": 0.0}
    fluid = 8 * 2 * scene.dimension + (4 if scene.numerics.precision == "single" else 8) + 4
    size = BASE + fluid * cost["fluid"] + 8 * 3 * scene.dimension * (cost["wall"] + cost["body"])
    return {"checkpoint_bytes": size, "checkpoint_share": size / COPIED / every}
