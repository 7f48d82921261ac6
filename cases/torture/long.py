"""Memory and time per step of a small scene over very many steps: both must stay as they were."""

from __future__ import annotations

import gc
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from cases.bench.identity import CHANNEL
from fsi.protocols import Frame, Recorder
from fsi.scene.file import load_scene
from fsi.scene.model import Scene

ROWS = 20
FLAT = 20e6  # bytes that the memory of a run may grow by
PARTICLES, EVERY = (
    200,
    50,
)  # of a frame that no fluid has computed, and how many frames of series go with one of particles


def resident() -> int:
    """Memory of this process that is in use [bytes]; where the system does not say, the most that it was."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def long(steps: int) -> list[str]:
    """Run a channel of 200 particles for so many steps, every one of which is recorded, and print a row of figures now and
    then; what was not flat."""
    from fsi.simulation.loop import Simulation

    with _recorded(steps) as (scene, recorders):
        simulation = Simulation(scene, recorders=recorders, threads=1)
        faults = _watched(simulation.step, steps)
        simulation.close()
    return faults


def long_recording(frames: int) -> list[str]:
    """Record so many frames of that channel as if they were computed, which takes a tenth of the time; what was not flat."""
    with _recorded(frames) as (scene, [recorder]):
        recorder.begin(scene, None)
        dice, scalars = np.random.default_rng(1), _scalars()
        place = dice.random((PARTICLES, 2))
        count = 0

        def record() -> None:
            nonlocal count
            moment = 0.01 * count, count, 1e-3 * count
            recorder.series(Frame(*moment, {name: np.array(dice.random(shape)) for name, shape in scalars.items()}))
            if count % EVERY == 0:
                frame = Frame(*moment)
                frame.position, frame.velocity = place + 1e-3 * dice.random(), place
                frame.pressure, frame.label = place[:, 0], np.arange(PARTICLES)
                recorder.particles(frame)
            count += 1

        return _watched(record, frames)


def _scalars() -> dict[str, tuple[int, ...]]:
    from fsi.record.series import SERIES

    return {name: () for name, series in SERIES.items() if not series.dims} | {"pressure": (1,)}


@contextmanager
def _recorded(steps: int) -> Iterator[tuple[Scene, list[Recorder]]]:
    """The channel, with recorders that write to a folder which is removed at the end."""
    from fsi.record.background import open_recorders

    with tempfile.TemporaryDirectory() as place:
        (file := Path(place, "channel.toml")).write_text(CHANNEL)
        scene = load_scene(file, ["output.series=0.001", "output.particles=5.0", f"duration={steps}"])
        recorders = open_recorders(scene, Path(place))
        yield scene, recorders
        for recorder in recorders:
            recorder.end()


def _watched(step, steps: int) -> list[str]:
    """Call `step` so often, with rows of figures; what was not flat. The first row counts as the start: caches fill, and the
    recorders begin."""
    rows: list[tuple[int, float]] = []
    print(f"{'steps':>10} {'memory':>10} {'a step':>10}")
    for row in range(1, ROWS + 1):
        began = time.process_time()
        for _ in range(max(steps // ROWS, 1)):
            step()
        spent = (time.process_time() - began) / max(steps // ROWS, 1)
        gc.collect()
        rows.append((resident(), spent))
        print(f"{row * max(steps // ROWS, 1):10} {rows[-1][0] / 1e6:7.1f} MB {1e3 * spent:7.3f} ms", flush=True)
    growth = rows[-1][0] - rows[0][0]
    early, late = (sorted(spent for _, spent in part)[len(part) // 2] for part in (rows[:5], rows[-5:]))
    said = f"memory grew by {growth / 1e6:.1f} MB"
    print(f"{said}; processor time a step, last quarter over the first: {late / early:.2f}")
    faults = [said] if growth > FLAT else []
    return faults + ([f"a step takes {late / early:.2f} times as long"] if late > 1.5 * early else [])
