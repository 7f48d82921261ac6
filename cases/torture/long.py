"""Memory and time per step of a small scene over very many steps: both must stay as they were."""

from __future__ import annotations

import gc
import resource
import sys
import tempfile
import time
from pathlib import Path

from cases.bench.identity import CHANNEL
from fsi.scene.file import load_scene

ROWS = 20
FLAT = 20e6  # bytes that the memory of a run may grow by


def resident() -> int:
    """Memory of this process that is in use [bytes]; where the system does not say, the most that it was."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def long(steps: int) -> list[str]:
    """Run a channel of 200 particles for so many steps, recorded, and print a row of figures now and then; what was not flat.

    The first twentieth counts as the start: caches fill, and the recorders begin."""
    from fsi.record.background import open_recorders
    from fsi.simulation.loop import Simulation

    with tempfile.TemporaryDirectory() as place:
        (file := Path(place, "channel.toml")).write_text(CHANNEL)
        settings = ["output.series=0.05", "output.particles=5.0", f"duration={steps}"]
        scene = load_scene(file, settings)
        simulation = Simulation(scene, recorders=open_recorders(scene, Path(place)), threads=1)
        rows: list[tuple[int, float]] = []
        print(f"{'steps':>10} {'simulated':>10} {'memory':>10} {'a step':>10}")
        for _ in range(ROWS):
            began = time.process_time()
            for _ in range(max(steps // ROWS, 1)):
                simulation.step()
            spent = (time.process_time() - began) / max(steps // ROWS, 1)
            gc.collect()
            rows.append((resident(), spent))
            memory, each = f"{rows[-1][0] / 1e6:.1f} MB", f"{1e3 * spent:.3f} ms"
            print(f"{simulation.step_count:10} {simulation.time:8.1f} s {memory:>10} {each:>10}", flush=True)
        for recorder in simulation.recorders:
            recorder.end()
        simulation.close()
    growth = rows[-1][0] - rows[0][0]
    early, late = (sorted(spent for _, spent in part)[len(part) // 2] for part in (rows[:5], rows[-5:]))
    print(
        f"memory grew by {growth / 1e6:.1f} MB; processor time a step, last quarter over the first: {late / early:.2f}"
    )
    faults = [f"memory grew by {growth / 1e6:.1f} MB"] if growth > FLAT else []
    return faults + ([f"a step takes {late / early:.2f} times as long"] if late > 1.5 * early else [])
