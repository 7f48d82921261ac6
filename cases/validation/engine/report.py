"""Rows as a table, a plot and orders of convergence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from cases.report.charts import COLOURS, canvas
from cases.validation.engine.case import Case, Row, met

# endings of error measures that are not relative
UNITS = {"m": "m", "s": "s", "pa": "Pa", "n": "N", "deg": "degrees", "kgps": "kg/s"}

MARKERS = "osD^"  # of the solvers, each in every colour


def unit(measure: str) -> str:
    """The unit of an error measure, from the end of its name; "%" for a relative one."""
    return UNITS.get(measure.rpartition("_")[2], "%")


def words(measure: str) -> str:
    """The name of an error measure in words, without its unit."""
    return (measure if unit(measure) == "%" else measure.rpartition("_")[0]).replace("_", " ")


def shown(measure: str, value: float | None) -> str:
    """An error as the reports print it: percent, or its own unit."""
    if value is None:
        return "failed"
    return f"{100 * value:.3g} %" if unit(measure) == "%" else f"{value:.3g} {unit(measure)}"


def seconds(value: float) -> str:
    return f"{value:.1f} s" if value < 100 else f"{value / 60:.1f} min"


def headings(case: Case) -> list[str]:
    """Column heads of the table of a case; under an error measure stands its target."""
    errors = [f"{words(name)} (<= {shown(name, target)})" for name, target in case.target.items()]
    facts = "level", "solver", "spacing", "particles", "steps", "time step", "wall time", "particle-steps", "memory"
    return [*facts, *errors, "target"]


def cells(row: Row) -> list[str]:
    """A row under `headings`; an error that misses its target is marked."""
    errors = [
        shown(name, row.error[name]) + ("" if met(row.error[name], target) else " !")
        for name, target in row.target.items()
    ]
    return [
        row.level,
        row.solver,
        f"{1000 * row.spacing:.3g} mm",
        f"{row.particles}",
        f"{row.steps}",
        f"{1000 * row.time_step:.3g} ms",
        seconds(row.wall_seconds),
        f"{row.particle_steps / 1e6:.3g} M",
        f"{row.memory_bytes / 1e6:.1f} MB",
        *errors,
        "met" if row.passed else "MISSED",
    ]


def table(case: Case, rows: Iterable[Row]):
    """The rows of a case as a rich table, one line an error, narrow enough for a terminal of 80 columns."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    heads = ("level", "solver", "particles", "steps", "run time", "error of", "", "target")
    out = Table(title=f"{case.name}: {case.title}", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in heads:
        out.add_column(head, justify="left" if head in ("level", "solver", "error of") else "right", no_wrap=True)
    for row in rows:
        facts = row.level, row.solver, str(row.particles), str(row.steps), seconds(row.wall_seconds)
        for name, target in row.target.items():
            good = met(row.error[name], target)
            line = words(name), shown(name, row.error[name]), shown(name, target) + ("" if good else " !")
            out.add_row(*facts, *line, style=None if good else "red")
            facts = ("",) * len(facts)
    return out


def order(spacing: Sequence[float], error: Sequence[float]) -> float:
    """Order of convergence p: least-squares slope of log |error| over log spacing."""
    return float(np.polyfit(np.log(spacing), np.log(np.abs(error)), 1)[0])


def orders(case: Case, rows: Iterable[Row]) -> dict[str, dict[str, float]]:
    """Solver -> measure -> order of convergence over the levels, where an error was measured on two or more and keeps
    its sign."""
    out: dict[str, dict[str, float]] = {}
    rows = list(rows)
    for solver in dict.fromkeys(row.solver for row in rows):
        own = [row for row in rows if row.solver == solver]
        for name in case.target:
            points = [(row.spacing, row.error[name]) for row in own if row.error.get(name)]
            signs = {error > 0 for _, error in points}
            if len({spacing for spacing, _ in points}) > 1 and len(signs) == 1:
                out.setdefault(solver, {})[name] = order(*zip(*points, strict=True))
    return out


def order_lines(case: Case, rows: Iterable[Row]) -> list[str]:
    """Orders of convergence in words, one line a solver."""
    lines = []
    for solver, found in orders(case, rows).items():
        values = ", ".join(f"{words(name)} {p:.2f}" for name, p in found.items())
        lines.append(f"Order of convergence, {solver}: {values}")
    return lines


def plot(case: Case, rows: Sequence[Row]):
    """Error over run time on logarithmic axes: one panel a measure that has errors to show, one line a solver, the levels along
    it, the target dashed; one legend beside them all. Returns the figure."""
    shown_ = [name for name in case.target if any(row.error.get(name) for row in rows)]
    columns, solvers = 1 if len(shown_) == 1 else 2, list(dict.fromkeys(row.solver for row in rows))
    styles = dict(zip(solvers, product(MARKERS, COLOURS), strict=False))
    figure, panels = canvas(max(1, -(-len(shown_) // columns)), columns, height=3.0)
    for panel, name in zip(panels, shown_, strict=False):
        _panel(panel, name, case.target[name], rows, styles)
    for panel in panels[len(shown_) :]:
        panel.remove()
    named = {
        label: line
        for panel in panels[: len(shown_)]
        for line, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    if len(named) > 1:
        figure.legend(named.values(), named, loc="outside right upper", fontsize=11, frameon=False)
    return figure


def _panel(panel, name: str, target: float, rows: Sequence[Row], styles: dict[str, tuple[str, str]]) -> None:
    factor = 100 if unit(name) == "%" else 1
    for solver, (marker, colour) in styles.items():
        own = [row for row in rows if row.solver == solver and row.error.get(name)]
        own.sort(key=lambda row: row.wall_seconds)
        if own:
            errors = [factor * abs(row.error[name]) for row in own]
            panel.loglog([row.wall_seconds for row in own], errors, marker + "-", color=colour, label=solver)
    if target > 0:
        panel.axhline(factor * target, color="0.5", linestyle="--", label="target")
    panel.set(xlabel="run time [s]", ylabel=f"error [{unit(name)}]")
    panel.set_title(words(name), loc="left", fontsize=13)
    panel.grid(True, which="both", color="0.9")
