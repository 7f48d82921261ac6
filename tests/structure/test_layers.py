"""Packages and rooms import only what lies below them, and a scene loads and compiles only what it uses."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import graph  # beside this file

ROOT = Path(__file__).parents[2]
FILES, ARROWS = graph.modules(ROOT), graph.graph(ROOT)
FORBIDDEN = {
    "fsi": {"bodies", "couplers", "cases"},
    "bodies": {"couplers", "cases"},
    "couplers": {"bodies", "cases"},
    "cases": set(),
}
BASE = {
    "errors",
    "extras",
    "garbage",
    "messages",
    "owners",
    "parts",
    "plugins",
    "progress",
    "protocols",
    "state",
    "strict_json",
    "tables",
    "trust",
    "user_code",
}
LAYERS = (  # of fsi, from below; those in one layer know nothing of each other, but for those of the base
    BASE,
    {"compute"},
    {"sph", "waves"},  # waves are pure theory: no particles, and of a scene its [waves] alone
    {"scene"},
    {"particles", "record"},
    {"ranks"},
    {"fluid"},
    {"simulation"},
    {"estimate", "session", "periods"},
    {"runner", "environment"},
    {"resuming"},
    {""},  # fsi itself, the public names
    {"command"},
    {"start"},
    {"__main__"},
)


def layer(module):
    """Number of the layer of a module of fsi, and its name there."""
    name = module.removeprefix("fsi").removeprefix(".").partition(".")[0]
    found = next((n for n, names in enumerate(LAYERS) if name in names), None)
    assert found is not None, f"{module} has no layer; put it into a room, or name it here"
    return found, name


@pytest.mark.parametrize("module", FILES)
def test_packages_import_what_they_may(module):
    package = module.partition(".")[0]
    bad = {target for target in ARROWS[module] if target.partition(".")[0] in FORBIDDEN[package]}
    assert not bad


@pytest.mark.parametrize("module", [module for module in FILES if module.partition(".")[0] == "fsi"])
def test_rooms_of_fsi_import_from_below(module):
    here, name = layer(module)
    for target in graph.within(ARROWS, "fsi")[module]:
        there, its_name = layer(target)
        same = name == its_name or (name in BASE and its_name in BASE)
        assert there < here or same, f"{module} imports {target}"


def test_there_are_no_circles():
    assert graph.circles(ARROWS) == []
    assert graph.circles(graph.rooms(ARROWS, FILES)) == []


@pytest.mark.parametrize("module", FILES)
def test_no_package_takes_anothers_private_names(module):
    package = module.partition(".")[0]
    for base, name, line in graph.imports(FILES[module], module):
        other, *rest = base.split(".")
        if other in FORBIDDEN and other != package:
            private = [part for part in [*rest, name] if part.startswith("_") and not part.endswith("__")]
            assert not private, f"{module}:{line}"


def test_heavy_packages_are_imported_in_few_modules():
    importers = {name: set() for name in ("mcap", "rerun", "mujoco", "trimesh")}
    for module, path in FILES.items():
        if module.partition(".")[0] == "fsi":
            for base, _, _ in graph.imports(path, module):
                importers.get(base.partition(".")[0], set()).add(module)
    assert not importers["mujoco"] | importers["trimesh"]
    assert len(importers["rerun"]) <= 1 and len(importers["mcap"]) <= 2


BEFORE = {
    "a/__init__.py": "",
    "a/one.py": "import fsi.b.two",
    "b/__init__.py": "",
    "b/two.py": "def f():\n    from ..a import one\n",
    "__init__.py": "",
}


def test_the_graph_sees_imports_within_functions_and_relative_ones(tmp_path):
    for name, text in BEFORE.items():
        file = tmp_path / "fsi" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    arrows = graph.graph(tmp_path)
    assert arrows["fsi.a.one"] == {"fsi.b.two"} and arrows["fsi.b.two"] == {"fsi.a.one"}
    assert graph.circles(arrows) == [["fsi.a.one", "fsi.b.two"]]
    assert graph.facts(arrows) == "5, floors 1, arrows 2, circles 1 of 2"


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
assert not {"bodies", "couplers", "cases", "fsi.simulation.glue", "fsi.simulation.absorber"} & set(sys.modules)
unused = {f"fsi.waves.kinds.{name}" for name in ("irregular", "solitary", "packet", "table", "regular")}
assert not unused & set(sys.modules), unused & set(sys.modules)

fluid = sim.fluid
used = {fluid._predictor, fluid.solver.source, fluid._corrector, fluid.solids.weigher,
        pressure.make_sweep(fluid.lanes, 2, False, 0), walls.make_extrapolation(fluid.lanes, 2, 0)}
assert all(len(kernel.signatures) == 1 for kernel in used)
plain = predictor.make_predictor(fluid.lanes, 2, "none", "none", False, False, True)  # no viscosity, no shift
assert fluid._predictor is plain
assert fluid._corrector is corrector.make_corrector(fluid.lanes, 2, False, False, False, False, True)  # nor densities
assert fluid.solids.weigher is walls.make_shepard(fluid.lanes, 2, False, False)
for factory, made in ((predictor.make_predictor, 1), (corrector.make_corrector, 1), (pressure.make_sweep, 1),
                      (pressure.make_onset, 0), (walls.make_shepard, 1), (walls.make_extrapolation, 1),
                      (walls.make_force, 0), (walls.make_drag, 0)):
    assert factory.cache_info().currsize == made, factory
assert fluid.memory["responses"] == 0 and fluid.rheology is None and fluid._relative is None
assert fluid.work.flow is fluid.work.trial and type(fluid.halo).__name__ == "NoHalo"
"""


def test_a_bare_scene_imports_and_compiles_only_what_it_uses():
    done = subprocess.run([sys.executable, "-c", BARE], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr


REGULAR = """
import sys
import fsi

fsi.Scene(spacing=0.05, duration=1, tank={"min": (0, -0.5), "max": (9, 0.5)}, waves={"wave_height": 0.1, "period": 1.5},
          coupler={"scheme": "added_mass"}, output={"fields": ("speed",)})
kinds = {name for name in sys.modules if name.startswith("fsi.waves.kinds.")}
assert kinds == {"fsi.waves.kinds.regular"}, kinds
assert "couplers" not in sys.modules and "cases" not in sys.modules
"""


def test_a_scene_imports_its_own_kind_of_waves_alone():
    done = subprocess.run([sys.executable, "-c", REGULAR], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
