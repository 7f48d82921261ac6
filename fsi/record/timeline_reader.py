"""Reads particle snapshots back from the timeline of a run."""

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.fields import VALUE
from fsi.record.rrd_bytes import DATA, messages, packed, whole_bytes

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


def _chunks(rr, recording: Path, whole: Path, entity: str = FLUID) -> Iterator[dict]:
    """Columns of the recording's chunks of an entity; of one that was cut off, what is whole is put into `whole` first."""
    if not whole.is_file() and (end := whole_bytes(recording)) < recording.stat().st_size:
        shutil.copyfile(recording, whole)
        os.truncate(whole, end)
    try:
        with warnings.catch_warnings(action="ignore"):  # that it has no directory
            reader = rr.chunk.RrdReader(whole if whole.is_file() else recording)
        for chunk in reader.stream():
            if str(chunk.entity_path) == entity and not chunk.is_static:
                batch = chunk.to_record_batch()
                yield dict(zip(batch.schema.names, batch.columns, strict=True))
    except (OSError, ValueError, RuntimeError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=recording, fix="run the scene again") from None


def cut_off(recording: Path) -> None:
    """Take away the last message of a recording where a kill has cut it in two, and what waited: its chunks become part of the
    recording. OSError where that fails."""
    from fsi.record.timeline import tail_of

    os.truncate(recording, whole_bytes(recording))
    if (tail := tail_of(recording)).is_file():
        data = tail.read_bytes()
        with recording.open("ab") as file:
            file.write(b"".join(packed(kind, body) for kind, body in messages(data) if kind == DATA))
        tail.unlink()


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
