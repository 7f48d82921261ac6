"""The folder of a run: `scene.toml`, `run.json`, `run.mcap`, `run.rrd`; and its series as a dataset."""

from __future__ import annotations

import json
import os
import platform
import socket
import threading
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene

if TYPE_CHECKING:
    from xarray import Dataset

PACKAGES = ("spindrift", "numpy", "numba", "mcap", "mujoco", "rerun-sdk")


class RunFolder:
    """A folder that holds one run, and its manifest `run.json`."""

    def __init__(self, path: Path):
        self.path = path
        self.manifest: dict = {}
        self._lock = threading.Lock()

    @classmethod
    def choose(cls, scene: Scene, out: str | Path | None = None) -> RunFolder:
        """The folder `out`, or the first of `runs/NAME`, `runs/NAME-2`, ... that holds no run; nothing is made yet.

        Raises SceneError where `out` holds a run.
        """
        path = Path(out).expanduser() if out else _free(Path("runs") / scene.name)
        if _holds_run(path):
            fault, fix = f"{path} already holds a run", "choose another folder or remove it"
            if (status := liveness(read_manifest(path))) in ("interrupted", "killed"):
                fault, fix = f"{fault}, which was {status}", f"go on with `fsi resume {path}`, or {fix}"
            raise SceneError(fault, key="--out", fix=fix)
        return cls(path)

    def create(self, scene: Scene, **facts) -> None:
        """Make the folder, with `scene.toml` and a manifest of status `running`. SceneError where that cannot be."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            (self.path / "scene.toml").write_text(resolved_toml(scene), encoding="utf-8")
            self.write(status="running", reason="", scene=scene.name, **_circumstances(), **process(), **facts)
        except OSError as fault:
            raise SceneError(
                f"{self.path} cannot be written: {fault.strerror}", key="--out", fix="choose another folder"
            ) from None

    def write(self, **facts) -> None:
        """Add facts to the manifest and replace `run.json` in one go, so that it is never half written."""
        with self._lock:
            self.manifest |= facts
            new = self.path / "run.json.new"
            new.write_text(json.dumps(self.manifest, indent=2, default=_plain) + "\n", encoding="utf-8")
            os.replace(new, self.path / "run.json")

    def beat(self) -> None:
        """Renew the sign of life."""
        self.write(heartbeat=_now())


def read_manifest(path: str | Path) -> dict:
    """The contents of `run.json`. Raises SceneError where the folder holds no run."""
    try:
        return json.loads(Path(path, "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise SceneError(f"{path} holds no run", fix="give the folder that `fsi run` named") from None


SILENT = 60.0  # wall time [s] without a sign of life, after which a run on another machine counts as killed


def process() -> dict:
    """Who writes a run: for `liveness`."""
    return {"pid": os.getpid(), "host": socket.gethostname(), "heartbeat": _now()}


def liveness(manifest: dict) -> str:
    """The status of a run, with `killed` for one that was running and whose process is no more."""
    if manifest.get("status") != "running" or "pid" not in manifest:
        return manifest.get("status", "")
    if manifest["host"] == socket.gethostname():
        try:
            os.kill(int(manifest["pid"]), 0)
        except ProcessLookupError:
            return "killed"
        except PermissionError:
            pass
    quiet = datetime.now(UTC) - datetime.fromisoformat(manifest["heartbeat"])
    return "killed" if quiet.total_seconds() > SILENT else "running"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def load_run(path: str | Path) -> Dataset:
    """The time series of a run as an `xarray.Dataset`, also of one that is still running or was killed.

    Dimensions `time`, `axis`, `wxyz`, `body`, `dry_body`, `joint`, `gauge`, `probe` and those of the other instruments
    (`fsi.record.series`); every variable has `units` and `long_name`;
    coordinates `step` and `wall_time` run along `time`. `event_time`, `event_level` and `event_text` run
    along `event`. Attributes: facts on the scene and on how the run ended.
    Raises SceneError where the folder holds no log.
    """
    xarray = require("xarray", "report", "load_run")
    from fsi.record.mcap_reader import read_log

    manifest = read_manifest(path)
    if not Path(path, "run.mcap").exists():
        raise SceneError(f"{path} has no log", fix="run the scene with output.mcap = true")
    log = read_log(Path(path, "run.mcap"))
    dataset = xarray.Dataset(attrs=_attributes(manifest, log))
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
    kinds = json.loads(log.scene.get("joint_kind", "[]"))
    if "joint" in dataset.dims:
        dataset = dataset.assign_coords(joint_kind=("joint", kinds))
    return dataset


def export(path: str | Path, to: str = "nc") -> Path:
    """Write the series of a run beside it, as `run.nc` (netCDF 4) or `run.csv`; returns the file.

    The CSV has one row a time and one column for each element of each variable, headed e.g. `body_force.flap.x [N]`;
    it leaves the events out.
    """
    dataset = load_run(path)
    file = Path(path, f"run.{to}")
    try:
        if to == "nc":
            for package in ("h5py", "h5netcdf"):
                require(package, "report", "export to netCDF")
            dataset.to_netcdf(file, engine="h5netcdf")
        else:
            _write_csv(dataset, file)
    except OSError as fault:
        raise SceneError(f"{file} cannot be written: {fault.strerror or fault}") from None
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


def _attributes(manifest: dict, log) -> dict:
    """What netCDF can hold of the run's facts: strings and numbers."""
    scene = log.scene
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


def _free(path: Path) -> Path:
    """`path`, or the first of `path-2`, `path-3`, ... that holds no run."""
    candidate, n = path, 1
    while _holds_run(candidate):
        n += 1
        candidate = path.with_name(f"{path.name}-{n}")
    return candidate


def _holds_run(path: Path) -> bool:
    return (path / "run.json").exists()


def _circumstances() -> dict:
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    machine = {
        "system": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
    }
    return {"started": datetime.now(UTC).isoformat(), "versions": versions, "machine": machine}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def _plain(value):
    """Numbers and arrays of numpy as JSON has them."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)
