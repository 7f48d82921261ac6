"""The timeline, `run.rrd`: fluid, bodies, loads and plots for the rerun viewer, with a ready-made layout.

Timelines: `sim_time`, `step`, `wall_time`. Two-dimensional scenes are drawn at y = 0, seen along +y.
"""

from __future__ import annotations

import errno
import shutil
from pathlib import Path

import numpy as np

from fsi.colours import colour_map, packed
from fsi.extras import require
from fsi.protocols import BodySet, Event, Frame
from fsi.scene import Scene
from fsi.scene_check import fluid_depth
from fsi.series import SERIES, column_names, describe, labels

rr = require("rerun", "viewer", "output.timeline = true")
rrb = require("rerun.blueprint", "viewer", "output.timeline = true")

BUFFERED_FRAMES = 50  # series frames that are written together; one by one they cost 0.1 ms each
LEAST_FREE = 2**20  # bytes on the disk, under which it counts as full
ARROW = 0.3  # length of a wrench arrow, in depths of the fluid, for a force that is the weight of the heaviest body

ENERGIES = ("kinetic_energy", "dissipated_energy", "body_work", "wavemaker_work")
PLOTS = (  # tabs under each other: title and series; left out where the scene has no such body, joint, gauge or probe
    {name: (name,) for name in ("joint_position", "joint_velocity", "joint_force", "pto_power", "body_position")},
    {name: (name,) for name in ("elevation", "body_force", "body_torque", "pressure")},
    {"energy": ENERGIES, **{name: (name,) for name in ("potential_energy", "time_step", "max_speed")}},
)


