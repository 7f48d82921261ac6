"""The timeline, `run.rrd`: fluid, bodies, loads and plots for the rerun viewer, with a ready-made layout.

Timelines: `sim_time`, `step`. Two-dimensional scenes are drawn at y = 0, seen along +y. The file depends on the scene and on
what is logged alone, not on when: the series of `BUFFERED_FRAMES` frames are written together, and those that wait
stand in `run.rrd.tail` meanwhile.
"""

from __future__ import annotations

import os
import time as clock
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import numpy as np

from fsi.extras import require
from fsi.protocols import BodySet, Event, Frame
from fsi.record.fields import levels, particle_values, raster, spatial
from fsi.record.files import same_place, write_all
from fsi.record.manifest import versions
from fsi.record.rrd import APPLICATION, Chunk, Encoder, chunk_of
from fsi.record.series import SERIES, column_names, describe, labels
from fsi.record.timeline_layout import ENERGIES, blueprint, class_of, classes, log_legend
from fsi.record.timeline_marks import LOAD, log_fixed_loads, log_instruments
from fsi.scene.file import resolved_toml
from fsi.scene.geometry import fluid_depth
from fsi.scene.model import Scene

rr = require("rerun", "viewer", "output.timeline = true")

BUFFERED_FRAMES = 500  # series frames that are written together; each batch has an overhead of about 1 kB a series
WAIT = {False: 1.0, True: 0.5}  # wall time [s] after which those that wait go into the tail; in a live view
VIEWER_PATIENCE = 5.0  # [s] that a viewer may take to receive something
FIRST_OF_TAIL = 2**40  # number of the first chunk in it
ARROW = 0.3  # length of a force arrow, in depths of the fluid, for the weight of the heaviest body
ARC = 13  # points of the arc that is a torque in two dimensions
SLICE = 3.0  # width in spacings of a body that is drawn in two dimensions
FORCE, TORQUE = 0xD02020FF, 0x8030C0FF
LINES = (0x1F77B4FF, 0xE07B28FF, 0x2E9E4FFF, 0x9A5FC0FF, 0xD0455FFF, 0x7F7F7FFF)  # of the plots, one after the other


def tail_of(path: Path) -> Path:
    """The file of what waits to be written to a recording, with a recording of its own."""
    return path.with_name(f"{path.name}.tail")


class Recording:
    """Collects what is logged as chunks, by the calls that a rerun stream has."""

    def __init__(self) -> None:
        self._chunks: list[Chunk] = []

    def log(self, path: str, *what, static: bool = False, times: list | None = None) -> None:
        """Something that is for ever (`static`), or is at a time."""
        self._chunks.append(chunk_of(path, what, [] if static else times))

    def send_columns(self, path: str, times: list, columns) -> None:
        self._chunks.append(Chunk.from_columns(path, times, columns))

    def taken(self) -> list[Chunk]:
        chunks, self._chunks = self._chunks, []
        return chunks


