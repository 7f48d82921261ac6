"""One line on stderr that says how far a run is."""

from __future__ import annotations

import time

from fsi.messages import Messages

COMPILING = "compiling the sweeps for this scene; once per scene kind"
LINE_EVERY = 30.0  # [s] of wall time, where stderr is a file or a pipe
UPDATE_EVERY = 0.2  # [s] of wall time, on a terminal


class Progress:
    """A line that renews itself on a terminal, and an occasional plain line elsewhere; silent if `quiet`.

    Use as a context and call it with the simulation after each step.
    """

    def __init__(self, duration: float, say: Messages | None = None, *, quiet: bool = False):
        self._duration = duration
        self._quiet, self._say = quiet, say or Messages(quiet)
        self._terminal = not quiet and self._say.terminal
        self._status = None
        self._start = time.perf_counter()
        self._next = self._start + (0 if self._terminal else LINE_EVERY)
        self._mark: tuple[float, int, float] | None = None  # wall time, steps and simulated time where the rate began

    def __enter__(self) -> Progress:
        if self._terminal:
            from rich.console import Console

            self._status = Console(file=self._say).status(COMPILING)
            self._status.start()
        else:
            self._say(COMPILING)
        return self

    def __exit__(self, *_) -> None:
        if self._status:
            self._status.stop()

    def __call__(self, sim) -> None:
        now = time.perf_counter()
        if self._mark is None:  # the first step went to compiling: the rate starts after it
            self._mark = now, sim.step_count, sim.time
        if self._quiet or now < self._next:
            return
        line = self._line(now, sim.step_count, sim.time)
        if self._status:
            self._status.update(line)
        else:
            self._say(line)
        self._next = now + (UPDATE_EVERY if self._terminal else LINE_EVERY)

    def _line(self, now: float, steps: int, simulated: float) -> str:
        since, first_step, first_time = self._mark
        line = f"{simulated:.3f} / {self._duration:g} s simulated, {clock(now - self._start)} elapsed"
        if now > since and simulated > first_time:
            left = (self._duration - simulated) * (now - since) / (simulated - first_time)
            line += f", {(steps - first_step) / (now - since):.3g} steps/s, {clock(left)} left"
        return line


def clock(seconds: float) -> str:
    """Hours, minutes and seconds: `12 s`, `3:05 min`, `2:07:30 h`."""
    minutes, rest = divmod(round(max(seconds, 0)), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours}:{minutes:02}:{rest:02} h"
    return f"{minutes}:{rest:02} min" if minutes else f"{rest} s"
