"""A user's own Python that a scene names as `FILE.py:NAME`: it runs only where the user trusts it (`fsi.trust`)."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from fsi.errors import SceneError
from fsi.trust import check_bytes, may_run

MOST_BYTES = 10e6  # of a file of code


def load(place: Path, key: str, source: object) -> Callable[..., Any] | None:
    """The function or class that `place` names; `key` is the part of the scene that has it under `function`. None where a scene
    is checked, and no code of it runs. Raises SceneError where there is no such name, or no trust."""
    path, _, name = str(place).rpartition(":")
    if not path or not Path(path).is_file():
        fix = 'write function = "FILE.py:NAME", the file relative to the scene\'s'
        raise SceneError(f"no file {path or name!r}", key=f"{key}.function", file=source, fix=fix)
    file = Path(path)
    check_bytes(file, MOST_BYTES, "put data into a file of its own")
    if not may_run(file, f"{key}.function", source):
        _refuse_unknown(name, _defined(file), file, key, source)
        return None
    spec = spec_from_file_location(f"user_{file.stem}", file)
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as fault:  # of any kind: it is the user's code
        raise SceneError(f"{type(fault).__name__}: {fault}", file=file, fix="correct it") from fault
    _refuse_unknown(name, [n for n, value in vars(module).items() if callable(value)], file, key, source)
    return getattr(module, name)


def _refuse_unknown(name: str, known: Sequence[str], path: Path, key: str, source: object) -> None:
    if name not in known:
        public = ", ".join(n for n in known if not n.startswith("_")) or "none"
        raise SceneError(f"no function {name!r}", key=f"{key}.function", file=source, fix=f"{path} has: {public}")


def _defined(path: Path) -> list[str]:
    """Names that a file gives to what may be a function, found without running it."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError) as fault:
        raise SceneError(f"{type(fault).__name__}: {fault}", file=path, fix="correct it") from None
    names = [
        alias.asname or alias.name for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom) for alias in n.names
    ]
    names += [
        target.id for n in ast.walk(tree) if isinstance(n, ast.Assign) for target in n.targets if hasattr(target, "id")
    ]
    return names + [n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.ClassDef)]
