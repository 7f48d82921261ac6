"""What the logs of a run will take on the disk."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from fsi.errors import SceneError
from fsi.protocols import BodySet
from fsi.record.fields import fraction, particle_bytes
from fsi.record.series import SERIES, labels
from fsi.scene.model import Scene

# Bytes of a series in a frame, and of each value in it, as measured after compression on the flap and the dam break.
PER_SERIES, PER_VALUE = {"timeline": 34.0, "mcap": 21.0}, 7.2
MOST_FRAMES = 1e15  # that are counted
PER_SNAPSHOT = 2500.0  # bytes of a snapshot besides its particles
LOADS = (2, 33)  # further series, and values, that draw a body on the timeline: its pose, force and torque


def check_disk(log_bytes: float, folder: Path) -> None:
    """Raise SceneError where logs of so many bytes do not fit beside what is on the disk of `folder`."""
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.is_dir())
    free = shutil.disk_usage(there).free
    if log_bytes > free:
        fault = f"the logs take about {log_bytes / 1e9:.3g} GB of {free / 1e9:.3g} GB that are free in {there}"
        fix = "log less often (output.series, output.particles) or less (output.timeline, output.cloud)"
        raise SceneError(fault, key="output", fix=fix)


def log_size(scene: Scene, bodies: BodySet | None, fluid: int, steps: float = math.inf) -> dict:
    """Of a run with so many fluid particles and steps: `series_frames`, `series_bytes` of one, `snapshots`, `snapshot_bytes`
    of one, `snapshot_particles` in it, and `log_bytes` of all; within about a quarter."""
    output, names = scene.output, labels(scene, bodies)
    sizes = [math.prod(len(names[dim]) for dim in series.dims) for series in SERIES.values()]
    count, values, drawn = sum(size > 0 for size in sizes), sum(sizes), len(names["body"])
    row = 0.0
    if output.mcap:
        row += PER_SERIES["mcap"] * count + PER_VALUE * values
    if output.timeline:
        row += PER_SERIES["timeline"] * (count + LOADS[0] * drawn) + PER_VALUE * (values + LOADS[1] * drawn)
    particles = round(fraction(scene, fluid) * fluid)
    snapshot = PER_SNAPSHOT + particle_bytes(scene) * particles if output.timeline else 0.0
    if output.mcap and output.cloud:
        snapshot += 4.0 * (3 + len(output.fields)) * particles
    frames, snapshots = (
        1 + int(min(scene.duration / t, steps, MOST_FRAMES)) if t else 0 for t in (output.series, output.particles)
    )
    return {
        "series_frames": frames,
        "series_bytes": row,
        "snapshots": snapshots,
        "snapshot_particles": particles,
        "snapshot_bytes": snapshot,
        "log_bytes": frames * row + snapshots * snapshot,
    }
