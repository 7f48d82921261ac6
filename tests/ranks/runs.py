"""Runs of a small scene by `fsi run` in a process of its own, alone or on several ranks."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from cases.bench import identity
from fsi.ranks.start import from_wheel
from fsi.record.dataset import load_run

ROOT = Path(__file__).parents[2]
MPIEXEC = from_wheel("mpiexec")
COLUMN = """
spacing = 0.05
duration = 0.2
[tank]
min = [0.0, 0.0]
max = [1.2, 0.8]
[[fluid.blocks]]
min = [0.0, 0.0]
max = [0.4, 0.6]
[gauges.middle]
x = 0.3
[probes.foot]
position = [0.3, 0.1]
[output]
series = 0.01
timeline = false
"""
OPEN = """
spacing = 0.05
duration = 1.2
[tank]
min = [0.0, 0.0]
max = [0.8, 0.8]
walls = ["x-", "z-"]
[[fluid.blocks]]
min = [0.0, 0.0]
max = [0.4, 0.6]
[alarms]
lost_particles = 1.0
[gauges.middle]
x = 0.3
[fluxes.gate]
min = [0.6, 0.0]
max = [0.6, 0.8]
[velocimeters.v]
position = [0.5, 0.05]
[loads.floor]
on = "z-"
[depths.d]
x = 0.5
[output]
series = 0.01
timeline = false
"""
CHANNEL = identity.CHANNEL
LAYERS = identity.LAYERS.replace("spacing = 0.02", "spacing = 0.04")
SEA = identity.SEA.replace("spacing = 0.04", "spacing = 0.05").replace("duration = 3.0", "duration = 2.0")
SHORTER = {
    "flap": ("--until", 0.3, "--set", "spacing=0.05", "--set", "output.series=0.02"),
    "floating_box": ("--until", 0.1, "--set", "spacing=0.05", "--set", "output.series=0.02"),
    "floating_box_2d": ("--until", 0.4),
    "slide_submarine_contact": ("--until", 0.5),
}


def command(ranks: int, *arguments) -> list[str]:
    """`fsi` with these arguments on so many ranks; on one without MPI's starter."""
    start = [] if ranks == 1 else [MPIEXEC, "-n", str(ranks)]
    return [*start, sys.executable, "-m", "fsi", *map(str, arguments)]


def run(ranks: int, *arguments, timeout: float = 300.0) -> subprocess.CompletedProcess:
    return subprocess.run(
        command(ranks, *arguments), capture_output=True, text=True, cwd=ROOT, timeout=timeout, env=os.environ
    )


def differing(one: Path, two: Path, but: tuple[str, ...] = ()) -> list[str]:
    """Names of the series of two run folders that are not the same, bit for bit."""
    a, b = load_run(one), load_run(two)
    names = ["time", *(set(a.data_vars) | set(b.data_vars))]
    return sorted(n for n in names if n not in but and not _same(a, b, n))


def _same(a, b, name: str) -> bool:
    if name not in a or name not in b:
        return False
    x, y = a[name].values, b[name].values
    return np.array_equal(x, y, equal_nan=x.dtype.kind == "f")
