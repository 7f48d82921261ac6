"""Results must be the same bit for bit on any number of threads."""

from __future__ import annotations

import numpy as np

from cases.bench.block import Block
from fsi.scene.file import load_scene
from fsi.simulation.loop import Simulation


def determinism(threads: int, steps: int, particles: int) -> list[dict]:
    """Steps of a block in three dimensions and of the dam break, on one and on more threads: are the positions, the
    velocities and the pressures equal? Two threads at the least, also on a machine with one processor."""
    rows = []
    for count in sorted({2, threads, threads + 1} - {1}):
        one, many = (Block(3, particles, sweeps=4, threads=t) for t in (1, count))
        for _ in range(steps):
            one.step(), many.step()
        rows.append({"run": "block", "threads": count, "steps": steps, "identical": same(one.fluid, many.fluid)})
        scene = load_scene("dam_break")
        one, many = (Simulation(scene, threads=t) for t in (1, count))
        for _ in range(steps):
            one.step(), many.step()
        rows.append({"run": scene.name, "threads": count, "steps": steps, "identical": same(one.fluid, many.fluid)})
    return rows


def same(a, b) -> bool:
    """Whether two fluids hold the same particles in the same state, bit for bit."""
    names = ("position", "velocity", "pressure_values", "label")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)
