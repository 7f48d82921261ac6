"""Compiling kernels so that numba's disk cache can be trusted: no compiled code outlives a change of its sources.

numba looks only at the file of the function itself for changes, and names compiled code after the function and a counter of
the process, so that two variants compiled in different processes can carry the same name, and the second one loaded would
run the first one's code. Each variant therefore gets a name of its own, with a fingerprint of everything it can be made of:
the module of the function and all that it imports, directly or through others, and the rooms `compute` and `sph`, whose
lanes, terms, columns and constants come in by its arguments. numba itself tells its versions and processors apart.

`compiled` and `exact` make kernels, `helper` makes functions for them; no function of `fsi` is given to numba otherwise.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import stat
import sys
import tempfile
from functools import cache
from pathlib import Path

from numba import config, njit
from numba.extending import register_jitable

FAST = {"fastmath": True, "error_model": "numpy", "nogil": True, "cache": True}
EXACT = FAST | {"fastmath": False}
HOUSE = Path(__file__).parents[1]
ALWAYS = (HOUSE / "compute", HOUSE / "sph")
IMPORT = re.compile(r"^(?:from\s+(\S+)\s+import\s+(\([^)]*\)|.*)|import\s+(.*))", re.MULTILINE)
WORD = re.compile(r"[\w.]+")


def place_cache(sources: Path) -> str:
    """Where compiled code can be kept neither beside the sources nor in the user's cache, which numba refuses, keep it in a
    temporary folder of the user's; a note of that, empty otherwise."""
    from numba.misc.appdirs import AppDirs

    own = AppDirs(appname="numba", appauthor=False).user_cache_dir
    if config.CACHE_DIR or any(map(_can_write, (sources / "__pycache__", Path(own)))):
        return ""
    who = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir(), f"spindrift-compiled-{who}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        facts = folder.lstat()
        if hasattr(os, "getuid") and (facts.st_uid != who or facts.st_mode & 0o22 or not stat.S_ISDIR(facts.st_mode)):
            raise PermissionError  # compiled code is run: nobody else may put it there
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="spindrift-compiled-"))
    config.CACHE_DIR = str(folder)
    return f"compiled code is kept in {folder}: neither the installation nor the user's cache can be written"


def _can_write(folder: Path) -> bool:
    """Whether files can be made in a folder, or the folder itself."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def without_blas() -> None:
    """Load numba's array functions without its look for BLAS, which imports scipy.linalg, a tenth of a start: no kernel of ours
    calls BLAS, and kernels of others that do are asked for it when they are compiled. Another numba may not look."""
    from numba.np import linalg

    asked = getattr(linalg, "ensure_blas", None)
    if asked is None:
        return
    linalg.ensure_blas = lambda: None
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = asked


NOTE = place_cache(HOUSE / "compute")
without_blas()


def compiled(*variant, bare: bool = False):
    """Compile a kernel closed over these constants, cached on disk, without the GIL; sums may be reordered. A `bare` one
    allocates nothing, and so counts no references to arrays, which costs as much as a dozen neighbours."""

    def decorate(function):
        _name(function, variant)
        return njit(**FAST, _nrt=not bare)(function)

    return decorate


def exact(function):
    """Compile a function that moves data or is no sum over pairs, cached on disk, without the GIL, as it is written."""
    _name(function, ())
    return njit(**EXACT)(function)


def helper(*variant, inline: bool = False):
    """A function that kernels of this variant call; `inline`: compiled into each of its callers, whatever its size, and not
    simplified by itself before. What it calls would follow it in that, had it no choice of its own."""

    def decorate(function):
        _name(function, variant)
        return register_jitable(inline="always" if inline else "never")(function)

    return decorate


def _name(function, variant) -> None:
    """Name a function, and have its module hold it by that name: numba tells kernels apart by what they are closed over, and
    would take two copies of a helper for two, one from the source and one as Python has it on disk."""
    module = function.__module__
    parts = module.rpartition(".")[2], function.__name__, *variant, fingerprint(module)
    function.__qualname__ = "_".join(map(str, parts))
    setattr(sys.modules[module], function.__qualname__, function)


@cache
def fingerprint(module: str) -> str:
    """Eight digits that change with any source that a kernel of this module can be made of."""
    files = {file for room in ALWAYS for file in room.glob("*.py")} | _reached(module)
    text = b"".join(file.name.encode() + b"\0" + _source(file) for file in sorted(files))
    return hashlib.sha256(text).hexdigest()[:8]


def _reached(module: str) -> set[Path]:
    """Files of this module and of those that it imports, directly or through others, in its own package and in `fsi`."""
    packages = {__package__.partition(".")[0], module.partition(".")[0]}
    found, waiting = {}, [module]
    while waiting:
        name = waiting.pop()
        file = getattr(sys.modules.get(name), "__file__", None)
        if name in found or name.partition(".")[0] not in packages or file is None:
            continue
        found[name] = Path(file)
        waiting += _imports(Path(file), name)
    return set(found.values())


@cache
def _source(file: Path) -> bytes:
    return file.read_bytes()


@cache
def _imports(file: Path, name: str) -> list[str]:
    """Names of the modules that a module imports when it is itself imported; those of attributes with them, and words that
    only look like them. To parse the source takes ten times as long."""
    names, package = [], name if file.name == "__init__.py" else name.rpartition(".")[0]
    for base, attributes, modules in IMPORT.findall(_source(file).decode()):
        if base:
            base = importlib.util.resolve_name(base, package)
            names += [base, *(f"{base}.{one}" for one in WORD.findall(attributes))]
        names += WORD.findall(modules)
    return names
