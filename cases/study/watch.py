"""What a study shows while it goes on: how far it is, the time left, and a table of the runs that have finished."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from cases.study.results import Row
from fsi.progress import clock

SHOWN = 15  # last rows of the live table


class Watch:
    """A live table on a terminal, a line a run elsewhere; silent if `quiet`. Use as a context, call `add` with each row.

    `figure` is the key of the figure shown beside the parameters, "" for that of the first run.
    """

    def __init__(self, total: int, workers: int, figure: str = "", *, quiet: bool = False):
        self.total, self.workers, self.figure = total, workers, figure
        self.rows: list[Row] = []
        self._quiet, self._live = quiet, None
        self._start = time.perf_counter()
        self._taken: list[float] = []

    def __enter__(self) -> Watch:
        if not self._quiet and sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            self._live = Live(console=Console(stderr=True), get_renderable=self.table, refresh_per_second=2)
            self._live.start()
        return self

    def __exit__(self, *_) -> None:
        if self._live:
            self._live.stop()

    def add(self, row: Row) -> None:
        """A run has finished, or was taken from an earlier one."""
        self.rows.append(row)
        if not row.outcome.reused and row.outcome.status != "invalid":
            self._taken.append(row.outcome.wall_seconds)
        self.figure = self.figure or _first_figure(row)
        if not self._quiet and not self._live:
            cells = ", ".join(f"{name} = {_short(value)}" for name, value in row.values.items())
            line = f"{self.head()}: {cells or row.run}: {self._result(row)}"
            print(line, file=sys.stderr, flush=True)

    def head(self) -> str:
        """How far the study is."""
        done, line = len(self.rows), f"{len(self.rows)}/{self.total} runs"
        failed = sum(row.outcome.status != "done" for row in self.rows)
        line += f", {failed} failed" if failed else ""
        if self._taken and done < self.total:
            left = sum(self._taken) / len(self._taken) * (self.total - done) / self.workers
            return f"{line}, {clock(left)} left"
        return line

    def table(self):
        """The last finished runs."""
        from rich.box import SIMPLE_HEAD
        from rich.table import Table

        title = f"{self.head()}, {clock(time.perf_counter() - self._start)} elapsed"
        out = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
        for name in [*(self.rows[0].values if self.rows else ()), self.figure or "result", "run", "time"]:
            out.add_column(name, justify="right")
        for row in self.rows[-SHOWN:]:
            cells = [_short(value) for value in row.values.values()]
            taken = "reused" if row.outcome.reused else clock(row.outcome.wall_seconds)
            style = None if row.outcome.status == "done" else "red"
            out.add_row(*cells, self._result(row), row.run[:8], taken, style=style)
        return out

    def _result(self, row: Row) -> str:
        if row.outcome.status != "done":
            return f"{row.outcome.status}: {row.outcome.reason.splitlines()[0] if row.outcome.reason else ''}"
        figure = (row.outcome.figures or {}).get(self.figure)
        again = " (reused)" if row.outcome.reused and not self._live else ""
        return (f"{_short(figure[1])} {figure[2]}" if figure else "done") + again


def _first_figure(row: Row) -> str:
    """The figure to show where the study names none."""
    keys: Sequence[str] = list(row.outcome.figures or ())
    return next((key for key in ("mean_power", "decay_period") if key in keys), keys[0] if keys else "")


def _short(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
