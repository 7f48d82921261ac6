"""The folder of a run: `scene.toml`, `run.json`, `run.mcap`, `run.rrd`; and its series as a dataset."""

from __future__ import annotations

import json
import os
import platform
import socket
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsi.errors import RunError, SceneError, short
from fsi.extras import require, version_of
from fsi.record.files import FULL, Claim, new_file, write_text
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene
from fsi.strict_json import dumps, loads

if TYPE_CHECKING:
    from xarray import Dataset

    from fsi.record.mcap_reader import RunLog

PACKAGES = ("spindrift", "numpy", "numba", "mcap", "mujoco", "rerun-sdk")


MANIFEST, SCENE, LOCK = "run.json", "scene.toml", "run.lock"
LOGS = ("run.mcap", "run.rrd")
LEFT = {
    "inputs",
    LOCK,
    "run.json.new",
}  # what a folder may hold before its run: a study's files, and what a kill leaves
SILENT = 60.0  # wall time [s] without a sign of life, after which a run on another machine counts as killed


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
            fault, place = f"{path} is in use by another process", _place(folder.manifest)
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
            self.write(status="running", reason="", scene=scene.name, **_circumstances(), **process(), **facts)
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
                    _overwrite(file, before, facts)
                raise

    def beat(self) -> None:
        """Renew the sign of life. Where that fails twice in a row, `fault` says why."""
        try:
            self.write(heartbeat=_now())
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


def _overwrite(file: Path, before: dict, facts: dict) -> None:
    """Put status and reason into the manifest that is there, in the bytes that it takes already, if they fit."""
    ended = {key: facts[key] for key in ("status", "reason") if key in facts}
    if ended.get("status") == "done":
        ended = {"status": "failed", "reason": "the disk is full: run.json could not be written"}
    text = dumps(before | ended, separators=(",", ":")).encode()
    with suppress(OSError), file.open("r+b") as stream:
        if len(text) <= (room := len(stream.read())):
            stream.seek(0)
            stream.write(text.ljust(room))


