"""Makes steps of a scene when asked to: a process of its own, so that another checkout can be asked in turns with this one.

Started by its path with a request as JSON, it prints facts on the start, then reads seconds from stdin, line by line, and makes
steps for as long, with the default logging. It calls only what checkouts of long ago have as well.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path


def main() -> None:
    from fsi.record.background import open_recorders
    from fsi.scene.binding import bind
    from fsi.scene.file import load_scene
    from fsi.simulation.loop import Simulation

    asked = json.loads(sys.argv[1])
    scene = load_scene(asked["scene"], asked["settings"])
    bodies, coupler, ground = bind(scene, scene.name)
    with tempfile.TemporaryDirectory() as folder:
        recorders = open_recorders(scene, Path(folder))
        parts = {"bodies": bodies, "coupler": coupler, "ground": ground, "recorders": recorders}
        sim = Simulation(scene, **parts, threads=asked["threads"])
        sim.step()
        say(start_s=time.process_time(), counts=sim.counts, memory_bytes=sim.memory_bytes)
        for line in sys.stdin:
            say(**visit(sim, float(line)))
        for recorder in recorders:
            recorder.end()
        sim.team.close()


def visit(sim, seconds: float) -> dict:
    """Steps, and what they took [s]: simulated, processor, wall, and wall by phase of the loop."""
    before, steps = dict(sim.phases), 0
    processor, wall, simulated = time.process_time(), time.perf_counter(), sim.time
    while steps < 2 or time.process_time() - processor < seconds:
        sim.step()
        steps += 1
    taken = {name: value - before.get(name, 0.0) for name, value in sim.phases.items()}
    return {
        "steps": steps,
        "simulated": sim.time - simulated,
        "processor": time.process_time() - processor,
        "wall": time.perf_counter() - wall,
        "phases": taken,
    }


def say(**facts) -> None:
    print(json.dumps(facts), flush=True)


if __name__ == "__main__":
    main()
