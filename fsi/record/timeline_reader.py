"""Reads particle snapshots back from the timeline of a run."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.fields import VALUE

END = b"RRF2FOOT"  # near the end of a recording that was closed
FLUID, FIRST, VALUES = "/world/fluid", "Points3D:class_ids", "/values"


@dataclass(frozen=True)
class Snapshot:
    """Particles at a time [s]: position (n, 3) [m], the level (n,) of the first field of `output.fields`, 0 to 255 over
    the range of its colours, or 256 and up for categories, and the radius [m] they are drawn with."""

    time: float
    position: np.ndarray
    level: np.ndarray
    radius: float


def read_snapshots(recording: Path, times: Sequence[float]) -> list[Snapshot]:
    """The snapshots nearest to these times, each once, in order; only those are held in memory. Raises SceneError where
    there is no recording or it cannot be read."""
    rr = require("rerun", "viewer", "particle snapshots")
    if not Path(recording).is_file():
        raise SceneError("no timeline", file=recording, fix="run the scene with output.timeline = true")
    nearest: dict[float, tuple[float, Snapshot]] = {}
    with TemporaryDirectory() as folder:
        for columns in _chunks(rr, Path(recording), Path(folder, "whole.rrd")):
            for row, stamp in enumerate(columns["sim_time"].cast("int64").to_numpy() * 1e-9):
                closer = [t for t in times if t not in nearest or abs(stamp - t) < nearest[t][0]]
                snapshot = _row(columns, row, float(stamp)) if closer else None
                nearest |= {t: (abs(stamp - t), snapshot) for t in closer}
    found = {snapshot.time: snapshot for _, snapshot in nearest.values()}
    return [found[time] for time in sorted(found)]


def _chunks(rr, recording: Path, mended: Path, entity: str = FLUID) -> Iterator[dict]:
    """Columns of the recording's chunks of an entity; what a killed run has written whole is put into `mended` first."""
    if not mended.is_file() and not _closed(recording):
        _merge(recording, mended)
    try:
        for chunk in rr.chunk.RrdReader(mended if mended.is_file() else recording).stream():
            if str(chunk.entity_path) == entity and not chunk.is_static:
                batch = chunk.to_record_batch()
                yield dict(zip(batch.schema.names, batch.columns, strict=True))
    except (OSError, ValueError, RuntimeError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=recording, fix="run the scene again") from None


def mend(recording: Path) -> None:
    """Close a recording that was written in parts, or cut off."""
    new = recording.with_suffix(".rrd.new")
    if not _closed(recording) and _merge(recording, new):
        os.replace(new, recording)


def _merge(recording: Path, into: Path) -> bool:
    """Write all whole parts of a recording as one; whether that went well."""
    command = [sys.executable, "-m", "rerun", "rrd", "merge", "--continue-on-error", str(recording), "-o", str(into)]
    return subprocess.run(command, capture_output=True).returncode == 0 and into.is_file()


def _closed(recording: Path) -> bool:
    with recording.open("rb") as file:
        file.seek(max(0, recording.stat().st_size - 12))
        return END in file.read()


def _row(columns: dict, row: int, time: float) -> Snapshot:
    position = columns["Points3D:positions"][row].values.flatten().to_numpy().reshape(-1, 3)
    radius = float(columns["Points3D:radii"][row].values[0].as_py())
    return Snapshot(time, position, columns[FIRST][row].values.to_numpy(), radius)


def read_values(recording: Path) -> Iterator[tuple[float, dict[str, np.ndarray]]]:
    """Time [s] and the arrays that `output.values` kept, in the order of time, one frame after the other in memory: `position`,
    `velocity` (n, 3), `pressure` and fields (n,), all float32; nothing where it was off. Raises SceneError where there is
    no recording or it cannot be read."""
    rr = require("rerun", "viewer", "particle values")
    if not Path(recording).is_file():
        raise SceneError("no timeline", file=recording, fix="run the scene with output.timeline = true")
    with TemporaryDirectory() as folder:
        whole = Path(folder, "whole.rrd")
        rows = [
            (float(stamp), number, row)
            for number, columns in enumerate(_chunks(rr, Path(recording), whole, VALUES))
            for row, stamp in enumerate(columns["sim_time"].cast("int64").to_numpy() * 1e-9)
        ]
        order = sorted(rows)
        waiting: dict[tuple[int, int], dict] = {}  # chunks may be out of order: what comes early waits
        place = iter(order)
        wanted = next(place, None)
        for number, columns in enumerate(_chunks(rr, Path(recording), whole, VALUES)):
            for row in range(len(columns["sim_time"])):
                waiting[number, row] = _values(columns, row)
            while wanted and (arrays := waiting.pop(wanted[1:], None)) is not None:
                yield wanted[0], arrays
                wanted = next(place, None)


def _values(columns: dict, row: int) -> dict[str, np.ndarray]:
    found = {}
    for name, column in columns.items():
        if name.startswith(VALUE) and column[row].is_valid:
            array = column[row].values.to_numpy(zero_copy_only=False).astype(np.float32)
            short = name.removeprefix(VALUE)
            found[short] = array.reshape(-1, 3) if short in ("position", "velocity") else array
    return found
