"""Do ranks compute what one process does, bit for bit? `python -m cases.bench.identity --ranks 1,2,3,4,8 [NAME ...]`.

Each scene runs by `fsi run` in one process, and by `mpiexec -n N fsi run` on each number of ranks with one thread each, and
every time series is compared. The first ones are those of the table in `docs/guide/clusters.md`; each of the others has
something that sums over particles in a way of its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases.bench.trial_scenes import CHANNEL, LAYERS, SEA, differences
from fsi.errors import RunError
from fsi.ranks.start import from_wheel
from fsi.record.dataset import load_run

ROUND_OFF = 1e-9  # of its largest value, up to which a series differs in its last digits
CHANNEL_3D = """
spacing = 0.05
duration = 20.0
dimension = 3
gravity = 0.0
[tank]
min = [0.0, 0.0, 0.0]
max = [0.9, 0.9, 0.4]
walls = ["z-", "z+"]
periodic = ["x", "y"]
[fluid]
still_water_level = 0.4
acceleration = [0.1, 0.0, 0.0]
kinematic_viscosity = 1e-3
"""
OPEN_SEA = """
spacing = 0.05
duration = 4.0
[tank]
min = [-2.0, -0.5]
max = [2.0, 0.3]
[sea.waves]
wave_height = 0.08
period = 1.2
[gauges.middle]
x = 0.0
"""
CURRENT = OPEN_SEA.replace("2.0", "2.575").replace("[sea.waves]", 'periodic = ["x"]\n[sea]\ncurrent = 0.3\n[sea.waves]')
EDDIES = """
spacing = 0.04
duration = 1.0
[tank]
min = [0.0, 0.0]
max = [1.2, 0.8]
[fluid]
kinematic_viscosity = 1e-4
[[fluid.blocks]]
min = [0.0, 0.0]
max = [0.4, 0.6]
[numerics]
turbulence = "dynamic"
[gauges.middle]
x = 0.3
"""
EMPTY_SPACE = """
spacing = 0.05
duration = 1.0
dimension = 3
[tank]
min = [0.0, 0.0, 0.0]
max = [8.0, 6.0, 3.0]
walls = ["z-"]
[[fluid.blocks]]
min = [3.0, 2.0, 0.0]
max = [3.5, 2.6, 0.5]
[alarms]
lost_particles = 1.0
"""
MOORED = """
spacing = 0.05
duration = 2.0
[tank]
min = [-1.5, -0.6]
max = [1.5, 0.4]
width = 0.3
[control]
function = "push.py:push"
[bodies.float]
mjcf = "float.xml"
[bodies.float.moorings.bow]
anchor = [-1.4, 0.0, -0.6]
fairlead = "bow"
length = 1.5
mass = 2.0
diameter = 0.02
EA = 1e5
"""
FLOAT = """<mujoco><worldbody><body name="float">
<joint name="surge" type="slide" axis="1 0 0"/><joint name="heave" type="slide" axis="0 0 1"/>
<joint name="pitch" type="hinge" axis="0 1 0"/>
<geom name="float" type="box" size="0.2 0.15 0.1" density="500"/><site name="bow" pos="-0.2 0 0"/>
</body></worldbody><actuator><motor name="push" joint="surge"/></actuator></mujoco>
"""
PUSH = "import math\n\n\ndef push(run):\n    run.data.ctrl[0] = 5.0 * math.sin(4.0 * run.time)\n"


@dataclass(frozen=True)
class Shared:
    """A scene (a built-in name or the text of a file), how long it runs [s], its settings, the arrangement for a number of
    ranks where it is not the chosen one, and series that may differ in their last digits, for a reason of the scene."""

    scene: str
    until: float
    settings: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    but: tuple[str, ...] = ()


TABLE = {
    "dam_break": Shared("dam_break", 1.4, ("spacing=0.03",)),
    "dam_break_3d": Shared("dam_tank", 3.2, ("spacing=0.05", "duration=3.2"), ("2x1x1", "3x1x1", "2x2x1", "2x2x2")),
    "flap": Shared("flap", 12.0, ("spacing=0.08",)),
    "flap_3d": Shared("owsc", 4.0, ("spacing=0.07",)),
    "floating_box_2d": Shared("floating_box_2d", 7.5, ("spacing=0.05",), ("2x1", "3x1", "2x2", "4x2")),
    "floating_box": Shared(
        "floating_box",
        14.0,
        ("spacing=0.075", "duration=14.0", "numerics.courant=0.12"),
        ("2x1x1", "1x3x1", "2x1x2", "2x2x2"),
    ),
    "contact_slide": Shared("slide_submarine_contact", 1.1, ("spacing=0.04", "numerics.courant=0.12")),
    "contact_slide_3d": Shared("slide_basin", 5.0, ("spacing=0.06", "duration=5.0")),
    "periodic_channel": Shared(CHANNEL, 9.0, (), ("2x1", "1x3", "2x2", "4x2")),
    "periodic_channel_3d": Shared(CHANNEL_3D, 8.0, ("numerics.courant=0.05",), ("2x1x1", "1x3x1", "2x2x1", "2x2x2")),
}
KINDS = {
    "converged": Shared("dam_break", 0.1, ("numerics.solver=converged", "spacing=0.05")),
    "iisph": Shared("dam_break", 0.4, ("numerics.solver=iisph", "spacing=0.05"), but=("pressure_residual",)),
    "iisph_box": Shared("floating_box_2d", 0.3, ("numerics.solver=iisph", "spacing=0.05"), but=("pressure_residual",)),
    "granular": Shared("sand_column", 0.4, ("spacing=0.05",)),
    "granular_slide": Shared("slide_deformable", 0.2, ("spacing=0.05",)),
    "bentonite": Shared("slide_bentonite_2d", 0.2, ()),
    "implicit_viscosity": Shared(
        "flap", 0.4, ("spacing=0.08", "fluid.kinematic_viscosity=1e-2", "numerics.viscous_step=implicit")
    ),
    "two_liquids": Shared(LAYERS.replace("spacing = 0.02", "spacing = 0.04"), 0.4),
    "smagorinsky": Shared(EDDIES.replace("dynamic", "smagorinsky"), 0.4),
    "dynamic_eddies": Shared(EDDIES, 0.4),
    "fixed_point": Shared("flap", 0.4, ("spacing=0.08", "coupler.scheme=fixed_point")),
    "lagged": Shared("floating_box_2d", 0.3, ("spacing=0.05", "coupler.scheme=lagged", "bodies.box.position=[0,0,0]")),
    "prescribed": Shared("forced_spar", 0.3, ("spacing=0.1",)),
    "irregular_waves": Shared(SEA.replace("spacing = 0.04", "spacing = 0.06"), 1.0),
    "open_sea": Shared(OPEN_SEA, 1.0),
    "sea_on_current": Shared(CURRENT, 1.0),
    "compact_cells": Shared(EMPTY_SPACE, 0.2),
    "moorings_and_control": Shared(MOORED, 0.5),
}
TRIALS = TABLE | KINDS


def same_on_ranks(names: list[str], ranks: list[int], share: float = 1.0):
    """For each trial (name, particles, steps, verdict by number of ranks); `share`: of its time that each runs."""
    for name in names or TRIALS:
        trial = TRIALS[name]
        found: dict[int, str] = {}
        shapes = {int(np.prod([int(n) for n in shape.split("x")])): shape for shape in trial.shapes}
        with tempfile.TemporaryDirectory() as folder:
            alone = _run(trial, Path(folder), 0, "", share)
            facts = json.loads((Path(folder, "0") / "run.json").read_text())
            for number in ranks:
                try:
                    shared = _run(trial, Path(folder), number, shapes.get(number, ""), share)
                except RunError as fault:
                    found[number] = f"DIFFERENT: {fault}"
                else:
                    found[number] = verdict(alone, shared, trial.but)
        yield name, facts["particles"]["fluid"], facts["steps"], found


def verdict(alone, shared, but: tuple[str, ...]) -> str:
    """What to print of two datasets: whether they are the same, or by how much of its largest value which series differs."""
    wrong = differences(alone, shared)
    if "time" in wrong:
        return "DIFFERENT: time"
    sizes = {}
    for name in wrong:
        a, b = (np.asarray(data[name].values, float) for data in (alone, shared))
        sizes[name] = float(np.nanmax(np.abs(a - b))) / max(float(np.nanmax(np.abs(a))), 1e-300)
    if not sizes:
        return "identical"
    told = ", ".join(f"{name} by {size:.0e}" for name, size in sizes.items())
    fine = all(name in but and size < ROUND_OFF for name, size in sizes.items())
    return f"identical but {told}" if fine else f"DIFFERENT: {told}"


def _run(trial: Shared, folder: Path, ranks: int, shape: str, share: float):
    """The dataset of a trial on so many ranks, 0 for one process without any."""
    scene = trial.scene
    if "\n" in scene:
        scene = str(folder / "scene.toml")
        Path(scene).write_text(trial.scene)
        (folder / "float.xml").write_text(FLOAT)
        (folder / "push.py").write_text(PUSH)
    start = [from_wheel("mpiexec") or "mpiexec", "-n", str(ranks)] if ranks > 1 else []
    arranged = ["--ranks", shape or ("1x1x1" if ranks == 1 else "")] if ranks == 1 or shape else []
    command = [*start, sys.executable, "-m", "fsi", "run", scene, "--until", str(share * trial.until), "--threads", "1"]
    command += ["--quiet", "--trust", "--out", str(folder / str(ranks)), *arranged]
    for setting in (*trial.settings, "output.timeline=false"):
        command += ["--set", setting]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RunError(f"{' '.join(command)}: {done.stderr.strip()}")
    return load_run(folder / str(ranks))


def report(names: list[str], ranks: list[int], share: float) -> int:
    """Print the table; how many trials differ."""
    bad = 0
    print(f"{'trial':22} {'particles':>9} {'steps':>6}  series of the ranks against those of one process", flush=True)
    for name, particles, steps, found in same_on_ranks(names, ranks, share):
        groups: dict[str, list[str]] = {}
        for number, told in found.items():
            groups.setdefault(told, []).append(str(number))
        bad += any(told.startswith("DIFFERENT") for told in groups)
        text = "; ".join(f"{', '.join(numbers)} ranks {told}" for told, numbers in groups.items())
        print(f"{name:22} {particles:9} {steps:6}  {text}", flush=True)
    return bad
