"""The frames of a run: particles with their values, and the meshes of what else is there, at one time after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from cases.report.snapshot import pose_at, visuals_of
from cases.report.terrain import bed
from fsi.errors import SceneError
from fsi.record.dataset import load_run
from fsi.record.fields import fraction, top
from fsi.record.manifest import read_manifest
from fsi.record.timeline_reader import read_snapshots, read_values
from fsi.scene.fields import field_of
from fsi.scene.file import load_scene

PORTION = 20  # snapshots that are read at a time
ENOUGH = 0.98  # share of the particles, below which there would be holes in the surface
GROUND = (170, 150, 120)  # colour


@dataclass(frozen=True)
class Frame:
    """Particles at a time [s]: position (n, 3) [m], y = 0 in two dimensions, and values by name, (n,) or (n, 3)."""

    time: float
    position: np.ndarray
    values: dict[str, np.ndarray]


@dataclass(frozen=True)
class Mesh:
    """A surface: vertices (n, 3) [m], cells (m, 3) triangles or (m, 2) lines, and an RGB colour."""

    vertices: np.ndarray
    cells: np.ndarray
    colour: tuple[int, int, int] = (150, 160, 170)


class RunFrames:
    """What a run folder shows. Raises SceneError where it holds no run or no particles."""

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        self._manifest = read_manifest(self.folder)
        self.scene = load_scene(self.folder / "scene.toml")
        self.recording = self.folder / "run.rrd"

    @cached_property
    def data(self):
        """The series, `fsi.load_run`."""
        return load_run(self.folder)

    @property
    def exact(self) -> bool:
        """Whether the timeline keeps values as they are (`output.values`)."""
        return self.scene.output.values

    @cached_property
    def share(self) -> float:
        """Share of the fluid particles that the timeline holds (`output.fraction`, `output.particles_limit`)."""
        return fraction(self.scene, self._manifest["particles"]["fluid"])

    def check_whole(self) -> None:
        """Raise SceneError where too many particles are missing for a surface."""
        if self.share < ENOUGH:
            fault = (
                f"the timeline holds {100 * self.share:.0f} % of the particles, too few for the surface of the fluid"
            )
            fix = "run it with output.fraction = 1, or with snapshots further apart (output.particles)"
            raise SceneError(fault, key="output.particles_limit", fix=fix)

    def __iter__(self) -> Iterator[Frame]:
        """All frames with particles, in the order of time. Without `output.values` their values are those of the colours of the
        first field, in 256 steps."""
        found = False
        for frame in self._exact() if self.exact else self._drawn():
            found = True
            yield frame
        if not found:
            raise SceneError("the timeline has no particles", fix="run the scene with output.particles above 0")

    def _exact(self) -> Iterator[Frame]:
        for time, arrays in read_values(self.recording):
            yield Frame(time, arrays.pop("position"), arrays)

    def _drawn(self) -> Iterator[Frame]:
        scene, last = self.scene, -1.0
        name, every = scene.output.fields[0], scene.output.particles
        if not every:
            return
        end = float(self.data.time[-1]) if self.data.sizes["time"] else 0.0
        times = np.arange(0.0, end + every, every)
        scale = 1.0 if field_of(name).names else top(scene, name) / 255
        for first in range(0, len(times), PORTION):
            for shot in read_snapshots(self.recording, times[first : first + PORTION].tolist()):
                if shot.time > last:
                    last = shot.time
                    level = shot.level.astype(np.float32) - (256 if field_of(name).names else 0)
                    yield Frame(shot.time, shot.position, {name: level * np.float32(scale)})

    def bodies(self, time: float) -> list[tuple[str, Mesh]]:
        """Name and mesh of every geom where it is at a time; in two dimensions as it is, across y = 0."""
        shown = []
        for visual in self._visuals:
            pose = pose_at(visual.body, time, self.data)
            if pose is not None:
                position, rotation = pose
                vertices = visual.vertices @ rotation.T + position
                shown.append((visual.name, Mesh(vertices, visual.triangles, visual.colour[:3])))
        return shown

    @cached_property
    def _visuals(self) -> list:
        return visuals_of(self.scene)

    def walls(self) -> list[tuple[str, Mesh]]:
        """The walls of the tank, and the bathymetry as its file has it (three dimensions)."""
        scene = self.scene
        return [*_sides(scene), *_ground(scene)]


def _sides(scene) -> Iterator[tuple[str, Mesh]]:
    tank, dim = scene.tank, scene.dimension
    low, high = np.array(tank.min), np.array(tank.max)
    for side in tank.walls:
        if side[0] not in tank.axes or side[0] in tank.periodic:
            continue
        d = tank.axes.index(side[0])
        at = low[d] if side[1] == "-" else high[d]
        others = [e for e in range(dim) if e != d]
        corners = np.tile(low, (2 ** (dim - 1), 1))
        corners[:, d] = at
        for n, corner in enumerate(([0], [1]) if dim == 2 else ([0, 0], [1, 0], [1, 1], [0, 1])):
            for e, far in zip(others, corner, strict=True):
                corners[n, e] = high[e] if far else low[e]
        cells = np.array([[0, 1]]) if dim == 2 else np.array([[0, 1, 2], [0, 2, 3]])
        full = np.zeros((len(corners), 3))
        full[:, [0, 2] if dim == 2 else [0, 1, 2]] = corners
        yield f"wall {side}", Mesh(full, cells)


def _ground(scene) -> Iterator[tuple[str, Mesh]]:
    file = scene.tank.bathymetry
    if (made := bed(scene)) is not None:
        yield "bathymetry", Mesh(*made, GROUND)
    if file is None or not file.is_file() or file.suffix.lower() not in (".stl", ".obj", ".ply"):
        return
    from fsi.extras import require

    mesh = require("trimesh", "bodies", "a picture of the bathymetry").load(file, force="mesh")
    if scene.dimension == 3:
        yield "bathymetry", Mesh(np.array(mesh.vertices), np.array(mesh.faces), GROUND)
        return
    cut = mesh.section(plane_origin=[0, 0, 0], plane_normal=[0, 1, 0])
    if cut is not None:
        lines = np.array([part.discrete(cut.vertices)[:, :3] for part in cut.entities[:1]]).reshape(-1, 3)
        cells = np.column_stack([np.arange(len(lines) - 1), np.arange(1, len(lines))])
        yield "bathymetry", Mesh(lines, cells, GROUND)
