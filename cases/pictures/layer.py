"""The surface of the fluid as a layer of the timeline: a recording of its own that the viewer joins with the run's."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from cases.pictures.frames import Mesh
from fsi.extras import require


class SurfaceLayer:
    """Writes `world/surface` into a recording with the name of the run's, so that `fsi view` shows both as one."""

    def __init__(self, recording: Path, path: Path):
        self._rr = require("rerun", "viewer", "a layer of the timeline")
        self._recording, self._path = recording, path

    def __enter__(self) -> SurfaceLayer:
        rr = self._rr
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that the recording, which streams as the run goes on, has no footer
            store = rr.chunk.RrdReader(self._recording).recordings()[0]
        self._stream = rr.RecordingStream("spindrift", recording_id=store.recording_id, send_properties=False)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._stream.set_sinks(rr.FileSink(self._path))
        return self

    def __exit__(self, *error) -> None:
        self._stream.disconnect()

    def add(self, time: float, mesh: Mesh) -> None:
        """The surface at a time [s]."""
        rr = self._rr
        self._stream.set_time("sim_time", duration=time)
        if mesh.cells.shape[1] == 2:
            strips = mesh.vertices[mesh.cells].astype(np.float32)
            self._stream.log("world/surface", rr.LineStrips3D(strips, colors=[mesh.colour]))
        else:
            shown = rr.Mesh3D(
                vertex_positions=mesh.vertices.astype(np.float32),
                triangle_indices=mesh.cells,
                albedo_factor=mesh.colour,
            )
            self._stream.log("world/surface", shown)