class TimelineRecorder:
    """Writes `run.rrd`, and sends the same to the viewer at the address `live` if there is one. Colours have one range
    for the whole run, which the legend states. With `keep` (a `position`) it goes on there."""

    def __init__(self, path: Path, live: str | None = None, keep: dict | None = None):
        self._path, self._keep = path, keep
        self._address, self._live = live, None

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        self._scene, self._names = scene, labels(scene, bodies)
        self._rotary = tuple(bodies.joint_is_rotary) if bodies else ()
        self._buffer: list[Frame] = []
        self._shown, self._waiting = 0, clock.monotonic()  # frames of the buffer that are in the tail, and since when
        self._named: list[str] = []
        self._weight = float(max(bodies.mass) * max(scene.gravity, 1)) if bodies and len(bodies.names) else 0.0
        self._depth = float(fluid_depth(scene))
        name = str(uuid5(NAMESPACE_URL, f"{resolved_toml(scene)} {versions()}"))
        self._recording, self._encoder = Recording(), Encoder(name, self._keep["chunks"] if self._keep else 1)
        scale = self._weight / (ARROW * self._depth)
        note = f"; red arrow: force of the fluid, 1 m = {scale:.4g} N" if self._weight else ""
        layout = blueprint(scene, self._names, self._unit, note, self._address is not None)
        if self._address:
            self._live = rr.RecordingStream(APPLICATION, recording_id=name, send_properties=False)
            self._live.set_sinks(rr.GrpcSink(self._address), default_blueprint=layout)
        self._name, self._tail = name, None
        tail_of(self._path).unlink(missing_ok=True)
        if self._keep is None:
            self._file = self._path.open("wb", buffering=0)
            head = self._encoder.head() + self._encoder.layout(layout, self._path.with_name("run.layout"))
            write_all(self._file, head)
            self._log_fixed(bodies)
        else:
            self._go_on()
        self._place = os.fstat(self._file.fileno())
        self._write()

    def series(self, frame: Frame) -> None:
        for name, value in frame.series.items():
            if name not in self._named:
                self._named.append(name)
                self._name_lines(name, np.shape(value))
        if not self._buffer:
            self._waiting = clock.monotonic()
        self._buffer.append(frame)
        if len(self._buffer) >= BUFFERED_FRAMES:
            self._write_buffer()

    def particles(self, frame: Frame) -> None:
        """Draw the particles; their positions are rounded to the raster and their fields to 256 steps."""
        step = raster(self._scene)
        positions = spatial(np.rint(frame.position / step) * step)
        shown = {name: class_of(name, levels(frame, name, self._scene)) for name in self._scene.output.fields}
        first = shown.pop(self._scene.output.fields[0])
        points = rr.Points3D(positions, class_ids=first, radii=[self._radius(frame)])
        others, times = ([rr.AnyValues(**shown)] if shown else []), _times([frame])
        self._recording.log("world/fluid", points, *others, times=times)
        if self._scene.output.values:
            self._recording.log("values", rr.AnyValues(**particle_values(frame, self._scene)), times=times)
        self._write()

    def event(self, event: Event) -> None:
        text = rr.TextLog(event.text, level=event.level.upper())
        self._recording.log("events", text, times=_times([event.moment]))
        self._write()

    def position(self) -> dict[str, dict]:
        """Where the recording stands: its bytes, all of which are on the disk when this returns, and what waits."""
        self._write()
        os.fsync(self._file.fileno())
        names = {name for frame in self._buffer for name in frame.series}
        moments = {key: np.array([getattr(f, key) for f in self._buffer]) for key in ("time", "step")}
        waiting = {name: _stacked(self._buffer, name) for name in sorted(names)}
        facts = {"bytes": self._file.tell(), "chunks": self._encoder.number, "named": list(self._named)}
        return {"timeline": facts | moments | {"series": waiting}}

    def _go_on(self) -> None:
        """From `keep`: what was written after it goes, what waited then waits again."""
        size = self._path.stat().st_size if self._path.exists() else 0
        if size < self._keep["bytes"]:
            fault = f"{self._path} is damaged: {size} bytes, where the checkpoint has {self._keep['bytes']}"
            raise OSError(f"{fault}; run the scene again in another folder")
        self._file = self._path.open("r+b", buffering=0)
        self._file.truncate(self._keep["bytes"])
        self._file.seek(0, os.SEEK_END)
        self._named = list(self._keep["named"])
        for n, (time, step) in enumerate(zip(self._keep["time"], self._keep["step"], strict=True)):
            series = {name: values[n] for name, values in self._keep["series"].items()}
            self._buffer.append(Frame(float(time), int(step), np.nan, series))
        self._waiting = -np.inf

    def tick(self) -> None:
        """Called several times a second: what has waited for long goes into the tail. OSError where the file was taken away."""
        same_place(self._path, self._place)
        if len(self._buffer) > self._shown and clock.monotonic() - self._waiting > WAIT[self._live is not None]:
            self._show()

    idle = tick

    def end(self) -> None:
        try:
            same_place(self._path, self._place)
            self._write_buffer()
            same_place(self._path, self._place)
        finally:
            self._drop_tail()
            self._file.close()
            if self._live:
                self._live.disconnect()

    def _write(self) -> None:
        """Bring what was logged into the file. OSError where that fails, and the file is then as it was."""
        if chunks := self._recording.taken():
            write_all(self._file, self._encoder.data(chunks))
            self._send(chunks)

    def _send(self, chunks: list[Chunk]) -> None:
        if self._live:
            try:
                self._live.send_chunks(chunks)
                self._live.flush(timeout_sec=VIEWER_PATIENCE)
            except (RuntimeError, ValueError):  # nobody watches any more
                self._live = None

    def _show(self) -> None:
        """Bring what waits into the tail, and before the eyes of who watches."""
        self._write()
        self._log_series(self._buffer[self._shown :])
        chunks = self._recording.taken()
        self._send(chunks)
        if self._tail is None:
            self._tail, self._tail_encoder = (
                tail_of(self._path).open("wb", buffering=0),
                Encoder(self._name, FIRST_OF_TAIL),
            )
            write_all(self._tail, self._tail_encoder.head())
        write_all(self._tail, self._tail_encoder.data(chunks))
        self._shown, self._waiting = len(self._buffer), clock.monotonic()

    def _drop_tail(self) -> None:
        if self._tail:
            self._tail.close()
            tail_of(self._path).unlink(missing_ok=True)
            self._tail = None

    def _write_buffer(self) -> None:
        if self._live and len(self._buffer) > self._shown:
            self._show()
        self._write()
        if self._buffer:
            self._log_series(self._buffer)
            write_all(self._file, self._encoder.data(self._recording.taken()))
        self._buffer, self._shown = [], 0
        self._drop_tail()

    def _radius(self, frame: Frame) -> float:
        """Of the drawn particles [m]: a few large ones fill the place of many, up to twice their size."""
        return 0.5 * self._scene.spacing * min(2.0, frame.drawn ** (-1 / self._scene.dimension))

    def _unit(self, name: str) -> str:
        return describe(name, (0,) * len(SERIES[name].dims), self._rotary).units

    def _log_fixed(self, bodies: BodySet | None) -> None:
        """What does not change: tank, gauges, probes, the ground and the meshes in the frames of their bodies."""
        scene, log = self._scene, self._recording.log
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
            log_legend(self._recording, scene, field)

    def _log_series(self, frames: list[Frame]) -> None:
        """The series of some frames, one chunk for each entity."""
        times = _times(frames)
        there = [name for name in self._named if any(name in frame.series for frame in frames)]
        for name in there:
            values = _stacked(frames, name).reshape(len(frames), -1)
            if values.size:
                self._recording.send_columns(f"series/{name}", times, rr.Scalars.columns(scalars=values))
        for kind, pose in {"body": "body", "dry_body": "dry"}.items():
            if f"{pose}_position" in there:
                self._write_poses(self._names[kind], pose, frames, times)
        if "body_force" in there:
            self._write_loads(frames, times)
        if "load_force" in there:
            log_fixed_loads(self._recording, self._scene, frames, times)

    def _name_lines(self, name: str, shape: tuple[int, ...]) -> None:
        """Name the lines of a plot, by what they belong to where there are several, and give the arrows that a load is drawn as
        their colour."""
        series = describe(name, shape, self._rotary)
        lines = [column or name.replace("_", " ") for column in column_names(series, shape, self._names)]
        first = ENERGIES.index(name) if name in ENERGIES else 0  # those share a plot
        colours = np.array([LINES[(first + n) % len(LINES)] for n in range(len(lines))], np.uint32)
        log = self._recording.log
        log(f"series/{name}", rr.SeriesLines(names=lines, colors=colours), static=True)
        for body in self._names["body"] if name in ("body_force", "body_torque") else ():
            if name == "body_force":
                log(_load(body, "force"), rr.Arrows3D.from_fields(colors=[FORCE]), static=True)
            else:
                kind = rr.Arrows3D if self._scene.dimension == 3 else rr.LineStrips3D
                log(_load(body, "torque"), kind.from_fields(colors=[TORQUE]), static=True)
        for structure in self._scene.loads if name == "load_force" else ():
            path = rr.new_entity_path(["world", "loads", structure])
            log(path, rr.Arrows3D.from_fields(colors=[LOAD]), static=True)

    def _write_poses(self, names: list[str], pose: str, frames: list[Frame], times: list) -> None:
        for b, name in enumerate(names):
            position = np.stack([f.series[f"{pose}_position"][b] for f in frames])
            quaternion = np.stack([np.roll(f.series[f"{pose}_quaternion"][b], -1) for f in frames])  # rerun: w last
            poses = rr.Transform3D.columns(translation=position, quaternion=quaternion)
            self._recording.send_columns(rr.new_entity_path(["world", "bodies", name]), times, poses)

    def _write_loads(self, frames: list[Frame], times: list) -> None:
        """Force of the fluid as an arrow from the centre of mass; torque as an arrow too, or in two dimensions as an arc
        about it, half a turn for the weight on a lever of half a depth."""
        per_newton = ARROW * self._depth / self._weight if self._weight else 1.0
        for b, name in enumerate(self._names["body"]):
            position, force = (np.stack([f.series[s][b] for f in frames]) for s in ("body_position", "body_force"))
            arrows = rr.Arrows3D.columns(vectors=per_newton * force, origins=position)
            self._recording.send_columns(_load(name, "force"), times, arrows)
            if "body_torque" not in frames[-1].series:
                continue
            torque = np.stack([f.series["body_torque"][b] for f in frames])
            path = _load(name, "torque")
            if self._scene.dimension == 3:
                arrows = rr.Arrows3D.columns(vectors=per_newton / self._depth * torque, origins=position)
                self._recording.send_columns(path, times, arrows)
            else:
                turn = np.clip(torque[:, 1] / (0.5 * self._depth * (self._weight or 1.0)), -1.8, 1.8) * np.pi
                strips = rr.LineStrips3D.columns(strips=_arcs(position, turn, 0.12 * self._depth))
                self._recording.send_columns(path, times, strips)


def _times(moments: list) -> list:
    """Time columns of frames or moments."""
    return [
        rr.TimeColumn("sim_time", duration=[m.time for m in moments]),
        rr.TimeColumn("step", sequence=[m.step for m in moments]),
    ]


def _stacked(frames: list[Frame], name: str) -> np.ndarray:
    """A series (frames, ...), nan where a frame has none."""
    shape = next(np.shape(f.series[name]) for f in frames if name in f.series)
    nothing = np.full(shape, np.nan)
    return np.stack([f.series.get(name, nothing) for f in frames])


def _load(body: str, kind: str) -> str:
    return rr.new_entity_path(["world", "loads", body, kind])


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
