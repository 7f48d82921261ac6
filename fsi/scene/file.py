"""Scenes from TOML files and built-in names, and back to TOML with every default written out."""

from __future__ import annotations

import re
import reprlib
import tomllib
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from pydantic import ValidationError

from fsi import plugins
from fsi.errors import SceneError
from fsi.scene.check import check_scene
from fsi.scene.faults import fault_lines
from fsi.scene.model import Scene
from fsi.scene.toml import dumps
from fsi.trust import check_bytes

MOST_BYTES = 20e6  # of a scene file
LONG_KEY = re.compile(r'(?<![\w"-])(?:(?:[\w-]+|"[^"\n]*")\s*\.\s*){32}')  # parsing it takes the square of its length
HEADER = "# Every value of the scene, defaults included: running this file gives the same run again.\n\n"


def load_scene(source: str | Path | Scene, overrides: Iterable[str] = (), level: str | None = None) -> Scene:
    """The scene of a TOML file, of a built-in name, or a given one: `load_scene("flap", ["waves.period=2.0"])`.

    Each override reads `a.b[0].c=value`; the value is TOML, a bare word is a string, an empty value restores the
    default. `level` names a table `[levels.NAME]` of the file, whose keys and values are applied before the overrides.
    Relative paths in the file start at its folder. Raises SceneError, one line per fault, all at once.
    """
    if isinstance(source, Scene):
        data, label, folder = source.model_dump(mode="json", exclude_none=True), source.name, Path()
    else:
        path = _find(source)
        data, label, folder = read_toml(path), path.name, path.absolute().parent
        data.setdefault("name", re.sub(r"[^\w.-]", "_", path.stem))
    _apply_level(data, level, label)
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


def scene_levels(source: str | Path) -> dict[str, dict]:
    """Level -> the values that it changes, as the scene file has them under `[levels]`; empty where it has none."""
    return read_toml(_find(source)).get("levels", {})


def builtin_scenes() -> dict[str, Path]:
    """Name -> file of the scenes that installed packages bring, found without importing them; of two of the same name the
    first, ours before those of others (`load_scene` refuses the name)."""
    return {name: files[0] for name, files in _brought().items()}


def _brought() -> dict[str, list[Path]]:
    """Name -> files of the scenes by that name that installed packages bring."""
    found: dict[str, list[Path]] = {}
    for folder in plugins.folders("scenes"):
        for file in sorted(folder.glob("*.toml")):
            found.setdefault(file.stem, []).append(file)
    return found


def namesakes(source: str | Path) -> list[str]:
    """A note where a built-in name was given and a file of that name stands in the current folder, which is not read."""
    name, brought = str(source), _brought()
    if name not in brought or Path(name).is_file():
        return []
    here, (built, *_) = Path(f"{name}.toml"), brought[name]
    if not here.is_file() or here.samefile(built):
        return []
    return [
        f"{name} is the built-in scene {built}; the file {here} of this folder is another: name it {here} to run it"
    ]


def scene_folder(source: str | Path) -> Path:
    """The folder of the file of a scene, from which its relative paths count."""
    return _find(source).absolute().parent


def _find(source: str | Path) -> Path:
    try:
        path = Path(source).expanduser()
        if path.is_file():
            return path
    except (OSError, RuntimeError, ValueError) as fault:  # too long, a home that is not there, a null byte
        why = getattr(fault, "strerror", None) or str(fault)
        raise SceneError(f"cannot be read: {why}", file=source, fix="check the path") from None
    builtin = _brought()
    name = str(source)
    if name in builtin:
        first, *others = builtin[name]
        if others:
            fault = f"several packages bring a scene by that name: {first}, {', '.join(map(str, others))}"
            raise SceneError(fault, file=name, fix="give the path of one of them, or uninstall a package")
        return first
    if path.suffix == ".toml" or len(path.parts) > 1:
        raise SceneError("no such file", file=name, fix="give the path of a scene, or a name that `fsi cases` lists")
    close = get_close_matches(name, builtin, n=1)
    fix = f"did you mean {close[0]}?" if close else f"built-in are {', '.join(builtin)}"
    raise SceneError(f"neither a file nor a built-in scene; {fix}", file=name)


def read_toml(path: Path) -> dict:
    """The tables of a file. Raises SceneError for one that is missing, too long, nested too deeply or no TOML."""
    check_bytes(path, MOST_BYTES, "shorten it")
    try:
        text = path.read_text(encoding="utf-8")
        if LONG_KEY.search(text):
            raise RecursionError
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError("is nested too deeply", file=path.name, fix="see docs/guide for what it may hold") from None
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=path, fix="check the path") from None
    except ValueError as fault:  # its syntax, its encoding, or an integer of thousands of digits
        raise SceneError(f"not TOML: {fault}", file=path.name, fix="see toml.io for the syntax") from None


def _apply_level(data: dict, level: str | None, label: str) -> None:
    """Take `[levels]` out of a scene's data and apply the one that is asked for; its keys may be dotted in quotes."""
    levels = data.pop("levels", {})
    if level is None:
        return
    if level not in levels:
        fix = f"choose from {', '.join(levels)}" if levels else "the scene has one resolution; change it with --set"
        raise SceneError(f"no level {level!r}", key="--level", file=label, fix=fix)
    for key, value in levels[level].items():
        _set(data, key, value)


def _override(data: dict, text: str) -> None:
    """Set one `a.b[0].c=value` in the scene's data."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise SceneError(f"{text!r} is not KEY=VALUE", key="--set", fix="write e.g. --set waves.period=2.0")
    _set(data, key, _typed(value.strip()) if value.strip() else None)


def key_steps(key: str) -> list[str | int]:
    """The steps to the value at `a.b[0].c`: names, and numbers of items."""
    tokens = re.findall(r'"([^"]*)"|([^.\[\]"\s]+)|\[(\d+)\]', key)
    return [int(index) if index else quoted or word for quoted, word, index in tokens]


def _set(data: dict, key: str, value) -> None:
    """Set the value at `a.b[0].c`; None takes it away."""
    steps = key_steps(key)
    try:
        *parents, last = steps
        for step in parents:
            data = data[step] if isinstance(data, list) else data.setdefault(step, {})
        if isinstance(last, int) != isinstance(data, list):
            raise TypeError
        if value is not None:
            data[last] = value
        elif last in data or isinstance(last, int):
            del data[last]
    except (TypeError, IndexError, AttributeError, ValueError):
        raise SceneError(f"the scene has no {key.strip()}", key="--set", fix="see `fsi check SCENE`") from None


def _typed(text: str):
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    except (RecursionError, ValueError) as fault:
        raise SceneError(f"{reprlib.repr(text)}: {fault}", key="--set", fix="write a TOML value") from None
