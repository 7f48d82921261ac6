"""What the parts of a fluid ask of each other: the boundary treatment, the pressure solver, and what all of them share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.fluid.response import LinearResponse
from fsi.fluid.workspace import Workspace
from fsi.particles.cells import CellSort
from fsi.particles.neighbours import Neighbours
from fsi.particles.state import BoundaryState, ParticleState
from fsi.protocols import Halo
from fsi.scene.model import Scene
from fsi.sph.columns import Constants


class BoundaryTreatment(Protocol):
    """How walls and bodies act in the sums over particles, and what the fluid does to them. Owns the boundary particles of a
    step in the order of cells, their neighbours in the fluid and their weights; `BoundaryState` holds where they are.

    A step calls `begin`, `arrange`, `pack` and `find`, then `weigh` and `drag` with velocities, and `accelerate` and
    `extrapolate` with every pressure update. `count` of the b boundary particles stand; their rows follow the fluid's
    `first` ones.
    """

    count: int
    first: int
    sort: CellSort
    near: Neighbours  # of the boundary particles, in the fluid
    centre: np.ndarray  # (owners, dim) [m]
    position: np.ndarray  # (b, dim) [m]
    velocity: np.ndarray  # (b, dim) [m/s], those that the wall guard keeps the fluid off by
    skin: np.ndarray  # (b, dim) [m/s], those that viscosity feels
    owner: np.ndarray  # (b,)
    shepard: np.ndarray  # (b, 1 + dim): sum W over the fluid first

    def begin(self, centre: np.ndarray, twist: np.ndarray, smooth: np.ndarray | None) -> None:
        """The owners now: centre (owners, 3), twist (owners, 6), smooth (owners, 6, 6) as in `BodyMotion`."""

    def arrange(self, placed: BoundaryState, scratch: np.ndarray, chosen: np.ndarray) -> None:
        """Find the order of cells of the `chosen` ones (k,), int32."""

    def pack(self, first: int, placed: BoundaryState, dt: float, body_force: np.ndarray, xs, rows) -> None:
        """Fill the rows from `first` on in xs and in each of `rows`."""

    def count_only(self, held: np.ndarray) -> None:
        """Count the forces on these boundary particles alone, True in (count,), until the next `pack`."""

    def find(self, fluid: CellSort, xs: np.ndarray) -> None:
        """Find the neighbours in the fluid."""

    def follow(self, placed: BoundaryState) -> None:
        """Take over velocities that have changed since `pack`, for the wall guard."""

    def weigh(self, flow: np.ndarray, trial: np.ndarray, body_force: np.ndarray) -> None:
        """The weights of the step; no slip: the velocities in `flow` that viscosity needs."""

    def accelerate(self, acceleration: np.ndarray, body_force: np.ndarray) -> None:
        """Take the owners to move with this acceleration (owners, 6)."""

    def extrapolate(self, rows: np.ndarray, response: LinearResponse | None = None) -> None:
        """Pressures of the boundary in `rows` from those of the fluid there; those of responses with them."""

    def lift_of(self, units: np.ndarray) -> np.ndarray:
        """What accelerations (m, owners, 6) alone add to the sums of `extrapolate`, (count, m)."""

    def press(self, rows: np.ndarray, values: np.ndarray, column: int, columns: int, least: int = 1) -> np.ndarray:
        """Wrenches (m, owners, 6) of the pressures in so many columns of `values` from `column` on."""

    def drag(self, flow: np.ndarray, least: int) -> np.ndarray:
        """Wrench (owners, 6) of the viscous forces."""

    def grasp(self, grip: np.ndarray, dt: float, accelerations: np.ndarray) -> np.ndarray:
        """Change (m, owners, 6) of the viscous wrench over a step of dt [s] by accelerations (m, owners, 6)."""

    def smoothed(self, wrench: np.ndarray) -> np.ndarray:
        """The wrenches (..., owners, 6), without the moment that no smooth body of their shape would get."""

    @property
    def nbytes(self) -> int: ...


class PressureSolver(Protocol):
    """Finds the pressure that makes the trial velocities free of divergence. Reads `trial` of the workspace, with the last
    step's pressure, and the coefficients, and leaves the pressure of fluid and boundary in `field`.

    sweeps: over the neighbours so far; most_sweeps: in one step; unsolved: steps that missed the tolerance.
    """

    sweeps: int
    most_sweeps: int
    unsolved: int

    def update(self, k: Constants, dt: float, response: LinearResponse | None = None) -> None:
        """The pressure of a step of dt [s]. Every call starts from the last step's pressure. It is linear in the lift of the
        boundary, and the responses to changes of it are found along with it, exactly."""

    def settle(self, k: Constants, tolerance: float, most: int) -> None:
        """Solve on from the last update, until a sweep changes the pressure by less than tolerance times its maximum, in at
        most so many sweeps; they are not counted."""

    def residual(self, rows: int, counts: np.ndarray | None = None) -> float:
        """How much the last sweep changed the pressure of the fluid's rows, ghosts included, as a share of its largest value;
        the pressures in `field` have been multiplied by `counts` (rows,) since, where it is given."""

    def state(self) -> dict:
        """What is remembered between steps, for `restore`."""

    def restore(self, state: dict) -> None: ...


@dataclass
class Parts:
    """What the parts of one fluid share: `depth` [m] of the fluid, `dense` where densities are unequal, `near` the
    neighbours of the fluid particles."""

    scene: Scene
    depth: float
    dense: bool
    dtype: type
    lanes: int
    team: Team
    particles: ParticleState
    work: Workspace
    near: Neighbours
    boundary: BoundaryTreatment
    halo: Halo
    reductions: Reductions
