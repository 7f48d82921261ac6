"""Scenes from TOML files and built-in names, and back to TOML with every default written out."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from difflib import get_close_matches
from importlib.util import find_spec
from pathlib import Path

from pydantic import ValidationError

from fsi.errors import SceneError
from fsi.scene import Scene
from fsi.scene_check import check_scene
from fsi.scene_faults import fault_lines
from fsi.toml_text import dumps

HEADER = "# Every value of the scene, defaults included: running this file gives the same run again.\n\n"


def load_scene(source: str | Path | Scene, overrides: Iterable[str] = ()) -> Scene:
    """The scene of a TOML file, of a built-in name, or a given one: `load_scene("flap", ["waves.period=2.0"])`.

    Each override reads `a.b[0].c=value`; the value is TOML, a bare word is a string, an empty value restores the
    default. Relative paths in the file start at its folder. Raises SceneError, one line per fault, all at once.
    """
    if isinstance(source, Scene):
        data, label, folder = source.model_dump(mode="json", exclude_none=True), source.name, Path()
    else:
        path = _find(source)
        data, label, folder = _read(path), path.name, path.absolute().parent
        data.setdefault("name", re.sub(r"[^\w.-]", "_", path.stem))
    for override in overrides:
        _override(data, override)
    try:
        scene = Scene.model_validate(data, context={"folder": folder})
    except ValidationError as errors:
        raise SceneError("\n".join(fault_lines(errors, data, label))) from None
    check_scene(scene, file=label)
    return scene


def resolved_toml(scene: Scene) -> str:
    """The scene as TOML with every default visible and absolute paths; loading it gives an equal scene."""
    return HEADER + dumps(scene.model_dump(mode="json"))


def builtin_scenes() -> dict[str, Path]:
    """Name -> file of the scenes that come with the package `cases` (found without importing it)."""
    spec = find_spec("cases")
    folder = Path(spec.submodule_search_locations[0], "scenes") if spec else Path()
    return {file.stem: file for file in sorted(folder.glob("*.toml"))} if spec else {}


def _find(source: str | Path) -> Path:
    path = Path(source).expanduser()
    if path.is_file():
        return path
    builtin = builtin_scenes()
    name = str(source)
    if name in builtin:
        return builtin[name]
    if path.suffix == ".toml" or len(path.parts) > 1:
        raise SceneError("no such file", file=name, fix="give the path of a scene, or a name that `fsi cases` lists")
    close = get_close_matches(name, builtin, n=1)
    fix = f"did you mean {close[0]}?" if close else f"built-in are {', '.join(builtin)}"
    raise SceneError(f"neither a file nor a built-in scene; {fix}", file=name)


def _read(path: Path) -> dict:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as fault:
        raise SceneError(f"not TOML: {fault}", file=path.name, fix="see toml.io for the syntax") from None
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=path, fix="check the path") from None


def _override(data: dict, text: str) -> None:
    """Set one `a.b[0].c=value` in the scene's data."""
    key, equals, value = text.partition("=")
    tokens = re.findall(r'"([^"]*)"|([^.\[\]"\s]+)|\[(\d+)\]', key)
    steps = [int(index) if index else quoted or word for quoted, word, index in tokens]
    if not equals or not steps:
        raise SceneError(f"{text!r} is not KEY=VALUE", key="--set", fix="write e.g. --set waves.period=2.0")
    try:
        *parents, last = steps
        for step in parents:
            data = data[step] if isinstance(data, list) else data.setdefault(step, {})
        if isinstance(last, int) != isinstance(data, list):
            raise TypeError
        if value.strip():
            data[last] = _typed(value.strip())
        elif last in data or isinstance(last, int):
            del data[last]
    except (TypeError, IndexError, AttributeError):
        raise SceneError(f"the scene has no {key.strip()}", key="--set", fix="see `fsi check SCENE`") from None


def _typed(text: str):
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