def read_manifest(path: str | Path) -> dict:
    """The contents of `run.json`. Raises SceneError where the folder holds no run."""
    try:
        found = loads(Path(path, MANIFEST).read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError
        return {"status": "", "reason": "", "versions": {}} | found
    except FileNotFoundError:
        raise SceneError(f"{short(path)} holds no run", fix="give the folder that `fsi run` named") from None
    except (OSError, ValueError) as fault:
        why = getattr(fault, "strerror", None) or "run.json is damaged"
        raise SceneError(f"{short(path)} holds no run: {why}", fix="give the folder that `fsi run` named") from None


def process() -> dict:
    """Who writes a run: for `liveness`."""
    return {"pid": os.getpid(), "host": socket.gethostname(), "heartbeat": _now()}


def liveness(manifest: dict, claimed: bool = False) -> str:
    """The status of a run, with `killed` for one that was running and whose process is no more; `claimed`: the lock of its
    folder is ours, so that on this machine no other process can have it."""
    if manifest.get("status") != "running" or not {"pid", "host", "heartbeat"} <= manifest.keys():
        return manifest.get("status", "")
    if manifest["host"] == socket.gethostname() and (claimed or not _alive(int(manifest["pid"]))):
        return "killed"
    quiet = datetime.now(UTC) - datetime.fromisoformat(manifest["heartbeat"])
    return "killed" if quiet.total_seconds() > SILENT else "running"


def _alive(pid: int) -> bool:
    """Whether there is such a process; True where the system cannot be asked (on Windows a signal 0 would be Ctrl-C)."""
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True


def _place(manifest: dict) -> str:
    return f" (process {manifest['pid']} on {manifest['host']})" if {"pid", "host"} <= manifest.keys() else ""


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def load_run(path: str | Path) -> Dataset:
    """The time series of a run as an `xarray.Dataset`, also of one that is still running or was killed.

    Dimensions `time`, `axis`, `wxyz`, `body`, `dry_body`, `joint`, `gauge`, `probe` and those of the other instruments
    (`fsi.record.series`); every variable has `units` and `long_name`;
    coordinates `step` and `wall_time` run along `time`. `event_time`, `event_level` and `event_text` run
    along `event`. Attributes: facts on the scene and on how the run ended.
    What damage has taken from the log is left out, and said: as a RuntimeWarning, and in the attribute `damage` (empty where
    nothing is missing). A run that ended before its first frame has none, which is no error.
    Raises SceneError where the folder holds no log.
    """
    xarray = require("xarray", "report", "load_run")
    from fsi.record.mcap_reader import read_log

    manifest = read_manifest(path)
    if not Path(path, "run.mcap").exists():
        why = f" (the run {manifest['status']}: {manifest['reason']})" if manifest["reason"] else ""
        raise SceneError(f"{path} has no log{why}", fix="run the scene with output.mcap = true")
    log = read_log(Path(path, "run.mcap"))
    if damage := damage_of(log, manifest):
        warnings.warn(f"{path}: {damage}", RuntimeWarning, stacklevel=2)
    dataset = xarray.Dataset(attrs=_attributes(Path(path), manifest, log) | {"damage": damage})
    dataset["time"] = "time", log.time, {"units": "s", "long_name": "simulated time"}
    dataset = dataset.assign_coords(
        step=("time", log.step, {"units": "1", "long_name": "step"}),
        wall_time=("time", log.wall_time, {"units": "s", "long_name": "wall time since the start"}),
    )
    for name, variable in log.variables.items():
        facts = {"units": variable.units, "long_name": variable.long_name}
        dataset[name] = ("time", *variable.dims), variable.values, facts
        dataset = dataset.assign_coords(variable.labels)
    times, levels, texts = zip(*sorted(log.events), strict=True) if log.events else ((), (), ())
    dataset["event_time"] = "event", np.array(times, float), {"units": "s", "long_name": "time of the event"}
    dataset["event_level"] = "event", np.array(levels, object), {"units": "1", "long_name": "info, warning or error"}
    dataset["event_text"] = "event", np.array(texts, object), {"units": "1", "long_name": "what happened"}
    if "joint" in dataset.dims:
        kinds = json.loads(log.scene.get("joint_kind", "[]")) or ["unknown"] * dataset.sizes["joint"]
        dataset = dataset.assign_coords(joint_kind=("joint", kinds))
    return dataset


def damage_of(log: RunLog, manifest: dict) -> str:
    """What is missing of a log through damage, in words; empty where nothing is."""
    lost = list(log.lost)
    ended = manifest.get("status") in ("done", "failed", "interrupted")
    if ended and not log.closed and not any(after is None for _, after in lost):
        lost.append((float(log.time[-1]) if len(log.time) else None, None))
    parts = [_span(*span) for span in lost]
    if not log.scene:
        parts.append("the facts on the scene, which are taken from scene.toml")
    return f"run.mcap is damaged or cut off; missing is what was logged {', and '.join(parts)}" if parts else ""


def _span(after: float | None, before: float | None) -> str:
    if after is None and before is None:
        return "at times that are not known"
    if after is None:
        return f"before t = {before:.6g} s"
    return f"after t = {after:.6g} s" if before is None else f"between t = {after:.6g} and {before:.6g} s"


def frames_of(path: str | Path) -> Dataset:
    """`load_run` of a run with at least one frame. Raises SceneError where it has none."""
    dataset = load_run(path)
    if dataset.sizes.get("time", 0) == 0:
        fix = "see run.json for how it ended; `fsi resume` goes on with a run that has a checkpoint"
        raise SceneError(f"{path} holds a run without a single frame (status {dataset.attrs['status']})", fix=fix)
    return dataset


def export(path: str | Path, to: str = "nc") -> Path:
    """Write the series of a run beside it, as `run.nc` (netCDF 4) or `run.csv`; returns the file, which is whole or not there.

    The CSV has one row a time and one column for each element of each variable, headed e.g. `body_force.flap.x [N]`;
    it leaves the events out. Raises SceneError where the run has no frame, or the file cannot be written.
    """
    dataset = frames_of(path)
    file = Path(path, f"run.{to}")
    if to == "nc":
        for package in ("h5py", "h5netcdf"):
            require(package, "report", "export to netCDF")
    try:
        with new_file(file) as new:
            if to == "nc":
                dataset.to_netcdf(new, engine="h5netcdf")
            else:
                _write_csv(dataset, new)
    except (OSError, RuntimeError) as fault:  # the second is how HDF5 says that it cannot close a file
        raise SceneError(f"{file} cannot be written: {getattr(fault, 'strerror', None) or fault}") from None
    return file


def _write_csv(dataset, file: Path) -> None:
    heads, columns = ["time [s]"], [dataset["time"].values]
    for name, variable in dataset.data_vars.items():
        if "time" not in variable.dims:
            continue
        names = [list(map(str, dataset[dim].values)) for dim in variable.dims[1:]]
        for index in np.ndindex(variable.shape[1:]):
            label = ".".join([name, *(along[i] for along, i in zip(names, index, strict=True))])
            heads.append(f"{label} [{variable.attrs['units']}]")
            columns.append(variable.values[(slice(None), *index)])
    header = ",".join(f'"{head}"' if "," in head else head for head in heads)
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")


def _attributes(path: Path, manifest: dict, log: RunLog) -> dict:
    """What netCDF can hold of the run's facts: strings and numbers."""
    scene = log.scene or _facts_of(path)
    numbers = {key: float(scene[key]) for key in ("spacing", "width", "rho", "g") if key in scene}
    return {
        "scene": scene.get("name", manifest.get("scene", "")),
        "status": liveness(manifest),
        "reason": manifest["reason"],
        "spindrift_version": manifest["versions"].get("spindrift", ""),
        "dimension": int(scene.get("dimension", 0)),
        **numbers,
        "log_complete": int(log.complete),
    }


def _facts_of(path: Path) -> dict:
    """Facts on the scene from `scene.toml`, where the log has lost them."""
    from fsi.scene.file import load_scene

    try:
        scene = load_scene(path / SCENE)
    except SceneError:
        return {}
    numbers = {"spacing": scene.spacing, "width": scene.tank.width, "rho": scene.fluid.density, "g": scene.gravity}
    return {"name": scene.name, "dimension": scene.dimension} | numbers


def _names(path: Path) -> Iterator[Path]:
    """`path`, `path-2`, `path-3`, ..."""
    yield path
    for n in count(2):
        yield path.with_name(f"{path.name}-{n}")


def _holds_run(path: Path) -> bool:
    return (path / MANIFEST).exists()


def _circumstances() -> dict:
    versions = {"python": platform.python_version()}
    versions |= {package: number for package in PACKAGES if (number := version_of(package))}
    machine = {
        "system": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        **(
            {"memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")} if hasattr(os, "sysconf") else {}
        ),
    }
    return {"started": datetime.now(UTC).isoformat(), "versions": versions, "machine": machine}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
