"""Packages import only what the design lets them, and a scene loads and compiles only what it uses."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FORBIDDEN = {
    "fsi": {"bodies", "couplers", "cases"},
    "bodies": {"couplers", "cases"},
    "couplers": {"bodies", "cases"},
    "cases": set(),
}
SHELL = {"fsi/runner.py", "fsi/command.py", "fsi/__main__.py"}  # binds everything, lazily
ONE_MODULE = {"mcap": 2, "rerun": 1, "mujoco": 99, "trimesh": 99}  # modules of fsi that may import it; 99: none


def imports(path):
    """Names of the modules that a file imports, with the line."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or "", node.lineno
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


FILES = [path for package in FORBIDDEN for path in sorted((ROOT / package).rglob("*.py"))]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_layers(path):
    name = str(path.relative_to(ROOT))
    if name not in SHELL:
        bad = [
            f"{name}:{line}" for module, line in imports(path) if module.split(".")[0] in FORBIDDEN[name.split("/")[0]]
        ]
        assert not bad


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_package_reaches_for_anothers_private_names(path):
    package = path.relative_to(ROOT).parts[0]
    for module, line in imports(path):
        parts = module.split(".")
        if parts[0] in FORBIDDEN and parts[0] != package:
            assert not any(part.startswith("_") for part in parts), f"{path}:{line}"


def test_heavy_packages_are_imported_in_few_modules():
    importers = {name: set() for name in ("mcap", "rerun", "mujoco", "trimesh")}
    for path in (ROOT / "fsi").rglob("*.py"):
        for module, _ in imports(path):
            if module.split(".")[0] in importers:
                importers[module.split(".")[0]].add(path.name)
    assert not importers["mujoco"] | importers["trimesh"]
    assert len(importers["rerun"]) <= 1 and len(importers["mcap"]) <= 2


BARE = """
import sys
import fsi
from fsi.sph import corrector, predictor, pressure, walls
from fsi.simulation.loop import Simulation

scene = fsi.Scene(
    spacing=0.05, duration=0.05, tank={"min": (0, -0.5), "max": (1, 0.5)},
    numerics={"viscosity": "none", "artificial_viscosity": 0, "wall_guard": 0},
    output={"series": 0, "particles": 0},
)
sim = Simulation(scene, threads=1)
sim.run()
heavy = {"mujoco", "trimesh", "rerun", "mcap", "google", "typer", "rich", "xarray", "matplotlib", "pandas"}
assert not heavy & set(sys.modules), heavy & set(sys.modules)
assert not {"bodies", "couplers", "cases", "fsi.simulation.glue"} & set(sys.modules)
unused = {f"fsi.waves.{name}" for name in ("irregular", "solitary", "packet", "absorber", "surface")}
assert not unused & set(sys.modules), unused & set(sys.modules)

fluid = sim.fluid
used = {fluid._predictor, fluid.solver.source, fluid._corrector, fluid.solids.weigher,
        pressure.make_sweep(fluid.lanes, 2, False, 0), walls.make_extrapolation(fluid.lanes, 2, 0)}
assert all(len(kernel.signatures) == 1 for kernel in used)
assert fluid._predictor is predictor.make_predictor(fluid.lanes, 2, "none", False, False, False, True)  # no viscosity, no shift
assert fluid._corrector is corrector.make_corrector(fluid.lanes, 2, False, False, False, False, False)  # nor densities
assert fluid.solids.weigher is walls.make_weights(fluid.lanes, 2, False, False)
for factory, made in ((predictor.make_predictor, 1), (corrector.make_corrector, 1), (pressure.make_sweep, 1),
                      (pressure.make_onset, 0), (walls.make_weights, 1), (walls.make_extrapolation, 1),
                      (walls.make_force, 0), (walls.make_drag, 0)):
    assert factory.cache_info().currsize == made, factory
assert fluid.memory["responses"] == 0 and fluid.rheology is None and fluid._relative is None
assert fluid.work.flow is fluid.work.trial and type(fluid.halo).__name__ == "NoHalo"
"""


def test_a_bare_scene_imports_and_compiles_only_what_it_uses():
    done = subprocess.run([sys.executable, "-c", BARE], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
