"""Compiled code on disk is never used again once a source that it was made of has changed: shown on an edited copy."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fsi
from fsi.compute import jit

PROGRAM = """
import numpy as np
from fsi.sph.columns import Constants
from fsi.sph.walls import make_drag
rows = np.random.default_rng(1).random((20, 4))
values = dict.fromkeys(Constants._fields, 0.0) | {"inverse_support": 0.4, "eta2": 0.03, "mass": 2.0, "viscous_factor": 3.0}
force, one = np.zeros((4, 2)), lambda *numbers: np.array(numbers, np.int32)
steps = np.ones(16, np.uint16)
groups = np.zeros(1, np.int64), np.ones(1, np.int64), one(16, 20), one((0, 16, 16, -1, 16)), np.zeros(1, np.int64), steps
make_drag(4, 2)(np.zeros(1, np.int64), np.array([0, 4]), groups, 16, rows, np.ones(4, np.int32), 1, force, Constants(**values))
print(force.tolist())
"""
EDITS = {  # file, text, what it becomes
    "two constants change places": ("sph/columns.py", ["inverse_support", "eta2"], ["eta2", "inverse_support"]),
    "a factor in a term": ("sph/terms.py", ["return u_ij * a"], ["return u_ij * a * 2.0"]),
    "an operation on lanes": ("compute/lanes.py", ["builder.fadd(total, term"], ["builder.fsub(total, term"]),
    "the loop over pairs": ("compute/pairs.py", ["FLUID, WALLS, ALL = (0, 1)"], ["FLUID, WALLS, ALL = (1, 2)"]),
}


@pytest.fixture
def checkout(tmp_path):
    shutil.copytree(Path(fsi.__file__).parent, tmp_path / "fsi", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def run(checkout, **environment):
    settings = {"PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1"}
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=checkout, env=kept | settings | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def edit(file, old, new):
    text = file.read_text()
    for n, (a, b) in enumerate(zip(old, new, strict=True)):
        assert a in text
        text = text.replace(f"    {a}: float" if len(old) > 1 else a, f"    <{n}>: float" if len(old) > 1 else b, 1)
    for n, b in enumerate(new):
        text = text.replace(f"<{n}>", b)
    file.write_text(text)


@pytest.mark.slow
@pytest.mark.parametrize("what", EDITS)
def test_a_changed_source_is_compiled_again(checkout, what):
    file, old, new = EDITS[what]
    before = run(checkout)
    edit(checkout / "fsi" / file, old, new)
    after = run(checkout)
    assert after == run(checkout, NUMBA_CACHE_DIR=str(checkout / "empty"))
    assert (after == before) == (what == "two constants change places")


@pytest.mark.slow
def test_a_second_process_compiles_nothing(checkout):
    cache = lambda: sorted((p.name, p.stat().st_mtime_ns) for p in checkout.rglob("*.nb?"))  # noqa: E731
    first, filled = run(checkout), cache()
    assert filled
    assert (run(checkout), cache()) == (first, filled)


def test_helpers_are_the_same_from_source_and_from_disk(tmp_path):
    program = "from fsi.particles.neighbours import make_search as m; from numba.core.serialize import dumps; import hashlib; "
    program += "print(hashlib.sha256(dumps([c.cell_contents for c in m(8, 2).py_func.__closure__])).hexdigest())"
    settings = {"PYTHONPATH": str(Path(fsi.__file__).parents[1]), "PYTHONPYCACHEPREFIX": str(tmp_path)}
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    found = [subprocess.check_output([sys.executable, "-c", program], env=kept | settings) for _ in range(2)]
    assert found[0] == found[1]


def test_imports_are_found_as_python_finds_them():
    for name, module in list(sys.modules.items()):
        if name.startswith("fsi.") and getattr(module, "__file__", None):
            found = jit._imports(Path(module.__file__), name)
            for node in ast.parse(Path(module.__file__).read_bytes()).body:
                if isinstance(node, ast.ImportFrom):
                    assert {f"{node.module}.{one.name}" for one in node.names} <= set(found)


def test_blas_is_not_imported_and_still_there():
    pytest.importorskip("scipy")
    program = "import fsi.compute.jit, sys; print('scipy.linalg' in sys.modules)\n"
    program += "import numpy as np; from numba import njit; print(njit(lambda a: np.dot(a, a))(np.ones((2, 2)))[0, 0])"
    settings = os.environ | {"PYTHONPATH": str(Path(fsi.__file__).parents[1])}
    assert subprocess.check_output([sys.executable, "-c", program], env=settings, text=True).split() == ["False", "2.0"]
