"""Validation: every case measures a run against an exact answer or an experiment.

A case is one module in a room of `cases/validation`, with its name in `NAMES` and its `Case` in `CASES`; or one of another
package, registered as an entry point of the group `spindrift.cases` (`fsi.plugins`). Modules are imported on use.
"""

from __future__ import annotations

import ast
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path

from cases.validation.engine.case import LEVELS, Case
from cases.validation.engine.solvers import SOLVERS
from fsi import plugins
from fsi.errors import SceneError

ROOMS = ("fluid", "waves", "coupling", "bodies")


def modules(folder: Path) -> dict[str, tuple[str, ...]]:
    """Module below `cases.validation` -> names of its cases, read from the sources without importing them."""
    found = {}
    for room in ROOMS:
        for file in sorted(Path(folder, room).glob("*.py")):
            values = {
                target.id: node.value
                for node in ast.parse(file.read_text(encoding="utf-8")).body
                if isinstance(node, ast.Assign)
                for target in node.targets
                if isinstance(target, ast.Name)
            }
            if "CASES" in values:
                found[f"{room}.{file.stem}"] = _written(values.get("NAMES"), file)
    return found


def _written(names: ast.expr | None, file: Path) -> tuple[str, ...]:
    """The names of a module's cases, which have to stand in its source."""
    try:
        return tuple(ast.literal_eval(names))
    except (TypeError, ValueError):
        fault = "has CASES without NAMES" if names is None else "has NAMES that are not written out"
        raise SceneError(fault, file=file, fix='add NAMES = ("my_case",)') from None


MODULES = modules(Path(__file__).parents[1])
_OURS = tuple(name for names in MODULES.values() for name in names)
NAMES = (*_OURS, *(name for name in plugins.registered("cases") if name not in _OURS))

__all__ = ["LEVELS", "NAMES", "SOLVERS", "Case", "choose", "load"]


def module_of(name: str) -> str:
    """The module of a case."""
    own = next((module for module, names in MODULES.items() if name in names), None)
    return f"cases.validation.{own}" if own else plugins.registered("cases")[name][0].module


def load(name: str) -> Case:
    """The case of that name. Raises SceneError where its module does not hold it."""
    if name in _OURS:
        plugins.check_ours("cases", name)
    module = import_module(module_of(name)) if name in _OURS else plugins.find("cases", name)
    if name not in module.CASES:
        raise SceneError(f"its CASES have no {name!r}", file=module.__file__, fix="let CASES and the names agree")
    return module.CASES[name]


def choose(patterns: tuple[str, ...] | list[str]) -> list[Case]:
    """The cases that these names, groups such as `still_shapes` or `coupling`, or patterns such as `still_*` ask for, all
    of them if there are none.

    Raises SceneError for a pattern that names no case."""
    chosen = set()
    for pattern in patterns:
        groups = [names for module, names in MODULES.items() if f".{pattern}." in f".{module}."]
        found = (
            [pattern] if pattern in NAMES else sum(groups, ()) or [name for name in NAMES if fnmatchcase(name, pattern)]
        )
        if not found:
            raise SceneError(f"no validation case {pattern!r}", key="CASE", fix=f"known are {', '.join(NAMES)}")
        chosen.update(found)
    return [load(name) for name in NAMES if not patterns or name in chosen]
