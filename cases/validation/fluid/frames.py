"""The same flow in another frame gives the same answer: moving, turned, mirrored.

A run and its twin take the same fixed steps; the twin's particles are brought back to the frame of the run and compared
with those of the same place at t = 0. Sums run over neighbours in the order of the cells, which no change of frame keeps, so
that the two differ by round-off, and round-off grows with a flow that folds particles into each other.

What breaks the symmetry beyond round-off is the wall guard: it goes through the wall particles one by one, so that where two
of them slow a particle the result depends on their order. At a spacing of 40 mm that comes after 110 steps, and mirror
images are then 1e-3 spacings apart; the runs end before.

- moving: Taylor-Green vortices in a periodic square, and the same with a uniform velocity of twice their own (Galileo);
- turned: a column collapses under gravity; the twin, turned by 90 degrees, under an acceleration of the fluid along x;
- askew: a drop is drawn out (`cases.validation.fluid.drop`); the twin starts turned by 30 degrees, across all cells;
- mirrored: a column collapses in the middle of a tank; each particle against its mirror image in the same run.

Sweeps in double precision; differences are root mean squares of positions, as a share of the spacing.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from cases.validation.fluid import drop, taylor_green
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

DRIFT = np.array([2.0, 1.0]) * taylor_green.SPEED  # of the moving frame [m/s]
G, COLUMN, STEPS = 9.81, (0.48, 0.96), 90  # [m/s2], size of the column [m], steps


def by_label(sim: Simulation) -> np.ndarray:
    """Positions (n, dim) in the order of the layout."""
    return sim.fluid.position[np.argsort(sim.fluid.label)]


def pairs(here: np.ndarray, there: np.ndarray, spacing: float) -> np.ndarray:
    """For each point of `here` (n, dim) the number of the same point in `there`, both on one lattice."""

    def order(points):
        return np.lexsort(np.round(points / spacing - 0.5).T)

    out = np.empty(len(here), int)
    out[order(here)] = order(there)
    assert np.allclose(here, there[out], atol=1e-6 * spacing)
    return out


class Twins(Measure):
    """Difference of the positions of a run and its twin, which is stepped along; `early` a tenth of the way."""

    def begin(self, sim: Simulation) -> None:
        self.twin = self.make_twin(sim)
        self.spacing, self.found = sim.scene.spacing, []
        self.match = pairs(by_label(sim), self.back(by_label(self.twin), 0.0), self.spacing)

    def make_twin(self, sim: Simulation) -> Simulation:
        raise NotImplementedError

    def back(self, position: np.ndarray, time: float) -> np.ndarray:
        """Positions of the twin in the frame of the run."""
        raise NotImplementedError

    def difference(self, here: np.ndarray, there: np.ndarray) -> np.ndarray:
        return here - there

    def sample(self, sim: Simulation) -> None:
        self.twin.step(sim.scene.duration)
        off = self.difference(by_label(sim), self.back(by_label(self.twin), sim.time)[self.match])
        self.found.append(float(np.sqrt((off**2).sum(1).mean())) / self.spacing)

    def errors(self) -> dict[str, float]:
        return {"difference": self.found[-1], "difference_early": self.found[len(self.found) // 10]}


class Moving(Twins):
    """The twin moves with DRIFT through the periodic square."""

    def make_twin(self, sim: Simulation) -> Simulation:
        start = taylor_green.exact_velocity(sim.fluid.position, 0.0)
        sim.fluid.velocity[:] = start
        twin = Simulation(sim.scene, threads=1)
        twin.fluid.velocity[:] = start + DRIFT
        return twin

    def back(self, position: np.ndarray, time: float) -> np.ndarray:
        return (position - DRIFT * time) % taylor_green.LENGTH

    def difference(self, here: np.ndarray, there: np.ndarray) -> np.ndarray:
        half = 0.5 * taylor_green.LENGTH
        return (here - there + half) % taylor_green.LENGTH - half


class Turned(Twins):
    """The twin is turned by 90 degrees: its down is along -x."""

    def make_twin(self, sim: Simulation) -> Simulation:
        return Simulation(Scene.model_validate(_column(sim.scene.spacing, turned=True)), threads=1)

    def back(self, position: np.ndarray, time: float) -> np.ndarray:
        return position[:, ::-1] * [-1.0, 1.0] + [COLUMN[0] * 4, 0.0]


class Askew(Twins):
    """The twin is turned by 30 degrees."""

    TURN = np.array([[math.sqrt(0.75), -0.5], [0.5, math.sqrt(0.75)]])

    def make_twin(self, sim: Simulation) -> Simulation:
        sim.fluid.velocity[:] = drop.strain(sim.fluid.position)
        twin = Simulation(sim.scene, threads=1)
        twin.fluid.velocity[:] = sim.fluid.velocity @ self.TURN.T
        twin.fluid.position[:] = twin.fluid.position @ self.TURN.T
        return twin

    def back(self, position: np.ndarray, time: float) -> np.ndarray:
        return position @ self.TURN


class Mirrored(Measure):
    """Difference of each particle from the mirror image of its partner in the same run."""

    def begin(self, sim: Simulation) -> None:
        self.width, self.spacing, self.found = sim.scene.tank.max[0], sim.scene.spacing, []
        self.match = pairs(by_label(sim), self.mirror(by_label(sim)), self.spacing)

    def mirror(self, position: np.ndarray) -> np.ndarray:
        return position * [-1.0, 1.0] + [self.width, 0.0]

    def sample(self, sim: Simulation) -> None:
        here = by_label(sim)
        off = here - self.mirror(here)[self.match]
        self.found.append(float(np.sqrt((off**2).sum(1).mean())) / self.spacing)

    errors = Twins.errors


def _stepped(scene: dict, step: float) -> dict:
    """The scene, run over STEPS steps of `step` [s] in double precision."""
    return scene | {"duration": STEPS * step, "numerics": {"precision": "double", "fixed_time_step": step}}


def _vortices(spacing: float, folder) -> dict:
    scene = taylor_green.CASES["taylor_green"].scene(spacing, folder)
    return _stepped(scene, 0.1 * spacing / taylor_green.SPEED)


def _drop(spacing: float, folder) -> dict:
    scene = drop.CASES["elliptical_drop"].scene(spacing, folder)
    return _stepped(scene, scene["numerics"]["max_time_step"])


def _column(spacing: float, turned: bool = False) -> dict:
    """A column against the wall of a tank twice as wide as high; where it is turned, down is along -x. What follows from
    `gravity` is set by hand, alike in both."""
    (width, height), size = COLUMN, (4 * COLUMN[0], 1.25 * COLUMN[1])
    step = 0.004 * spacing / 0.04
    if turned:
        down = {"acceleration": [-G, 0.0]}
        low, high, tank = [0.0, size[0] - width], [height, size[0]], [size[1], size[0]]
    else:
        down = {"acceleration": [0.0, -G]}
        low, high, tank = [0.0, 0.0], [width, height], list(size)
    return {
        "spacing": spacing,
        "duration": STEPS * step,
        "gravity": 0.0,
        "tank": {"min": [0.0, 0.0], "max": tank, "walls": ["x-", "x+", "z-", "z+"]},
        "fluid": {"start": "zero", "blocks": [{"min": low, "max": high}]} | down,
        "numerics": {"precision": "double", "fixed_time_step": step, "density_relaxation": 1e-3},
    }


def _middle(spacing: float, folder) -> dict:
    scene = _column(spacing)
    left = 1.5 * COLUMN[0]
    scene["fluid"]["blocks"] = [{"min": [left, 0.0], "max": [left + COLUMN[0], COLUMN[1]]}]
    return scene


REFERENCE = (
    "Exact: the two runs are one. Root mean square difference of positions, as a share of the spacing, in the end and"
)
REFERENCE += f" after a tenth of the {STEPS} steps; sweeps in double precision."
TARGET = {"difference": 1e-6, "difference_early": 1e-12}
SPACING = {"coarse": 0.04, "medium": 0.02, "paper": 0.01}

NAMES = ("moving_frame", "turned_frame", "askew_frame", "mirror")
CASES = {
    case.name: case
    for case in (
        Case(
            "moving_frame", "Taylor-Green vortices at rest and carried along", REFERENCE, SPACING, _vortices, Moving, TARGET
        ),
        Case(
            "turned_frame", "A column collapses, and the same turned by 90 degrees", REFERENCE, SPACING,
            lambda spacing, folder: _column(spacing), Turned, TARGET,
        ),
        Case(
            "askew_frame", "A drop is drawn out, and the same turned by 30 degrees", REFERENCE, SPACING, _drop, Askew, TARGET
        ),
        Case(
            "mirror", "A column collapses in the middle of a tank, and its mirror image", REFERENCE, SPACING,
            _middle, Mirrored, TARGET,
        ),
    )
}  # fmt: skip
