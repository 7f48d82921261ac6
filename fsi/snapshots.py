"""Reads particle snapshots back from the timeline of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require

FLUID, FIRST = "/world/fluid", "Points3D:class_ids"


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
    try:
        for chunk in rr.chunk.RrdReader(recording).stream():
            if str(chunk.entity_path) != FLUID or chunk.is_static:
                continue
            batch = chunk.to_record_batch()
            columns = dict(zip(batch.schema.names, batch.columns, strict=True))
            for row, stamp in enumerate(columns["sim_time"].cast("int64").to_numpy() * 1e-9):
                closer = [t for t in times if t not in nearest or abs(stamp - t) < nearest[t][0]]
                snapshot = _row(columns, row, float(stamp)) if closer else None
                nearest |= {t: (abs(stamp - t), snapshot) for t in closer}
    except (OSError, ValueError, RuntimeError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=recording, fix="run the scene again") from None
    found = {snapshot.time: snapshot for _, snapshot in nearest.values()}
    return [found[time] for time in sorted(found)]


def _row(columns: dict, row: int, time: float) -> Snapshot:
    position = columns["Points3D:positions"][row].values.flatten().to_numpy().reshape(-1, 3)
    radius = float(columns["Points3D:radii"][row].values[0].as_py())
    return Snapshot(time, position, columns[FIRST][row].values.to_numpy(), radius)
