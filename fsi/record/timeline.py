"""The timeline, `run.rrd`: fluid, bodies, loads and plots for the rerun viewer, with a ready-made layout.

Timelines: `sim_time`, `step`, `wall_time`. Two-dimensional scenes are drawn at y = 0, seen along +y.
"""

from __future__ import annotations

import errno
import os
import shutil
import time as clock
from pathlib import Path
from uuid import uuid4

import numpy as np

from fsi.extras import require, without_pandas
from fsi.protocols import BodySet, Event, Frame
from fsi.record.fields import levels, particle_values, raster, spatial
from fsi.record.files import same_place
from fsi.record.series import SERIES, column_names, describe, labels
from fsi.record.timeline_layout import ENERGIES, blueprint, class_of, classes, log_legend
from fsi.record.timeline_marks import log_fixed_loads, log_instruments
from fsi.scene.geometry import fluid_depth
from fsi.scene.model import Scene

rr = require("rerun", "viewer", "output.timeline = true")
without_pandas()

BUFFERED_FRAMES = 500  # series frames that are written together; each batch has an overhead of about 1 kB a series
WAIT = 1.0  # wall time [s] of a run without news, after which they are written
BUFFERED_SECONDS = {False: 20.0, True: 0.5}  # of wall time after which they are written at the latest; in a live view
PROBE_BYTES = 2**18  # of what is written before the first frame
LEAST_FREE = 2**20  # bytes on the disk, under which it counts as full
ARROW = 0.3  # length of a force arrow, in depths of the fluid, for the weight of the heaviest body
ARC = 13  # points of the arc that is a torque in two dimensions
SLICE = 3.0  # width in spacings of a body that is drawn in two dimensions
FORCE, TORQUE = 0xD02020FF, 0x8030C0FF
LINES = (0x1F77B4FF, 0xE07B28FF, 0x2E9E4FFF, 0x9A5FC0FF, 0xD0455FFF, 0x7F7F7FFF)  # of the plots, one after the other


def _probe(path: Path) -> None:
    """OSError where a file has no room to grow, by the disk, a quota or a limit: rerun would wait for its writer for ever."""
    with path.open("ab") as file:
        before = file.tell()
        try:
            file.write(bytes(PROBE_BYTES))
            file.flush()
        finally:
            file.truncate(before)


