"""A first step in a process of its own: what it imports, and how long it takes with and without compiled code on disk.

`python -m cases.bench.child` reads a scene as JSON and prints its facts as JSON.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fsi.errors import RunError
from fsi.strict_json import dumps, loads

# Packages that only some scenes need (scipy is not among them: numba imports it wherever it is installed).
OPTIONAL = ("mujoco", "trimesh", "rerun", "pyarrow", "pandas", "mcap", "google", "xarray", "matplotlib")
SCENE_STEP = 1e-3  # simulated seconds that the dam break is run for: within its first time step


def first_step(scene, cache: Path) -> dict:
    """Facts on a process that makes the first step of a scene, with numba's compiled code in the folder `cache`:
    processor_s [s], packages and `optional`, the heavy ones among them."""
    return loads(_python("cases.bench.child", cache=cache, text=scene.model_dump_json()).stdout)


def start_up(cache: Path, scene: str = "dam_break") -> list[dict]:
    """`fsi run SCENE` up to and with its first step: with an empty cache, and again."""
    rows = []
    for name in ("cold", "warm"):
        before, wall = _children(), time.perf_counter()
        arguments = ["run", scene, "--until", str(SCENE_STEP), "--quiet", "--json"]
        done = _python("fsi", *arguments, cache=cache)
        row = {"cache": name, "wall_s": time.perf_counter() - wall, "processor_s": _children() - before}
        rows.append(row | {"steps": loads(done.stdout)["steps"]})
    return rows


def _python(module: str, *arguments: str, cache: Path, text: str = "") -> subprocess.CompletedProcess:
    """Run a module in a process with this cache of compiled code, in a working directory that is then removed."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    with tempfile.TemporaryDirectory() as here:
        done = subprocess.run(
            [sys.executable, "-m", module, *arguments],
            input=text, capture_output=True, text=True, cwd=here, env=environment,
        )  # fmt: skip
    if done.returncode:
        raise RunError(f"python -m {module} {' '.join(arguments)} failed: {done.stderr.strip()[-500:]}")
    return done


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Make the first step of the scene on stdin and print the facts."""
    from fsi.record.background import open_recorders
    from fsi.scene.binding import bind
    from fsi.scene.model import Scene
    from fsi.simulation.loop import Simulation

    scene = Scene.model_validate(loads(sys.stdin.read()))
    bodies, coupler, ground = bind(scene, scene.name)
    recorders = open_recorders(scene, Path("."))
    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, recorders=recorders, threads=1)
    sim.step()
    for recorder in recorders:
        recorder.end()
    names = {name.partition(".")[0] for name in sys.modules}
    packages = sorted(name for name in names - sys.stdlib_module_names if not name.startswith("_"))
    facts = {"processor_s": time.process_time(), "packages": packages}
    print(dumps(facts | {"optional": [name for name in OPTIONAL if name in packages]}))


if __name__ == "__main__":
    main()
