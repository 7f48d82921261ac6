"""What the fluid, the bodies, the couplers and the recorders ask of each other.

Axes: arrays of points and vectors have `dim` columns, (x, z) in two dimensions and (x, y, z) in three. Wrenches, twists
and accelerations of bodies are always spatial: six components, force or linear part (x, y, z) first, torque or angular
part after, in the world frame about the body's centre of mass.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np


@dataclass(frozen=True)
class Cloud:
    """Boundary particles of the solids: `position` (n, dim) at t = 0 [m], `owner` (n,) 0 for fixed walls, 1 for the
    wavemaker, 2 + b for the b-th body."""

    position: np.ndarray
    owner: np.ndarray


@dataclass(frozen=True)
class BodyMotion:
    """State of all wet bodies at one instant, world frame, at the centres of mass.

    position (b, 3) [m], rotation (b, 3, 3) body to world, velocity (b, 6) twist [m/s, rad/s],
    jacobian (b, 6, nv) d twist / d qvel, bias (b, 6) acceleration that is left when qacc = 0 [m/s2, rad/s2].

    Where one of the bodies is round: smooth (b, 6, 6) takes the moment about its axis out of a wrench, and its transpose
    the spin out of a twist; its boundary particles are carried without the spin, by the rotation turn (b, 3, 3) about the
    point pivot (b, 3) [m] in the frame of the body. For bodies that are not round these are 1, `rotation` and 0.
    """

    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    jacobian: np.ndarray
    bias: np.ndarray
    smooth: np.ndarray | None = None
    turn: np.ndarray | None = None
    pivot: np.ndarray | None = None


class Stateful(Protocol):
    """Remembers something from one step to the next. `restore(state())` of an object that was made in the same way goes on
    bit for bit as the first one would (`fsi.simulation.checkpoint`)."""

    def state(self) -> dict:
        """All that later steps depend on, as plain data that shares no memory with the object: nested dicts of arrays,
        numbers, strings, None and lists of these."""

    def restore(self, state: dict) -> None:
        """Go on from a state. Raises ValueError or KeyError where it is one of another kind of object."""


class Controller(Protocol):
    """Sets the controls of actuators: `run.data.ctrl` of the run as it stands (`fsi.simulation.view.View`). One that remembers
    something is `Stateful` besides, so that it can be reset and resumed."""

    def __call__(self, run) -> None: ...


class Solid(Protocol):
    """A body of revolution, a box, a mesh: anything that displaces fluid and carries boundary particles."""

    def boundary(self, spacing: float, layers: int) -> np.ndarray:
        """Boundary particles (n, dim) inside the solid, the outermost layer half a spacing below its surface."""

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (n,) of points (n, dim) to the surface, negative inside; exact near the surface only."""


