"""The folder of a run: `scene.toml`, `run.json`, `run.mcap`, `run.rrd` and what belongs to them."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from fsi.errors import RunError, SceneError, short
from fsi.record.files import FULL, Claim, write_text
from fsi.record.manifest import MANIFEST, circumstances, liveness, now, overwrite, place_of, process, read_manifest
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene
from fsi.strict_json import dumps

SCENE, LOCK = "scene.toml", "run.lock"
LOGS = ("run.mcap", "run.rrd", "run.clock")
LEFT = {
    "inputs",
    LOCK,
    "run.json.new",
}  # what a folder may hold before its run: a study's files, and what a kill leaves


class RunFolder:
    """A folder that holds one run, and its manifest `run.json`; one process at a time has it, as a context or until `leave`.

    Nothing is written over that is not its own: a folder that holds anything else is refused.
    """

    def __init__(self, path: Path):
        self.path = path
        self.manifest: dict = {}
        self._claim = Claim(path / LOCK)
        self._made: list[Path] = []  # folders that were not there before, the innermost first
        self._lock = threading.Lock()
        self._failed = 0  # signs of life in a row that could not be written
        self.fault = ""  # why the folder can no longer be written

    @classmethod
    def choose(cls, scene: Scene, out: str | Path | None = None) -> RunFolder:
        """Take the folder `out`, or the first of `runs/NAME`, `runs/NAME-2`, ... that holds nothing.

        Raises SceneError where `out` holds something, another process has it, or it cannot be written.
        """
        with _writable(Path(out or "runs"), "--out"):
            paths = [Path(out).expanduser()] if out else _names(Path("runs") / scene.name)
        for path in paths:
            folder = cls(path)
            try:
                folder._take_new()
                return folder
            except _Occupied:
                if out:
                    raise
        raise AssertionError("names do not end")

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Take the folder of a run that is there, with its manifest. Raises SceneError where it holds none, or another process
        has it."""
        folder = cls(Path(path))
        folder.manifest = read_manifest(path)
        with _writable(folder.path, ""):
            taken = folder._claim.take()
        if not taken:
            fault, place = f"{path} is in use by another process", place_of(folder.manifest)
            raise SceneError(fault + place, fix="wait for it, or stop it first")
        folder.manifest = read_manifest(path)
        return folder

    def _take_new(self) -> None:
        with _writable(self.path, "--out"):
            _refuse(self.path)
            missing = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
            self.path.mkdir(parents=True, exist_ok=True)
            self._made = missing
            if not self._claim.take():
                fault, fix = f"another process is at work in {self.path}", "wait for it, or choose another folder"
                raise _Occupied(fault, key="--out", fix=fix)
        try:
            _refuse(self.path)
        except SceneError:
            self.leave()
            raise

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, *_) -> None:
        self.leave()

    def leave(self) -> None:
        """Let other processes have the folder; files without contents go, and folders that were made for nothing."""
        with suppress(OSError):
            for name in (SCENE, *LOGS):
                file = self.path / name
                if self._claim.held and self.manifest and file.is_file() and file.stat().st_size == 0:
                    file.unlink()
        self._claim.drop()
        if not self.manifest:
            with suppress(OSError):
                for folder in self._made:
                    folder.rmdir()

    def create(self, scene: Scene, **facts) -> None:
        """A manifest of status `running`, and `scene.toml`. SceneError where that cannot be."""
        with _writable(self.path, "--out"):
            self.write(status="running", reason="", scene=scene.name, **circumstances(), **process(), **facts)
            write_text(self.path / SCENE, resolved_toml(scene))

    def write(self, **facts) -> None:
        """Add facts to the manifest and replace `run.json` in one go, so that it is never half written. OSError where
        that fails; on a disk that is full, status and reason then go into the file that is there, if they can."""
        with self._lock:
            before, self.manifest = self.manifest, self.manifest | facts
            new, file = self.path / "run.json.new", self.path / MANIFEST
            try:
                new.write_text(dumps(self.manifest, indent=2) + "\n", encoding="utf-8")
                os.replace(new, file)
            except OSError as fault:
                with suppress(OSError):
                    new.unlink(missing_ok=True)
                if fault.errno in FULL:
                    overwrite(file, before, facts)
                raise

    def beat(self) -> None:
        """Renew the sign of life. Where that fails twice in a row, `fault` says why."""
        try:
            self.write(heartbeat=now())
            self._failed = 0
        except OSError as fault:
            self._failed += 1
            self.fault = (fault.strerror or str(fault)) if self._failed > 1 else ""


class _Occupied(SceneError):
    """The folder holds something, or another process has it."""


def _refuse(path: Path) -> None:
    """Raise SceneError where a folder holds anything that a run would mix with, or write over."""
    other = "choose another folder"
    if path.exists() and not path.is_dir():
        raise SceneError(f"{path} is no folder", key="--out", fix=other)
    if _holds_run(path):
        fault, fix = f"{path} already holds a run", f"{other} or remove it"
        status = liveness(read_manifest(path))
        if status in ("interrupted", "killed") or (status == "failed" and _resumable(path)):
            was = "failed" if status == "failed" else f"was {status}"
            fault, fix = f"{fault}, which {was}", f"go on with `fsi resume {path}`, or {fix}"
        raise _Occupied(fault, key="--out", fix=fix)
    held = sorted(entry.name for entry in path.iterdir() if entry.name not in LEFT) if path.is_dir() else []
    if held == ["checkpoints"] and not _resumable(path):
        held = []
    if held:
        more = f" and {len(held) - 1} more" if len(held) > 1 else ""
        fault = f"{path} holds {held[0]}{more}, which no run of Spindrift has made"
        raise _Occupied(fault, key="--out", fix=f"{other}, or an empty one such as {path / 'run'}")


def _resumable(path: Path) -> bool:
    return any((path / "checkpoints").glob("*.checkpoint"))


@contextmanager
def _writable(path: Path, key: str) -> Iterator[None]:
    """SceneError in place of the faults of the system."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as fault:  # a home that is not there, a path with a null byte
        if isinstance(fault, SceneError | RunError):
            raise
        fix = "choose another folder" if key else "see to it that the folder can be written"
        fault = getattr(fault, "strerror", None) or str(fault)
        raise SceneError(f"{short(path)} cannot be written: {fault}", key=key, fix=fix) from None


def _names(path: Path) -> Iterator[Path]:
    """`path`, `path-2`, `path-3`, ..."""
    yield path
    for n in count(2):
        yield path.with_name(f"{path.name}-{n}")


def _holds_run(path: Path) -> bool:
    return (path / MANIFEST).exists()
