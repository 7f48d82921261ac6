"""VTKHDF files (Kitware's HDF5 layout, version 2): polygons and points over time, for ParaView and pyvista."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsi.extras import require

KINDS = ("Vertices", "Lines", "Polygons", "Strips")


class PolyDataFile:
    """Writes one PolyData a step: `add(time, points, cells, values)`. Use it in a `with` block; only a step is in memory."""

    def __init__(self, path: Path):
        self._h5 = require("h5py", "report", "export to VTKHDF")
        self._path = path

    def __enter__(self) -> PolyDataFile:
        self._file = self._h5.File(self._path, "w")
        root = self._root = self._file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", np.bytes_("PolyData"))
        steps = self._steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 0
        self._points, self._data, self._count = 0, {}, 0
        self._cells = dict.fromkeys(KINDS, 0)
        self._ids = dict.fromkeys(KINDS, 0)
        for kind in KINDS:
            root.create_group(kind)
        root.create_group("PointData")
        steps.create_group("PointDataOffsets")
        return self

    def __exit__(self, *error) -> None:
        self._file.close()

    def add(
        self, time: float, points: np.ndarray, cells: np.ndarray, values: dict[str, np.ndarray] | None = None
    ) -> None:
        """A step: points (n, 3); cells (m, k) of point numbers, k = 1 points, 2 lines, 3 triangles; values (n,) or (n, 3)."""
        root, steps = self._root, self._steps
        own = KINDS[cells.shape[1] - 1]
        self._append(steps, "Values", [time], np.float64)
        self._append(steps, "PartOffsets", [self._count], np.int64)
        self._append(steps, "NumberOfParts", [1], np.int64)
        self._append(steps, "PointOffsets", [self._points], np.int64)
        self._append(steps, "CellOffsets", [[self._cells[k] for k in KINDS]], np.int64)
        self._append(steps, "ConnectivityIdOffsets", [[self._ids[k] for k in KINDS]], np.int64)
        self._append(root, "NumberOfPoints", [len(points)], np.int64)
        self._append(root, "Points", points, np.float32)
        for kind in KINDS:
            mine = cells if kind == own else np.empty((0, 1), int)
            self._append(root[kind], "NumberOfCells", [len(mine)], np.int64)
            self._append(root[kind], "NumberOfConnectivityIds", [mine.size], np.int64)
            self._append(root[kind], "Connectivity", mine.ravel(), np.int64)
            self._append(root[kind], "Offsets", np.arange(len(mine) + 1) * mine.shape[1], np.int64)
            self._cells[kind] += len(mine)
            self._ids[kind] += mine.size
        for name, array in (values or {}).items():
            self._append(steps["PointDataOffsets"], name, [self._data.get(name, 0)], np.int64)
            self._append(root["PointData"], name, array, np.float32)
            self._data[name] = self._data.get(name, 0) + len(array)
        self._points += len(points)
        self._count += 1
        steps.attrs["NSteps"] = self._count

    def _append(self, group, name: str, rows, dtype) -> None:
        rows = np.asarray(rows, dtype)
        if name not in group:
            group.create_dataset(
                name, shape=(0, *rows.shape[1:]), maxshape=(None, *rows.shape[1:]), dtype=dtype,
                chunks=(max(1024, 65536 // max(1, int(np.prod(rows.shape[1:])))), *rows.shape[1:]),
                compression="gzip" if rows.size > 1000 else None, compression_opts=1 if rows.size > 1000 else None,
            )  # fmt: skip
        data = group[name]
        data.resize(len(data) + len(rows), axis=0)
        if len(rows):
            data[-len(rows) :] = rows