class Gap(Protocol):
    """Fluid between a body and a wall that moves with the body."""

    position: np.ndarray  # (n, dim) of its particles at t = 0 [m]

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (n,) of points (n, dim) to where a free particle fits, negative where none does."""


class BodySet(Stateful, Protocol):
    """The rigid bodies of a scene (`bodies.BodySet` is MuJoCo's)."""

    names: tuple[str, ...]  # wet bodies, in the order of the owners of their boundary particles
    dry_names: tuple[str, ...]  # bodies that move and do not meet the fluid
    joint_names: tuple[str, ...]  # hinge and slide joints, in the order of the joint series
    joint_is_rotary: tuple[bool, ...]  # True where the joint is a hinge (rad, N m), False for a slide (m, N)
    joint_dof: np.ndarray  # (joints,) index of each of these joints in qvel and in joint accelerations (nv,)
    sensor_names: tuple[str, ...]  # one for each number that the sensors of the body files read
    actuator_names: tuple[str, ...]
    mooring_names: tuple[str, ...]  # lines that MuJoCo does not know
    mass: np.ndarray  # (b,) [kg], mass carried by each wet body alone
    insides: Mapping[int, Sequence[Solid]]  # of bodies that start dry inside, by number: what they keep dry
    dimension: int  # in two dimensions the fluid acts on x, z and pitch alone
    notes: tuple[str, ...]  # what was decided for the user so far: substeps, implicit springs, thin plates

    def solids(self) -> list[tuple[int, Solid]]:
        """(owner, solid) for every wet geom in its initial pose: owner 0 is a fixed wall, 2 + b the b-th body."""

    def gaps(self) -> list[tuple[int, Gap]]:
        """(owner, gap) for every body with fluid glued to it."""

    def motion(self) -> BodyMotion: ...

    def inertia(self) -> np.ndarray:
        """Mass matrix (nv, nv) of the joints without the fluid [kg, kg m, kg m2]."""

    def dry_poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Position (d, 3) [m] of the centre of mass and rotation (d, 3, 3), body to world, of the dry bodies."""

    def conditions(self) -> list[str]:
        """What holds now, in words that stay the same while it does: joints at a limit, contacts."""

    def energy(self) -> float:
        """Kinetic plus potential energy of everything MuJoCo moves [J]."""

    def joints(self) -> dict[str, np.ndarray]:
        """`joint_position`, `joint_velocity`, `joint_force`, `pto_power`, each (joints,), as in the run folder."""

    def sensors(self, wrench: np.ndarray) -> dict[str, np.ndarray]:
        """`sensor_reading` (sensors,), the readings under the fluid's wrench (b, 6); empty where there are none."""

    def controls(self) -> dict[str, np.ndarray]:
        """`control` and `actuator_force`, each (actuators,), over the last step; empty where there are none."""

    def moorings(self) -> dict[str, np.ndarray]:
        """`mooring_tension` (moorings,), at the fairleads now; empty where there are none."""

    def expose(self, wrench: np.ndarray) -> None:
        """Bring what a user reads of the engine's data up to date, under the fluid's wrench (b, 6); steps to come do not
        depend on it."""

    def advance(self, dt: float, wrench: np.ndarray, added_inertia: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Step the bodies by dt under the fluid's wrench (b, 6) [N, N m], which holds at joint acceleration
        `acceleration` (nv,) and falls by `added_inertia` (nv, nv) for each unit above it. Returns the mean joint
        acceleration (nv,) over the step."""

    def hydrostatics(self) -> dict:
        """How each wet body floats: name -> `drawn` and, where there is a pose at rest, `rest`, each a dict of figures."""

    def state(self) -> dict:
        """The whole state, see `Stateful`; couplers also go back to it within a step."""

    def restore(self, state: dict) -> None: ...

    def place(self, position: dict[str, float], velocity: dict[str, float]) -> None:
        """Set the named joints (prescribed motion) and leave the rest as it is."""

    def site(self, name: str) -> tuple[int, np.ndarray] | None:
        """Number of the wet body that has the named site, and where it is now (3,) [m]; None where none has it."""

    def visuals(self) -> list[Visual]:
        """Triangle meshes of every geom that is drawn, in the frame of its body."""


@dataclass(frozen=True)
class Visual:
    """A mesh to draw: `body` names its body ("" for what does not move), vertices (n, 3), triangles (m, 3)."""

    name: str
    body: str
    vertices: np.ndarray
    triangles: np.ndarray
    colour: tuple[int, int, int, int] = (200, 200, 200, 255)


class FluidLoads(Protocol):
    """What a coupler asks of the fluid within one step. Accelerations and wrenches: (b, 6), see the module."""

    def pressure(self, acceleration: np.ndarray) -> np.ndarray:
        """Update the pressure for this acceleration of the bodies; the wrench (b, 6) of the fluid on them. Every call
        starts from the pressure of the last step, so that the same acceleration gives the same pressure, bit for bit."""

    def respond(self, acceleration: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same at little more cost with the linear changes by each of the accelerations `units` (m, b, 6): the wrench,
        then the changes of the pressure (m opaque arrays, valid until the next update) and of the wrench (m, b, 6)."""

    def add(self, response: np.ndarray, factor: float) -> None:
        """Add factor times a pressure response to the pressure."""


class Particles(Protocol):
    """The fluid particles as a halo sees them (`fsi.particles.state.ParticleState`)."""

    position: np.ndarray  # (n, dim) [m]
    velocity: np.ndarray  # (n, dim) [m/s]
    pressure: np.ndarray  # (n,) [Pa]
    label: np.ndarray  # (n,) number at t = 0, -1 for a ghost

    @property
    def count(self) -> int: ...

    @property
    def own(self) -> np.ndarray:
        """True (n,) of those that are no ghosts; sums over the fluid are over these."""

    def append(self, position: np.ndarray, velocity: np.ndarray, pressure: np.ndarray, label: np.ndarray) -> None: ...

    def append_ghosts(self, position: np.ndarray, velocity: np.ndarray, pressure: np.ndarray) -> None: ...

    def keep(self, chosen: np.ndarray) -> None: ...


class Halo(Protocol):
    """The ghosts of a fluid: during a step they stand for particles that it does not hold at that place, such as the images of
    its own across a periodic axis. Kernels treat them like all other particles; what a sweep computes for them is
    overwritten by `refresh` with what their sources have.

    A step calls `exchange` before the particles are sorted, `locate` after, `sweep` or `refresh` for every sweep whose results
    the next one reads from neighbours, and `drop` at its end.
    """

    room: float  # memory to provide, over that for the particles at the start

    def expected(self, count: int) -> int:
        """For how many particles to make room before the first step, of so many that the fluid has in all."""

    def exchange(self, particles: Particles) -> int:
        """Drop ghosts that are left, give away and take in particles that have changed sides, and append the ghosts behind all
        others. Returns how many particles are own."""

    def locate(self, order: np.ndarray, sort) -> int:
        """The particles have been sorted (`fsi.particles.cells.CellSort`): row r holds particle order[r], and rows below
        `sort.inside` are in the domain. May change the order within cells. Returns how many ghosts are in the domain."""

    def idle(self) -> np.ndarray:
        """Which of the fluid's rows are ghosts that no sums need to be made for (n,); empty where there are none."""

    def refresh(self, rows: np.ndarray, columns: slice) -> None:
        """Give the rows (n, ...) of the ghosts what their sources have in these columns."""

    def sweep(self, run, near, rows: np.ndarray, columns: slice) -> None:
        """Call run(bounds, groups) over the groups of `near` (`fsi.particles.neighbours.Neighbours`) whose sums somebody needs,
        and `refresh` these columns of `rows`, which it fills for each particle by itself, as soon as that can be."""

    def holds(self, position: np.ndarray) -> np.ndarray | None:
        """Which boundary particles at these places (b, dim) this fluid counts the forces on, so that several fluids that all
        know them count each once; None for all."""

    def nearby(self, placed) -> np.ndarray | None:
        """Numbers of the boundary particles (`fsi.particles.state.BoundaryState`) that act on this fluid; None for all."""

    def drop(self, particles: Particles) -> np.ndarray | slice:
        """Drop the ghosts. Returns what chooses the own particles out of the rows of the step."""


class Coupler(Stateful, Protocol):
    """How wrench and motion are exchanged in a step: one class a scheme."""

    notes: tuple[str, ...]  # what the user should know of the run so far
    advice: str  # what to change where a body becomes unstable; "" where none can

    def step(self, fluid: FluidLoads, bodies: BodySet, time: float, dt: float) -> np.ndarray:
        """Settle the bodies' acceleration and the pressure together and advance the bodies from `time` by dt.
        Returns the settled wrench (b, 6) of the fluid on the bodies over the step."""

    def mass_ratio(self, bodies: BodySet) -> np.ndarray | None:
        """Added over own inertia (b,) of each body, as last measured; None where it was not."""


class Moment(NamedTuple):
    """An instant of a run: simulated time [s], step, wall time since the start [s]."""

    time: float
    step: int
    wall_time: float


@dataclass(frozen=True)
class Event:
    """Something worth a line at its moment: `level` is `info`, `warning` or `error`."""

    moment: Moment
    level: str
    text: str


@dataclass
class Frame:
    """What a recorder sees at one instant; arrays are views, valid until the next step.

    Scalars are named as in the run folder (`fsi.record.series`). Particles: position (n, dim), velocity (n, dim),
    pressure (n,), in no fixed order; `label` (n,) is the number of each at t = 0; `fields` further values (n,) by name;
    `drawn` the share of all particles that the frame holds.
    """

    time: float
    step: int
    wall_time: float
    series: dict[str, np.ndarray | float] = field(default_factory=dict)
    position: np.ndarray | None = None
    velocity: np.ndarray | None = None
    pressure: np.ndarray | None = None
    label: np.ndarray | None = None
    fields: dict[str, np.ndarray] = field(default_factory=dict)
    drawn: float = 1.0


class Recorder(Protocol):
    """Watches a run and never steers it."""

    def begin(self, scene, bodies: BodySet | None) -> None: ...

    def series(self, frame: Frame) -> None: ...

    def particles(self, frame: Frame) -> None: ...

    def event(self, event: Event) -> None: ...

    def end(self) -> None: ...
