"""What a validation case consists of, and the row that a run of it gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

LEVELS = ("coarse", "medium", "paper", "fine")  # paper: the spacing of the documents; few cases have a finer one


class Measure:
    """Watches one run and tells its errors. It is made before the first step, when it may still set the velocities,
    and called after every step; `sample` is called every `interval` simulated seconds, or each step if that is 0."""

    interval = 0.0

    def __init__(self, sim):
        self._due = self.interval
        self.begin(sim)

    def __call__(self, sim) -> None:
        if sim.time >= self._due * (1 - 1e-9):
            self._due = max(self._due + self.interval, sim.time)
            self.sample(sim)

    def begin(self, sim) -> None:
        """Prepare the start of the run."""

    def sample(self, sim) -> None:
        """Note what `errors` needs."""

    def errors(self) -> dict[str, float]:
        """Measure name -> error; relative unless the name ends in a unit."""
        raise NotImplementedError


@dataclass(frozen=True)
class Wrong:
    """A wrong result in words, and the `error` that it gives: a target has to be below that."""

    what: str
    error: float


@dataclass(frozen=True)
class Case:
    """One validation case.

    `reference`: the exact answer or the experiment, with its source. `spacing`: level -> particle spacing [m].
    `scene(spacing, folder)`: the scene as plain data; files it needs are written to `folder`. `target`: largest
    magnitude that each error may have. `reasons`: why rows miss a target, as far as it was found; the report shows it
    beside rows that do. `fails_when`: measure -> a result that an engineer would call wrong, and that its target has to catch,
    where `engine.wrong` has none for a measure of that name.

    `run(case, level, solver, threads, figures)`, for a case that is no single run, gives its row and why it failed ("" where it
    did not), as `cases.validation.engine.runner.run_case` does;
    `plot(case, rows)` draws a figure of its own in place of error over run time.
    """

    name: str
    title: str
    reference: str
    spacing: Mapping[str, float]
    scene: Callable[[float, Path], dict]
    measure: Callable[..., Measure] | None
    target: Mapping[str, float]
    reasons: str = ""
    run: Callable[[Case, str, str, int | None, Path | None], tuple[Row, str]] | None = None
    plot: Callable[[Case, Sequence[Row]], object] | None = None
    fails_when: Mapping[str, Wrong] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """One run: `particles` counts the fluid's at the start, `particle_steps` sums them over the steps, `wall_seconds`
    leaves out compiling and measuring, `time_step` [s] is the mean. An error that could not be measured, because the run
    failed, is None."""

    case: str
    level: str
    solver: str
    spacing: float
    dimension: int
    particles: int
    steps: int
    particle_steps: int
    time_step: float
    wall_seconds: float
    simulated_seconds: float
    memory_bytes: int
    error: dict[str, float | None]
    target: dict[str, float]
    passed: bool

    def as_dict(self) -> dict:
        """The row as `fsi validate --json` prints it."""
        return asdict(self)


def judged(row: Row, target: Mapping[str, float]) -> Row:
    """The row against these targets."""
    passed = all(met(row.error[name], limit) for name, limit in target.items())
    return replace(row, target=dict(target), passed=passed)


def met(error: float | None, target: float) -> bool:
    """Whether an error was measured and keeps to its target."""
    return error is not None and math.isfinite(error) and abs(error) <= target
