"""The plain fluid that speed is measured on: a block of particles in a vortex, without walls, gravity or logging.

The lattice is jittered and turned against the axes of the cells, so that nothing is aligned; every particle is fluid, and
those at the faces of the block have fewer neighbours, which are therefore counted.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Sequence
from statistics import median

import numpy as np

from fsi.compute.team import Team
from fsi.errors import RunError
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import Layout
from fsi.scene.model import Scene

COURANT = 0.02  # largest speed * time step / spacing
VISIT = 0.3  # seconds that a block is stepped for before it is the next one's turn

# Phases of a step by the kernels in them; what is in none of them is serial and counts as "rest".
PHASES = {
    "sort": ("histogram", "sum", "prefix", "order"),
    "pack": ("gather", "pack_fluid"),
    "lists": ("search",),
    "predictor": ("predict",),
    "first sweep": ("source",),
    "further sweeps": ("sweep",),
    "corrector": ("correct",),
}


class TimedTeam(Team):
    """A team that adds up the seconds spent in each kernel."""

    def __init__(self, threads: int):
        super().__init__(threads)
        self.clock = time.process_time if threads == 1 else time.perf_counter
        self.seconds: dict[str, float] = defaultdict(float)

    def run(self, kernel, bounds, *args) -> None:
        start = self.clock()
        super().run(kernel, bounds, *args)
        self.seconds[kernel.__name__.strip("_")] += self.clock() - start


class Block:
    """A block of about so many particles; `samples` holds the seconds of each timed step: "wall", "processor", "step"
    (the one of the two that the team's clock shows) and those of each phase."""

    def __init__(self, dimension: int, particles: int, *, sweeps: int = 1, precision: str = "single", threads: int = 1):
        spacing = 1 / round(particles ** (1 / dimension))
        position, velocity = _vortex(dimension, spacing)
        low, high = position.min(0) - 0.1, position.max(0) + 0.1
        scene = Scene.model_validate(
            {
                "dimension": dimension,
                "spacing": spacing,
                "duration": 1.0,
                "gravity": 0.0,
                "tank": {"min": tuple(low), "max": tuple(high), "walls": ()},
                "fluid": {"kinematic_viscosity": 1e-3},
                "numerics": {
                    "smoothing_ratio": 1.5,
                    "sweeps": sweeps,
                    "precision": precision,
                    "artificial_viscosity": 0.0,
                },
            }
        )
        none = np.empty((0, dimension)), np.empty(0, np.int32)
        layout = Layout(position, velocity, np.zeros(len(position)), *none, low, high, 1.0, scene.spacing**dimension, ())
        self.team = TimedTeam(threads)
        self.fluid = Fluid(scene, layout, self.team)
        self.threads, self.sweeps, self.precision = threads, sweeps, precision
        self.samples: list[dict[str, float]] = []

    @property
    def _state(self) -> list[np.ndarray]:
        fluid = self.fluid
        return [fluid.position, fluid.velocity, fluid.pressure_values, fluid.label]

    def keep(self) -> None:
        """Remember the state for `rewind`."""
        self._kept = [array.copy() for array in self._state]

    def rewind(self) -> None:
        """Back to the state that was kept, so that the block does not fly apart however often it is stepped."""
        for array, kept in zip(self._state, self._kept, strict=True):
            array[:] = kept

    def step(self) -> dict[str, float]:
        """One step, in the order in which `fsi.simulation.loop` calls its pieces; its seconds as in `samples`."""
        fluid, still = self.fluid, np.zeros((1, 6))
        self.team.seconds.clear()
        wall, processor = time.perf_counter(), time.process_time()
        fluid.begin(COURANT * fluid.scene.spacing, np.zeros((1, 3)), still)
        fluid.predict()
        fluid.pressure(still)
        fluid.correct()
        seconds = {"wall": time.perf_counter() - wall, "processor": time.process_time() - processor}
        seconds["step"] = seconds["processor" if self.threads == 1 else "wall"]
        for phase, kernels in PHASES.items():
            seconds[phase] = sum(self.team.seconds[name] for name in kernels)
        return seconds

    def median(self, what: str = "step") -> float:
        """Median seconds of `what` over the samples."""
        return median(sample[what] for sample in self.samples)

    def nanoseconds(self, what: str = "step") -> float:
        """The same per particle [ns]."""
        return 1e9 * self.median(what) / self.fluid.count

    def check(self) -> None:
        """Raises RunError where the block has not stayed whole: what was timed was not the work it stands for."""
        if self.fluid.lost or not np.isfinite(self.fluid.velocity).all():
            raise RunError(f"the block of the benchmark has come apart ({self.fluid.lost} particles lost)")


def measure(blocks: Sequence[Block], rounds: int = 3, visit: float = VISIT) -> None:
    """Settle the blocks, then take samples of all of them in turns. The first step of each turn is left out: it brings the
    data of the block back into the caches."""
    steps = {}
    for block in blocks:
        block.step()  # may compile
        steps[block] = max(1, math.ceil(visit / min(block.step()["wall"], block.step()["wall"])))
        block.check()
        block.keep()
    for _ in range(rounds):
        for block in blocks:
            block.rewind()
            block.step()
            block.samples += [block.step() for _ in range(steps[block])]
    for block in blocks:
        block.check()
        block.team.close()


def _vortex(dimension: int, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (n, dim) in a unit block, in a vortex that runs along its faces at up to 1 m/s."""
    axis = (np.arange(round(1 / spacing)) + 0.5) * spacing
    position = np.stack(np.meshgrid(*[axis] * dimension, indexing="ij"), -1).reshape(-1, dimension)
    position += np.random.default_rng(1).uniform(-0.1, 0.1, position.shape) * spacing
    velocity = np.zeros_like(position)
    x, y = math.pi * position[:, 0], math.pi * position[:, 1]
    velocity[:, 0], velocity[:, 1] = np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)
    turn = _turn(dimension)
    return position @ turn.T, velocity @ turn.T


def _turn(dimension: int) -> np.ndarray:
    """A rotation (dim, dim) that aligns no axis with another."""
    c, s = math.cos(0.3), math.sin(0.3)
    if dimension == 2:
        return np.array([[c, -s], [s, c]])
    e, f = math.cos(0.5), math.sin(0.5)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, e, -f], [0, f, e]])
