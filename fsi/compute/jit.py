"""Compiling the variants of a kernel so that numba's disk cache can be trusted.

A factory closes a kernel over constants (lanes, dimension, terms). numba names compiled code after the function and a
counter of the process, so two variants compiled in different processes can carry the same name, and the second one loaded
would run the first one's code. Each variant therefore gets a name of its own, which also holds a fingerprint of the
modules that are compiled into every sweep: numba looks only at the file of the kernel itself for changes.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from numba import njit
from numba.extending import register_jitable

FAST = {"fastmath": True, "error_model": "numpy", "nogil": True, "cache": True}
SHARED = ("compute/lanes.py", "compute/jit.py", "sph/terms.py")


@cache
def _fingerprint() -> str:
    here = Path(__file__).parents[1]
    return hashlib.sha256(b"".join((here / name).read_bytes() for name in SHARED)).hexdigest()[:8]


def _name(function, variant) -> None:
    function.__qualname__ = "_".join([function.__name__, *(str(v) for v in variant), _fingerprint()])


def compiled(*variant):
    """Compile a kernel closed over these constants, cached on disk, without the GIL."""

    def decorate(function):
        _name(function, variant)
        return njit(**FAST)(function)

    return decorate


def helper(*variant):
    """The same for a function that kernels of this variant call."""

    def decorate(function):
        _name(function, variant)
        return register_jitable(function)

    return decorate
