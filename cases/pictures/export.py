"""`fsi export DIR --to vtk | surface`: VTKHDF files of a run, in its folder `vtk`, and its surface on the timeline."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cases.pictures.frames import Mesh, RunFrames
from cases.pictures.surface import surface
from cases.pictures.vtkhdf import PolyDataFile
from fsi.errors import SceneError


def export(folder: str | Path, to: str) -> list[Path]:
    """Write what `to` names and return the files. Raises SceneError where the folder holds no run or no particles, or where
    it cannot be written."""
    run = RunFrames(folder)
    target = run.folder / "vtk"
    try:
        target.mkdir(exist_ok=True)
        return _surface(run, target) if to == "surface" else _vtk(run, target)
    except OSError as fault:
        raise SceneError(f"{target} cannot be written: {fault.strerror or fault}") from None


def _vtk(run: RunFrames, target: Path) -> list[Path]:
    """`particles.vtkhdf` with velocity, pressure and fields, `bodies.vtkhdf` where there are geoms, `walls.vtkhdf`."""
    files, times = [target / "particles.vtkhdf"], []
    with PolyDataFile(files[0]) as file:
        for frame in run:
            file.add(frame.time, frame.position, np.arange(len(frame.position))[:, None], frame.values)
            times.append(frame.time)
    if run.bodies(times[0]):
        files.append(target / "bodies.vtkhdf")
        with PolyDataFile(files[-1]) as file:
            for time in times:
                file.add(time, *_joined([mesh for _, mesh in run.bodies(time)]))
    if walls := [mesh for _, mesh in run.walls()]:
        width = max(mesh.cells.shape[1] for mesh in walls)
        files.append(target / "walls.vtkhdf")
        with PolyDataFile(files[-1]) as file:
            file.add(times[0], *_joined([mesh for mesh in walls if mesh.cells.shape[1] == width]))
    return files


def _joined(meshes: list[Mesh]) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Points, cells, and the number of the part that each point is of."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    cells = np.concatenate([mesh.cells + n for mesh, n in zip(meshes, first, strict=False)])
    part = np.repeat(np.arange(len(meshes)), np.diff(first))
    return np.concatenate([mesh.vertices for mesh in meshes]), cells, {"part": part}


def _surface(run: RunFrames, target: Path) -> list[Path]:
    """`surface.vtkhdf`, and the same as a layer on the timeline in `surface.rrd` beside `run.rrd`."""
    from cases.pictures.layer import SurfaceLayer

    run.check_whole()
    files = [target / "surface.vtkhdf", run.folder / "surface.rrd"]
    with PolyDataFile(files[0]) as file, SurfaceLayer(run.recording, files[1]) as layer:
        for frame in run:
            mesh = surface(frame.position, run.scene.spacing, run.scene.dimension)
            file.add(frame.time, mesh.vertices, mesh.cells)
            layer.add(frame.time, mesh)
    return files
