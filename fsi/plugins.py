"""Finds what `fsi` does not import: entry points of the installed packages, ours and those of others.

A package registers a thing in its pyproject.toml, under the group `spindrift.GROUP`; nothing of ours has to be edited:

| group     | name                 | value                                                                      |
|-----------|----------------------|----------------------------------------------------------------------------|
| commands  | of `fsi NAME`        | a function with typer's annotations; the first line of its docstring is shown |
| functions | `sweep`, `report`, ... | what `fsi.sweep(...)` and its like call                                    |
| engines   | `mujoco`             | a module with `load(scene, source)`, `mesh_solid(file, dimension, crop)`,
|           |                      | `grid_solid(scene, crop)` |
| couplers  | of the scheme        | a subclass of `fsi.scene.coupler.CouplerSettings`                          |
| waves     | of the kind          | a subclass of `fsi.waves.kind.WaveKind`                                    |
| fields    | of the output field  | a `fsi.scene.fields.ParticleField`                                         |
| scenes    | any                  | a package or folder of a package that holds scenes, NAME.toml              |
| cases     | of the validation case | a module whose `CASES` holds it                                          |

Nothing is imported before it is used, and nothing is looked up that no scene or command asks for.
"""

from __future__ import annotations

import ast
import sys
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsi.errors import SceneError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

OURS = "spindrift"
_GROUPS = ("commands", "functions", "engines", "couplers", "waves", "fields", "scenes", "cases")


def registered(group: str) -> dict[str, tuple[EntryPoint, ...]]:
    """Name -> entry points of that name in a group; more than one where packages contradict each other."""
    return _by_group(tuple(sys.path)).get(f"{OURS}.{group}", {})


@lru_cache(maxsize=4)
def _by_group(path: tuple[str, ...]) -> dict[str, dict[str, tuple[EntryPoint, ...]]]:
    """Group -> name -> entry points, of the packages on this search path."""
    from importlib.metadata import entry_points

    found: dict[str, dict[str, tuple[EntryPoint, ...]]] = {}
    for group in (every := entry_points()).groups:
        if group.startswith(f"{OURS}."):
            names = found.setdefault(group, {})
            for entry in sorted(
                every.select(group=group), key=lambda entry: _package(entry) != OURS
            ):  # ours come first
                if all(entry.value != other.value for other in names.get(entry.name, ())):  # installed twice
                    names[entry.name] = (*names.get(entry.name, ()), entry)
    return found


def find(group: str, name: str) -> Any:
    """The thing that is registered by that name. Raises SceneError where none or more than one is, or where the package
    that brings it cannot be imported."""
    entries = registered(group).get(name, ())
    what = f"{group.removesuffix('s')} {name!r}"
    if not entries:
        known = ", ".join(registered(group))
        fix = f"known are {known}" if known else "install spindrift anew, e.g. pip install -e ."
        raise SceneError(f"no package brings the {what}", fix=fix)
    if len(entries) > 1:
        packages = ", ".join(map(_package, entries))
        raise SceneError(f"several packages bring the {what}: {packages}", fix="uninstall all but one of them")
    try:
        return entries[0].load()
    except SceneError:  # an optional package is missing, and the error says which
        raise
    except Exception as fault:
        package = _package(entries[0])
        raise SceneError(
            f"the {what} of the package {package!r} ({entries[0].value}) cannot be loaded: {type(fault).__name__}: {fault}",
            fix=_remedy(entries[0]),
        ) from fault


def check_ours(group: str, name: str) -> None:
    """Raise SceneError where another package brings a thing by the name of one of ours, which stands in no group."""
    if entries := registered(group).get(name, ()):
        packages = ", ".join(map(_package, entries))
        fault = f"the {group.removesuffix('s')} {name!r} is one of ours, and {packages} brings another by that name"
        raise SceneError(fault, fix="rename it there, or uninstall that package")


def hidden(top: str) -> str:
    """What to do where Python finds another folder by the name of a package of ours first, such as `bodies` or `cases` of the
    folder that it was started in; empty where it does not."""
    ours = {
        e.module.partition(".")[0] for g in _GROUPS for es in registered(g).values() for e in es if _package(e) == OURS
    }
    place, home = _place(top), Path(__file__).resolve().parents[1]
    if top in ours and place and place.resolve().parent != home:
        return f"{place} hides Spindrift's package {top!r}: rename it, or run the command fsi instead of python in that folder"
    return ""


def _remedy(entry: EntryPoint) -> str:
    """What to do about an entry that cannot be loaded."""
    top = entry.module.partition(".")[0]
    return (hidden(top) if _package(entry) == OURS else "") or f"repair or uninstall {_package(entry)}"


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else "unknown"


def summary(group: str, name: str) -> str:
    """First line of the docstring of a registered function, read from its source, so that nothing is imported."""
    entry = registered(group)[name][0]
    file = _source(entry.module)
    try:
        tree = ast.parse(file.read_text(encoding="utf-8")) if file else ast.Module([], [])
    except (OSError, SyntaxError, ValueError):
        tree = ast.Module([], [])
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == entry.attr:
            return (ast.get_docstring(node) or "").partition("\n")[0]
    return f"From the package {_package(entry)}."


def _source(module: str) -> Path | None:
    """The file of a module, without importing it or its packages; None where there is none to read."""
    place = _place(module)
    files = (place / "__init__.py", place.with_suffix(".py")) if place else ()
    return next((file for file in files if file.is_file()), None)


def _place(module: str) -> Path | None:
    """Path of a module or a folder in its package, without suffix; None where the package is not there."""
    top, *rest = module.split(".")
    try:
        spec = find_spec(top)
    except ValueError:
        return None
    if spec is None:
        return None
    if spec.submodule_search_locations:
        return Path(next(iter(spec.submodule_search_locations)), *rest)
    return Path(spec.origin).with_suffix("") if spec.origin and not rest else None


def folders(group: str) -> list[Path]:
    """The folders that are registered in a group, in the order of the packages, ours first; nothing is imported.
    Raises SceneError where one is not there."""
    found = []
    for name, entries in registered(group).items():
        for entry in entries:
            place = _place(entry.module)
            if place is None or not place.is_dir():
                package = _package(entry)
                fault = f"the {group} {name!r} of the package {package!r} are in no folder: {entry.value}"
                raise SceneError(fault, fix=_remedy(entry))
            found.append(place)
    return found


def packages() -> list[Path]:
    """Folders of the packages that have registered anything; nothing is imported."""
    tops = {entry.module.partition(".")[0] for group in _GROUPS for es in registered(group).values() for entry in es}
    return [place for top in sorted(tops) if (place := _place(top)) is not None]


def function(name: str) -> Any:
    """The function behind `fsi.NAME`, see `find`."""
    return find("functions", name)


def engine(name: str = "mujoco") -> Any:
    """The module that loads bodies and bathymetries, see `find`."""
    module = find("engines", name)
    if not hasattr(module, "load"):
        entry = registered("engines")[name][0]
        raise SceneError(f"the engine {name!r} ({entry.value}) loads no bodies", fix=_remedy(entry))
    return module
