"""A user's own Python that a scene names as `FILE.py:NAME`."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from fsi.errors import SceneError


def load(place: Path, key: str, source: object) -> Callable[..., Any]:
    """The function or class that `place` names; `key` is the part of the scene that has it under `function`.
    Raises SceneError where there is none."""
    path, _, name = str(place).rpartition(":")
    fix = 'write function = "FILE.py:NAME", the file relative to the scene\'s'
    if not path or not Path(path).is_file():
        raise SceneError(f"no file {path or name!r}", key=f"{key}.function", file=source, fix=fix)
    spec = spec_from_file_location(f"user_{Path(path).stem}", path)
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as fault:  # of any kind: it is the user's code
        raise SceneError(f"{type(fault).__name__}: {fault}", file=path, fix="correct it") from fault
    found = getattr(module, name, None)
    if not callable(found):
        known = ", ".join(n for n, value in vars(module).items() if callable(value) and not n.startswith("_")) or "none"
        raise SceneError(f"no function {name!r}", key=f"{key}.function", file=source, fix=f"{path} has: {known}")
    return found
