"""What a scene or a study names: its code runs only where the user says so, and no file is read that has no end.

A Python file is a program and may do all that its user may: read and delete files, send them away. So a power take-off of
`kind = "python"` and the `script` of a study are refused until the user has given `--trust` (in Python `trust=True`), or has
listed the folder of the file in `config_file()`:

    trust = ["~/my_scenes"]    # or true, for all
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from fsi.errors import SceneError

_given: ContextVar[bool] = ContextVar("trust", default=False)
_checking: ContextVar[bool] = ContextVar("checking", default=False)


@contextmanager
def trusting(yes: bool = True) -> Iterator[None]:
    """Within it, the code that scenes name runs; with `yes` false nothing changes."""
    before = _given.set(yes or _given.get())
    try:
        yield
    finally:
        _given.reset(before)


def trusted() -> bool:
    """Whether this stands within `trusting`."""
    return _given.get()


@contextmanager
def checking() -> Iterator[None]:
    """Within it, no code runs and none is refused: scenes are looked at, not run."""
    before = _checking.set(True)
    try:
        yield
    finally:
        _checking.reset(before)


def may_run(code: Path, key: str, source: object) -> bool:
    """Whether the code of a file may run that the scene or study `source` names under `key`; False within `checking`.
    Raises SceneError where the user has not said so."""
    if _checking.get():
        return False
    if _given.get() or _listed(code):
        return True
    fix = (
        f"read {code}; if you trust it, add --trust (in Python trust=True), or list its folder in {config_file()}: "
        f'trust = ["{code.parent}"]'
    )
    raise SceneError(f"names code to run, {code.name}, which may do all that you may", key=key, file=source, fix=fix)


def config_file() -> Path:
    """The user's own configuration, of all scenes: ~/.config/spindrift/config.toml on Linux."""
    import typer

    return Path(typer.get_app_dir("spindrift"), "config.toml")


def _listed(code: Path) -> bool:
    """Whether the user's configuration trusts the folder of a file. Raises SceneError where it cannot be understood."""
    file = config_file()
    try:
        trusted = tomllib.loads(file.read_text(encoding="utf-8")).get("trust", [])
    except FileNotFoundError:
        return False
    except (OSError, ValueError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=file, fix="correct it, or remove it") from None
    if isinstance(trusted, bool):
        return trusted
    if not isinstance(trusted, list) or not all(isinstance(folder, str) and folder for folder in trusted):
        raise SceneError(
            "is neither true nor a list of folders", key="trust", file=file, fix='write trust = ["~/scenes"]'
        )
    folders = [Path(folder).expanduser() for folder in trusted]
    if relative := [folder for folder in folders if not folder.is_absolute()]:
        raise SceneError(
            f"'{relative[0]}' is relative to no folder", key="trust", file=file, fix="begin it with / or ~"
        )
    return any(code.resolve().is_relative_to(folder.resolve()) for folder in folders)


def check_bytes(file: Path, most: float, fix: str) -> None:
    """Raise SceneError for a file that is longer than `most` bytes, or a device or a pipe, which has no end."""
    if file.exists() and not file.is_file():
        raise SceneError("is no file", file=file, fix="give the path of a file")
    if file.is_file() and (size := file.stat().st_size) > most:
        raise SceneError(f"{size / 1e6:.0f} MB, more than the {most / 1e6:.0f} MB that are read", file=file, fix=fix)
