"""A stand-in for the solver: everything that the recorders and the command line see of it, and no fluid."""

from types import SimpleNamespace

import numpy as np

from fsi.errors import RunError
from fsi.protocols import Event, Frame, Moment, Visual


class Flap:
    """A body set of one flap with a hinge, and a float with a slide."""

    names = ("flap", "float")
    dry_names = ("crank",)
    joint_names = ("hinge", "heave")
    joint_is_rotary = (True, False)
    sensor_names = ()
    mass = np.array([120.0, 40.0])
    notes = ("substeps: 2",)

    def motion(self):
        return SimpleNamespace(rotation=np.tile(np.eye(3), (2, 1, 1)))

    def dry_poses(self):
        return np.zeros((1, 3)), np.eye(3)[None]

    def visuals(self):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
        faces = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
        return [
            Visual("plate", "flap", corners, faces),
            Visual("ramp", "", corners, faces),
            Visual("arm", "crank", corners, faces),
        ]


def frame(step: int, bodies: bool = True) -> Frame:
    """A frame whose every value can be told from its step."""
    t = 0.01 * step
    series = {
        "elevation": np.array([t, -t]),
        "pressure": np.array([1000 + t]),
        "kinetic_energy": 2.0 * t,
        "time_step": 0.01,
        "novelty": np.array([[t, 1], [2, 3]]),
    }
    if bodies:
        series |= {"joint_position": np.array([t, 2 * t]), "body_force": np.full((2, 3), t)}
        series["body_position"] = np.array([[t, 0, 1], [0, t, 2]])
        series["body_quaternion"] = np.array([[1, 0, 0, 0], [0.5, 0.5, 0.5, 0.5]])
        series |= {"dry_position": np.array([[0, 0, t]]), "dry_quaternion": np.array([[0, 1, 0, 0]])}
    rng = np.random.default_rng(step)
    return Frame(
        time=t,
        step=step,
        wall_time=10 * t,
        series=series,
        position=rng.random((50, 2)),
        velocity=rng.random((50, 2)),
        pressure=rng.random(50),
        label=rng.permutation(50),
    )


def event(text: str, step: int = 0, level: str = "info") -> Event:
    return Event(Moment(0.01 * step, step, 0.1 * step), level, text)


class Simulation:
    """Steps of 0.01 s; `fails_at` [s] makes it unstable there."""

    fails_at = None

    def __init__(self, scene, *, bodies=None, coupler=None, ground=None, recorders=(), threads=None, ranks=None):
        self.scene, self.bodies, self.recorders, self.ranks = scene, bodies, recorders, ranks
        self.time, self.step_count, self.threads = 0.0, 0, threads or 1
        self.counts = {"fluid": 50, "wall": 10, "body": 0}
        self.memory_bytes, self.phases, self.warnings = 1000, {"pressure": np.float64(0.5)}, ["a warning"]
        self.events = []

    @property
    def now(self):
        return Moment(self.time, self.step_count, 0.1 * self.step_count)

    def state(self):
        return {"time": self.time}

    def audit(self):
        return {"volume_drift": np.float64(1e-4)}

    def tell(self, text, level="info"):
        self.events.append(event(text, self.step_count, level))
        for recorder in self.recorders:
            recorder.event(self.events[-1])

    def report(self, level, text):
        self.tell(text, level)

    def finish(self, level, text):
        self.tell("a warning", "warning")
        self.tell(text, level)

    def run(self, until, on_step=None):
        for recorder in self.recorders:
            recorder.begin(self.scene, self.bodies)
        self.tell("start")
        while self.time < until - 1e-9:
            self.step_count += 1
            self.time = 0.01 * self.step_count
            for recorder in self.recorders:
                recorder.series(frame(self.step_count, self.bodies is not None))
                if self.step_count % 10 == 0:
                    recorder.particles(frame(self.step_count, self.bodies is not None))
            if self.fails_at and self.time >= self.fails_at:
                raise RunError(f"unstable at t = {self.time:g} s")
            if on_step:
                on_step(self)
