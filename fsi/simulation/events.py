"""What happens in a run, in words: impacts of the fluid on bodies, cuts of the time step, and the conditions that the
bodies report, such as a joint at its limit or a contact."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from fsi.protocols import BodySet, Event, Moment
from fsi.scene.model import Scene
from fsi.state import Remembers

IMPACT_TIME = 0.2  # of the mean that an impact stands out of, in sqrt(depth / g)
SETTLED = 3  # IMPACT_TIMEs after the start, from which on the mean has a past
REARM = 0.5  # share of the threshold under which an impact is over
CUT = 0.5  # share of the time step so far, under which a step is cut
FORGET = 0.01  # share of its excess that the time step so far loses in every step


class Watch(Remembers):
    """Tells the events of every step of a scene whose fluid is `depth` metres high."""

    remembered = ("_cuts", "_beginnings", "_impacts")

    def __init__(self, scene: Scene, depth: float, bodies: BodySet | None):
        scale = math.sqrt(depth / scene.gravity) if scene.gravity else math.inf
        self._bodies = bodies
        self._cuts, self._beginnings = StepCuts(), Beginnings(scale)
        heavy = bodies and len(bodies.names) and scene.gravity
        self._impacts = Impacts(bodies.names, bodies.mass * scene.gravity, IMPACT_TIME * scale) if heavy else None

    def __call__(self, now: Moment, dt: float, force: np.ndarray, chosen: float, reason: str) -> Iterator[Event]:
        """The events of a step of dt [s] that ends now: the fluid's force (b, 3) on the bodies in it, the time step that
        was chosen [s] and what it was chosen for."""
        if cut := self._cuts(chosen, reason):
            yield Event(now, "info", cut)
        if self._bodies:
            for text in self._beginnings(now.time, self._bodies.conditions()):
                yield Event(now, "info", text)
        for moment, text in self._impacts(now, dt, force) if self._impacts else ():
            yield Event(moment, "info", text)

    def finish(self, now: Moment) -> Iterator[Event]:
        """What was not over when the run ended."""
        for moment, text in self._impacts.finish(now) if self._impacts else ():
            yield Event(moment, "info", text)


class Impacts:
    """Impacts of the fluid on bodies.

    The force (b, 3) on a body is compared with its own exponential mean over IMPACT_TIME sqrt(depth / g), short against
    the periods of waves in that depth and long against a slam. An impact is on while force and mean differ by more than
    the larger of the mean and the body's weight; it is told when it is over, with the time and the size of its peak.
    """

    def __init__(self, names: Sequence[str], weight: np.ndarray, period: float):
        self.names, self.weight, self.period = names, weight, period
        self._mean: np.ndarray | None = None
        self._open: dict[int, tuple[float, Moment, float]] = {}  # body -> time of the start, moment of the peak, peak

    def __call__(self, now: Moment, dt: float, force: np.ndarray) -> list[tuple[Moment, str]]:
        """(moment of the peak, text) of the impacts that this step ends."""
        if self._mean is None:
            self._mean = force.copy()
        threshold = np.maximum(self.weight, np.linalg.norm(self._mean, axis=1))
        excess = np.linalg.norm(force - self._mean, axis=1) / threshold
        self._mean += -math.expm1(-dt / self.period) * (force - self._mean)
        for b in np.flatnonzero(excess > 1) if now.time > SETTLED * self.period else ():
            size = float(np.linalg.norm(force[b]))
            start, _, peak = self._open.get(b, (now.time, now, 0.0))
            if size > peak:
                self._open[b] = start, now, size
        return [self._told(b, now) for b in list(self._open) if excess[b] < REARM]

    def finish(self, now: Moment) -> list[tuple[Moment, str]]:
        """Those that are still on at the end."""
        return [self._told(b, now) for b in list(self._open)]

    def state(self) -> dict:
        """The mean, and the impacts that are on, as [body, start, time, step and wall time of the peak, peak]."""
        on = [[int(b), float(start), *map(float, peak), size] for b, (start, peak, size) in self._open.items()]
        return {"mean": None if self._mean is None else self._mean.copy(), "on": on}

    def restore(self, state: dict) -> None:
        self._mean = None if state["mean"] is None else state["mean"].copy()
        self._open = {
            b: (start, Moment(time, int(step), wall), size) for b, start, time, step, wall, size in state["on"]
        }

    def _told(self, b: int, now: Moment) -> tuple[Moment, str]:
        start, moment, peak = self._open.pop(b)
        return moment, (
            f"impact on {self.names[b]!r}: {peak:.4g} N at its peak, {peak / self.weight[b]:.3g} times the body's weight, "
            f"over {1000 * (now.time - start):.3g} ms"
        )


class StepCuts(Remembers):
    """Sudden cuts of the time step, and what asked for them."""

    remembered = ("_usual",)

    def __init__(self):
        self._usual = 0.0

    def __call__(self, step: float, reason: str) -> str | None:
        """A text where the step [s] that was chosen for `reason` is cut."""
        usual, self._usual = self._usual, max(step, self._usual - FORGET * (self._usual - step))
        if step >= CUT * usual:
            return None
        self._usual = step
        return f"time step cut from {1000 * usual:.3g} to {1000 * step:.3g} ms by {reason}"


class Beginnings(Remembers):
    """Of conditions that hold from step to step, those that begin; one that comes back within `quiet` s goes on."""

    remembered = ("_seen",)

    def __init__(self, quiet: float):
        self.quiet = quiet
        self._seen: dict[str, float] = {}

    def __call__(self, time: float, conditions: Iterable[str]) -> list[str]:
        new = []
        for text in conditions:
            if time - self._seen.get(text, -math.inf) > self.quiet:
                new.append(text)
            self._seen[text] = time
        return new
