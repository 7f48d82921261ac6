"""Joints that follow a given motion, whatever the fluid does: forced oscillation, flume wave boards, drop tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag

from fsi.errors import SceneError
from fsi.parts import FilePath, NonNegative, Number, Part, Positive
from fsi.protocols import BodySet, FluidLoads
from fsi.scene.coupler import CouplerSettings
from fsi.state import Remembers
from fsi.waves.kinds.regular import RegularPiston
from fsi.waves.kinds.table import TablePiston, table_fault


class Oscillation(Part):
    """Prescribed motion of one joint: amplitude sin(omega t) under a cosine ramp (m or rad)."""

    amplitude: Number
    omega: Positive  # [rad/s]
    ramp: NonNegative = 0.0  # [s]


class MotionTable(Part):
    """Prescribed motion of one joint from a table: columns time [s] and position [m or rad]."""

    file: FilePath


def _motion_kind(motion) -> str:
    return "table" if isinstance(motion, MotionTable) or (isinstance(motion, dict) and "file" in motion) else "formula"


Motion = Annotated[
    Annotated[Oscillation, Tag("formula")] | Annotated[MotionTable, Tag("table")], Discriminator(_motion_kind)
]


class PrescribedSettings(CouplerSettings):
    """Joints that follow a given motion."""

    scheme: Literal["prescribed"] = "prescribed"
    motion: dict[str, Motion] = Field(default_factory=dict)  # joint name -> motion

    def make(self, bodies: BodySet, source: object = "scene.toml") -> Prescribed:
        return Prescribed(self.motion, bodies, source)

    def faults(self, scene) -> Iterator[tuple[str, str, str]]:
        """No motion or nothing to move, power take-offs that have no effect, tables that cannot be followed."""
        if not self.motion:
            fix = "add [coupler.motion.JOINT] with amplitude, omega"
            yield "coupler.motion", "scheme 'prescribed' needs a motion", fix
        if driven := next((name for name, body in scene.bodies.items() if body.pto), None):
            fix = "remove it, or use scheme = 'added_mass'"
            yield f"bodies.{driven}.pto", "has no effect on prescribed motion", fix
        if self.motion and not scene.bodies:
            yield "coupler.motion", "there are no bodies to move", "add [bodies.NAME] with mjcf"
        for joint, motion in self.motion.items():
            if isinstance(motion, MotionTable) and (fault := table_fault(motion.file)):
                yield f"coupler.motion.{joint}.file", *fault


class Prescribed(Remembers):
    """Places the bodies exactly on their motion, which is the position of each named joint [rad or m].

    The fluid feels the mean joint acceleration over the step, (v(t + dt) - v(t)) / dt, that takes the bodies from one
    exact velocity to the next. Joints that are not named stay where they are.
    """

    advice = ""  # bodies that are told where to be cannot become unstable
    notes: tuple[str, ...] = ()

    def __init__(self, motion: Mapping[str, Oscillation | MotionTable], bodies: BodySet, source: object = "scene.toml"):
        known = dict(zip(bodies.joint_names, bodies.joint_dof, strict=True))
        if not motion:
            fix = "add coupler.motion.JOINT with amplitude and omega, or with file"
            raise SceneError("no joint has a motion", key="coupler.motion", file=source, fix=fix)
        for name in motion:
            if name not in known:
                fix = f"known hinge and slide joints: {', '.join(known) or 'none'}"
                raise SceneError(f"no joint {name!r}", key="coupler.motion", file=source, fix=fix)
        self._motion = {name: _follow(settings) for name, settings in motion.items()}
        self._dofs = [known[name] for name in motion]
        self._check_start(bodies, source)
        self._place(bodies, 0.0)

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Move the bodies from `time` to `time` + dt [s]; the wrench (b, 6) of the fluid, see `Coupler`."""
        motion = bodies.motion()
        acceleration = np.zeros(motion.jacobian.shape[2])
        for dof, follow in zip(self._dofs, self._motion.values(), strict=True):
            acceleration[dof] = (follow(time + dt)[1] - follow(time)[1]) / dt
        wrench = fluid.pressure(motion.jacobian @ acceleration + motion.bias)
        self._place(bodies, time + dt)
        return wrench

    def mass_ratio(self, bodies: BodySet) -> None:
        """Not measured: the bodies' own inertia takes no part."""

    def _check_start(self, bodies: BodySet, source: object) -> None:
        """The boundary particles are laid out where the body file has the joint, so the motion has to start there."""
        here = dict(zip(bodies.joint_names, bodies.joints()["joint_position"], strict=True))
        for name, follow in self._motion.items():
            start = follow(0.0)[0]
            if abs(start - here[name]) > 1e-9:
                fault = f"starts at {start:g} where the body file has the joint at {here[name]:g}"
                fix = f"start the motion at {here[name]:g}, or pose the body in its file"
                raise SceneError(fault, key=f"coupler.motion.{name}", file=source, fix=fix)

    def _place(self, bodies: BodySet, time: float) -> None:
        now = {name: follow(time) for name, follow in self._motion.items()}
        position = {name: state[0] for name, state in now.items()}
        bodies.place(position, {name: state[1] for name, state in now.items()})


def _follow(settings: Oscillation | MotionTable):
    """Time to position, velocity and acceleration of a joint."""
    if isinstance(settings, Oscillation):
        return RegularPiston(2 * settings.amplitude, settings.omega, settings.ramp)
    return TablePiston(settings.file)
