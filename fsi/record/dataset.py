"""The series of a run as a dataset."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.manifest import liveness, read_manifest

if TYPE_CHECKING:
    from xarray import Dataset

    from fsi.record.mcap_reader import RunLog


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
        scene = load_scene(path / "scene.toml")
    except SceneError:
        return {}
    numbers = {"spacing": scene.spacing, "width": scene.tank.width, "rho": scene.fluid.density, "g": scene.gravity}
    return {"name": scene.name, "dimension": scene.dimension} | numbers