class TimelineRecorder:
    """Writes `run.rrd`. Colours have one range for the whole run, which the view's title states."""

    def __init__(self, path: Path):
        self._path = path

    def begin(self, scene: Scene, bodies: BodySet | None) -> None:
        self._scene, self._names = scene, labels(scene, bodies)
        self._rotary = tuple(bodies.joint_is_rotary) if bodies else ()
        self._colours = packed(colour_map())
        self._low, self._high = colour_range(scene)
        self._buffer: list[Frame] = []
        self._named: set[str] = set()
        weight = max(bodies.mass) * max(scene.gravity, 1) if bodies and len(bodies.names) else 1.0
        self._arrow = ARROW * fluid_depth(scene) / weight
        self._path.touch()  # rerun itself only prints that it cannot write
        self._stream = rr.RecordingStream("spindrift", send_properties=False)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._stream.save(self._path, default_blueprint=self._blueprint())
        self._log_fixed(bodies)
        self._stream.flush()

    def series(self, frame: Frame) -> None:
        self._buffer.append(frame)
        if len(self._buffer) >= BUFFERED_FRAMES:
            self._write_series()

    def particles(self, frame: Frame) -> None:
        if shutil.disk_usage(self._path.parent).free < LEAST_FREE:  # rerun itself would only print that
            raise OSError(errno.ENOSPC, "no space left", str(self._path))
        self._write_series()
        self._set_time(frame.time, frame.step, frame.wall_time)
        speed = self._scene.output.colour == "speed"
        values = np.linalg.norm(frame.velocity, axis=1) if speed else frame.pressure
        level = (values - self._low) / (self._high - self._low)
        colours = self._colours[np.clip(np.nan_to_num(level) * 255, 0, 255).astype(np.intp)]
        points = rr.Points3D(_spatial(frame.position), colors=colours, radii=[self._scene.spacing / 2])
        self._stream.log("world/fluid", points)
        self._stream.flush()

    def event(self, event: Event) -> None:
        self._set_time(*event.moment)
        self._stream.log("events", rr.TextLog(event.text, level=event.level.upper()))
        self._stream.flush()

    def end(self) -> None:
        self._write_series()
        self._stream.flush()
        self._stream.disconnect()

    def _set_time(self, time: float, step: int, wall_time: float) -> None:
        self._stream.set_time("sim_time", duration=time)
        self._stream.set_time("step", sequence=step)
        self._stream.set_time("wall_time", duration=wall_time)

    def _log_fixed(self, bodies: BodySet | None) -> None:
        """What does not change: tank, gauges, probes, the ground and the meshes in the frames of their bodies."""
        scene, log = self._scene, self._stream.log
        low, high = _spatial(np.array([scene.tank.min, scene.tank.max]))
        log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        tank = rr.Boxes3D(mins=[low], sizes=[high - low], colors=[0x808080FF], fill_mode="MajorWireframe")
        log("world/tank", tank, static=True)
        lines = [
            [(g.x, g.y if scene.dimension == 3 else 0, z) for z in (low[2], high[2])] for g in scene.gauges.values()
        ]
        if lines:
            markers = rr.LineStrips3D(lines, labels=list(scene.gauges), colors=[0xE0A030FF])
            log("world/gauges", markers, static=True)
        if scene.probes:
            points = _spatial(np.array([probe.position for probe in scene.probes.values()]))
            markers = rr.Points3D(points, labels=list(scene.probes), colors=[0xE04040FF], radii=[scene.spacing])
            log("world/probes", markers, static=True)
        if scene.dimension == 3 and scene.tank.bathymetry and scene.tank.bathymetry.suffix.lower() in (".stl", ".obj"):
            log("world/ground", rr.Asset3D(path=scene.tank.bathymetry), static=True)
        for visual in bodies.visuals() if bodies else ():
            mesh = rr.Mesh3D(
                vertex_positions=np.asarray(visual.vertices, np.float32),
                triangle_indices=visual.triangles,
                albedo_factor=visual.colour,
            )
            place = ["world", "bodies", visual.body] if visual.body else ["world", "fixed"]
            log(rr.new_entity_path([*place, visual.name]), mesh, static=True)

    def _write_series(self) -> None:
        """Send the buffered frames, one call for each entity."""
        frames, self._buffer = self._buffer, []
        if not frames:
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
        if "body_position" in shapes:
            self._write_bodies(frames, times)
        self._stream.flush()

    def _name_lines(self, name: str, shape: tuple[int, ...]) -> None:
        series = describe(name, shape, self._rotary)
        columns = column_names(series, shape, self._names)
        lines = [" ".join(filter(None, (name, column, f"[{series.units}]"))) for column in columns]
        self._stream.log(f"series/{name}", rr.SeriesLines(names=lines), static=True)

    def _write_bodies(self, frames: list[Frame], times: list) -> None:
        for b, name in enumerate(self._names["body"]):
            position = np.stack([f.series["body_position"][b] for f in frames])
            quaternion = np.stack([np.roll(f.series["body_quaternion"][b], -1) for f in frames])  # rerun has w last
            poses = rr.Transform3D.columns(translation=position, quaternion=quaternion)
            self._stream.send_columns(rr.new_entity_path(["world", "bodies", name]), times, poses)
            force = np.stack([f.series["body_force"][b] for f in frames])
            arrows = rr.Arrows3D.columns(vectors=self._arrow * force, origins=position)
            self._stream.send_columns(rr.new_entity_path(["world", "loads", name]), times, arrows)

    def _blueprint(self):
        """The scene on the left, plots and events on the right."""
        scene = self._scene
        quantity, unit = ("speed", "m/s") if scene.output.colour == "speed" else ("pressure", "Pa")
        title = f"{scene.name}: {quantity} {self._low:g} (dark) to {self._high:.4g} {unit} (light)"
        low, high = _spatial(np.array([scene.tank.min, scene.tank.max]))
        centre, size = (low + high) / 2, np.linalg.norm(high - low)
        direction = np.array([0.0, -1.0, 0.0] if scene.dimension == 2 else [-0.5, -0.8, 0.45])
        eye = rrb.EyeControls3D(position=centre + 0.9 * size * direction, look_target=centre, eye_up=(0, 0, 1))
        tabs = [rrb.Tabs(*views) for row in PLOTS if (views := self._plots(row))]
        right = rrb.Vertical(*tabs, rrb.TextLogView(name="events", origin="events"))
        world = rrb.Spatial3DView(name=title, origin="world", eye_controls=eye, line_grid=False)
        return rrb.Blueprint(
            rrb.Horizontal(world, right, column_shares=[3, 2]),
            rrb.TimePanel(timeline="sim_time", state="collapsed"),
            collapse_panels=True,
        )

    def _plots(self, row: dict[str, tuple[str, ...]]) -> list:
        return [
            rrb.TimeSeriesView(name=title, origin="series", contents=[f"+ /series/{name}" for name in members])
            for title, members in row.items()
            if all(self._names[dim] for name in members for dim in SERIES[name].dims)
        ]


def colour_range(scene: Scene) -> tuple[float, float]:
    """Lowest and highest value of the colours: the hydrostatic pressure at the bottom [Pa], or half the speed of a
    long wave, sqrt(g depth) [m/s]."""
    depth, g = fluid_depth(scene), scene.gravity or 1.0
    return 0.0, 0.5 * (g * depth) ** 0.5 if scene.output.colour == "speed" else scene.fluid.density * g * depth


def _spatial(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) or (n, 3) as (n, 3) float32, with y = 0 where there is none."""
    if points.shape[1] == 3:
        return points.astype(np.float32)
    spatial = np.zeros((len(points), 3), np.float32)
    spatial[:, ::2] = points
    return spatial