class TimelineRecorder:
    """Writes `run.rrd`, and sends the same to the viewer at the address `live` if there is one. Colours have one range
    for the whole run, which the legend states. With `keep`, bytes and name of a recording (`position`), it goes on there."""

    def __init__(self, path: Path, live: str | None = None, keep: tuple[int, str] | None = None):
        self._path, self._live = path, live
        self._keep, self._name = keep or (None, uuid4().hex)
        self._sink, self._copied = path, 0  # what rerun writes to, and how much of it is at the end of `path`

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        self._scene, self._names = scene, labels(scene, bodies)
        self._rotary = tuple(bodies.joint_is_rotary) if bodies else ()
        self._buffer: list[Frame] = []
        self._written = clock.monotonic()
        self._named: set[str] = set()
        self._weight = float(max(bodies.mass) * max(scene.gravity, 1)) if bodies and len(bodies.names) else 0.0
        self._depth = float(fluid_depth(scene))
        if self._keep is None:
            self._path.touch()  # rerun itself only prints that it cannot write
        else:  # rerun cannot append: it writes beside, and what it has written is added to the file
            self._sink = self._path.with_suffix(".rrd.part")
            os.truncate(self._path, self._keep)
        _probe(self._path)
        self._place = self._path.stat()
        self._stream = rr.RecordingStream("spindrift", recording_id=self._name, send_properties=False)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        scale = self._weight / (ARROW * self._depth)
        note = f"; red arrow: force of the fluid, 1 m = {scale:.4g} N" if self._weight else ""
        layout = blueprint(scene, self._names, self._unit, note, self._live is not None)
        sinks = [rr.FileSink(self._sink), *([rr.GrpcSink(self._live)] if self._live else [])]
        self._stream.set_sinks(*sinks, default_blueprint=layout)
        if self._keep is None:
            self._log_fixed(bodies)
        self._flush()

    def series(self, frame: Frame) -> None:
        self._buffer.append(frame)
        waited = clock.monotonic() - self._written > BUFFERED_SECONDS[self._live is not None]
        if waited or len(self._buffer) >= BUFFERED_FRAMES:
            self._write_series()

    def particles(self, frame: Frame) -> None:
        """Draw the particles; their positions are rounded to the raster and their fields to 256 steps."""
        if shutil.disk_usage(self._path.parent).free < LEAST_FREE:  # rerun itself would only print that
            raise OSError(errno.ENOSPC, "no space left", str(self._path))
        self._set_time(frame.time, frame.step, frame.wall_time)
        step = raster(self._scene)
        positions = spatial(np.rint(frame.position / step) * step)
        shown = {name: class_of(name, levels(frame, name, self._scene)) for name in self._scene.output.fields}
        first = shown.pop(self._scene.output.fields[0])
        points = rr.Points3D(positions, class_ids=first, radii=[self._radius(frame)])
        self._stream.log("world/fluid", points, *([rr.AnyValues(**shown)] if shown else []))
        if self._scene.output.values:
            self._stream.log("values", rr.AnyValues(**particle_values(frame, self._scene)))
        self._flush()

    def event(self, event: Event) -> None:
        self._set_time(*event.moment)
        self._stream.log("events", rr.TextLog(event.text, level=event.level.upper()))
        self._flush()

    def position(self) -> dict[str, tuple[int, str]]:
        """Bytes of the file so far, all of which are on the disk when this returns, and the recording's name."""
        self._write_series()
        with self._path.open("rb") as file:
            os.fsync(file.fileno())
        return {"timeline": (self._path.stat().st_size, self._name)}

    def tick(self) -> None:
        """Called about twice a second. OSError where the file was taken away."""
        same_place(self._path, self._place)

    def idle(self) -> None:
        """Called where nothing is to be done: what has waited for long goes into the file."""
        if clock.monotonic() - self._written > WAIT:
            self._write_series()

    def end(self) -> None:
        same_place(self._path, self._place)
        self._write_series()
        self._stream.disconnect()
        if self._sink != self._path:
            self._sink.unlink(missing_ok=True)

    def _flush(self) -> None:
        self._stream.flush()
        if self._sink == self._path:
            return
        with self._sink.open("rb") as part, self._path.open("ab") as whole:
            part.seek(self._copied)
            shutil.copyfileobj(part, whole)
            self._copied = part.tell()

    def _radius(self, frame: Frame) -> float:
        """Of the drawn particles [m]: a few large ones fill the place of many, up to twice their size."""
        return 0.5 * self._scene.spacing * min(2.0, frame.drawn ** (-1 / self._scene.dimension))

    def _unit(self, name: str) -> str:
        return describe(name, (0,) * len(SERIES[name].dims), self._rotary).units

    def _set_time(self, time: float, step: int, wall_time: float) -> None:
        self._stream.set_time("sim_time", duration=time)
        self._stream.set_time("step", sequence=step)
        self._stream.set_time("wall_time", duration=wall_time)

    def _log_fixed(self, bodies: BodySet | None) -> None:
        """What does not change: tank, gauges, probes, the ground and the meshes in the frames of their bodies."""
        scene, log = self._scene, self._stream.log
        low, high = spatial(np.array([scene.tank.min, scene.tank.max]))
        log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        log("world/fluid", rr.AnnotationContext(classes(scene)), static=True)
        tank = rr.Boxes3D(mins=[low], sizes=[high - low], colors=[0x808080FF], fill_mode="MajorWireframe")
        log("world/tank", tank, static=True)
        log_instruments(log, scene, bodies)
        if scene.dimension == 3 and scene.tank.bathymetry and scene.tank.bathymetry.suffix.lower() in (".stl", ".obj"):
            log("world/ground", rr.Asset3D(path=scene.tank.bathymetry), static=True)
        rotations = {} if bodies is None or scene.dimension == 3 else _rotations(bodies)
        for visual in bodies.visuals() if bodies else ():
            vertices = visual.vertices
            if scene.dimension == 2:  # a slice of it, or it would stand before the fluid
                vertices = _slice(vertices, rotations.get(visual.body, np.eye(3)), SLICE * scene.spacing)
            mesh = rr.Mesh3D(
                vertex_positions=np.asarray(vertices, np.float32),
                triangle_indices=visual.triangles,
                albedo_factor=visual.colour,
            )
            place = ["world", "bodies", visual.body] if visual.body else ["world", "fixed"]
            log(rr.new_entity_path([*place, visual.name]), mesh, static=True)
        for field in scene.output.fields:
            log_legend(self._stream, scene, field)

    def _write_series(self) -> None:
        """Send the buffered frames, one call for each entity."""
        frames, self._buffer = self._buffer, []
        self._written = clock.monotonic()
        if not frames:
            self._flush()
            return
        times = [
            rr.TimeColumn("sim_time", duration=[f.time for f in frames]),
            rr.TimeColumn("step", sequence=[f.step for f in frames]),
            rr.TimeColumn("wall_time", duration=[f.wall_time for f in frames]),
        ]
        shapes = {name: np.shape(value) for f in frames for name, value in f.series.items()}
        for name, shape in shapes.items():
            if name not in self._named:
                self._named.add(name)
                self._name_lines(name, shape)
            nothing = np.full(shape, np.nan)
            values = np.stack([np.ravel(f.series.get(name, nothing)) for f in frames])
            if values.size:
                self._stream.send_columns(f"series/{name}", times, rr.Scalars.columns(scalars=values))
        for kind, pose in {"body": "body", "dry_body": "dry"}.items():
            if f"{pose}_position" in shapes:
                self._write_poses(self._names[kind], pose, frames, times)
        if "body_force" in shapes:
            self._write_loads(frames, times)
        if "load_force" in shapes:
            log_fixed_loads(self._stream, self._scene, frames, times)
        self._flush()

    def _name_lines(self, name: str, shape: tuple[int, ...]) -> None:
        """Name the lines of a plot, by what they belong to where there are several."""
        series = describe(name, shape, self._rotary)
        lines = [column or name.replace("_", " ") for column in column_names(series, shape, self._names)]
        first = ENERGIES.index(name) if name in ENERGIES else 0  # those share a plot
        colours = np.array([LINES[(first + n) % len(LINES)] for n in range(len(lines))], np.uint32)
        self._stream.log(f"series/{name}", rr.SeriesLines(names=lines, colors=colours), static=True)

    def _write_poses(self, names: list[str], pose: str, frames: list[Frame], times: list) -> None:
        for b, name in enumerate(names):
            position = np.stack([f.series[f"{pose}_position"][b] for f in frames])
            quaternion = np.stack([np.roll(f.series[f"{pose}_quaternion"][b], -1) for f in frames])  # rerun: w last
            poses = rr.Transform3D.columns(translation=position, quaternion=quaternion)
            self._stream.send_columns(rr.new_entity_path(["world", "bodies", name]), times, poses)

    def _write_loads(self, frames: list[Frame], times: list) -> None:
        """Force of the fluid as an arrow from the centre of mass; torque as an arrow too, or in two dimensions as an arc
        about it, half a turn for the weight on a lever of half a depth."""
        per_newton = ARROW * self._depth / self._weight if self._weight else 1.0
        for b, name in enumerate(self._names["body"]):
            load = ["world", "loads", name]
            self._stream.log(rr.new_entity_path([*load, "force"]), rr.Arrows3D.from_fields(colors=[FORCE]), static=True)
            position, force = (np.stack([f.series[s][b] for f in frames]) for s in ("body_position", "body_force"))
            arrows = rr.Arrows3D.columns(vectors=per_newton * force, origins=position)
            self._stream.send_columns(rr.new_entity_path([*load, "force"]), times, arrows)
            if "body_torque" not in frames[-1].series:
                continue
            torque = np.stack([f.series["body_torque"][b] for f in frames])
            path = rr.new_entity_path([*load, "torque"])
            if self._scene.dimension == 3:
                self._stream.log(path, rr.Arrows3D.from_fields(colors=[TORQUE]), static=True)
                arrows = rr.Arrows3D.columns(vectors=per_newton / self._depth * torque, origins=position)
                self._stream.send_columns(path, times, arrows)
            else:
                self._stream.log(path, rr.LineStrips3D.from_fields(colors=[TORQUE]), static=True)
                turn = np.clip(torque[:, 1] / (0.5 * self._depth * (self._weight or 1.0)), -1.8, 1.8) * np.pi
                strips = rr.LineStrips3D.columns(strips=_arcs(position, turn, 0.12 * self._depth))
                self._stream.send_columns(path, times, strips)


def _rotations(bodies: BodySet) -> dict[str, np.ndarray]:
    """Rotation (3, 3), body to world, of every moving body at the start."""
    wet = zip(bodies.names, bodies.motion().rotation, strict=True)
    return dict(wet) | dict(zip(bodies.dry_names, bodies.dry_poses()[1], strict=True))


def _slice(vertices: np.ndarray, rotation: np.ndarray, width: float) -> np.ndarray:
    """Vertices (n, 3) of a body squeezed along the world's y to this width [m] about y = 0 of its frame."""
    world = vertices @ rotation.T
    world[:, 1] *= width / max(2 * np.abs(world[:, 1]).max(), width)
    return world @ rotation


def _arcs(centre: np.ndarray, turn: np.ndarray, radius: float) -> np.ndarray:
    """Arcs (n, ARC, 3) about centre (n, 3) in the plane of x and z, from the top through the angle turn (n,) about y."""
    angle = turn[:, None] * np.linspace(0, 1, ARC)
    arcs = np.zeros((len(turn), ARC, 3), np.float32)
    arcs[:, :, 0], arcs[:, :, 2] = radius * np.sin(angle), radius * np.cos(angle)
    return arcs + centre[:, None].astype(np.float32)
