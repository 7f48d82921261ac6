"""The study behind the defaults: every variant of the numerics on the same cases, and what the rows say for each choice.

A variant is judged by the number of targets that it meets over all cases, then by its run time: the cheapest of those that
meet the most is the choice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cases.validation.engine.case import Row, met
from cases.validation.engine.solvers import DEFAULT, SOLVERS

CASES = ("still_water", "standing_wave", "dam_energy", "elliptical_drop", "solitary_wave")
LEVEL = "medium"
CHOICES = {
    "Weights and number of the pressure sweeps": ("explicit", "explicit4", "chebyshev4", "chebyshev6", "chebyshev8"),
    "Time step (numerical Mach and Courant number)": (DEFAULT, "fine", "double_step"),
    "Accuracy": ("draft", DEFAULT, "fine"),
    "Smoothing length over spacing": ("narrow", DEFAULT),
    "Density relaxation": ("no_relaxation", DEFAULT, "relaxation10"),
    "Shifting with a free surface": (DEFAULT, "shifting"),
}


def jobs() -> list[tuple[str, str, str]]:
    """The runs (case, level, solver) of the study."""
    return [(case, LEVEL, solver) for case in CASES for solver in SOLVERS]


@dataclass(frozen=True)
class Score:
    """A variant over all cases: targets met of `measures`, run time [s], and the largest error over its target by
    case."""

    met: int
    measures: int
    seconds: float
    worst: dict[str, float]


def scores(rows: Sequence[Row]) -> dict[str, Score]:
    """Variant -> score, for those that ran on every case of the study that the default ran on."""
    chosen = [row for row in rows if row.case in CASES and row.level == LEVEL]
    needed = {row.case for row in chosen if row.solver == DEFAULT}
    out = {}
    for solver in SOLVERS:
        own = [row for row in chosen if row.solver == solver and row.case in needed]
        if needed and {row.case for row in own} == needed:
            errors = [(row.error[name], target) for row in own for name, target in row.target.items()]
            good = sum(met(error, target) for error, target in errors)
            worst = {row.case: _worst(row) for row in own}
            out[solver] = Score(good, len(errors), sum(row.wall_seconds for row in own), worst)
    return out


def _worst(row: Row) -> float:
    """Largest error over its target; infinite where the run failed, targets of zero aside."""
    ratios = [abs(row.error[name]) / t if row.error[name] is not None else float("inf") for name, t in _scaled(row)]
    return max(ratios, default=0.0)


def _scaled(row: Row):
    return [(name, target) for name, target in row.target.items() if target > 0]


def pick(found: dict[str, Score], names: Sequence[str]) -> str:
    """The cheapest of the variants that meet the most targets."""
    most = max(found[name].met for name in names)
    return min((name for name in names if found[name].met == most), key=lambda name: found[name].seconds)


def section(rows: Sequence[Row]) -> list[str]:
    """Lines of VALIDATION.md: the table of the study, and a line for each choice. Nothing before it has been run."""
    found = scores(rows)
    if len(found) < 2:
        return []
    cases = list(found[DEFAULT].worst)
    heads = ["variant", "changes", "run time", "targets met", *cases]
    lines = ["## Defaults", "", _explanation(), ""]
    lines += [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    lines += [f"| {' | '.join(_cells(name, score, found[DEFAULT], cases))} |" for name, score in found.items()]
    return [*lines, "", *(f"- {line}" for line in verdicts(found)), ""]


def _explanation() -> str:
    return (
        f"Every variant on the same cases at level {LEVEL} (`fsi validate defaults`). Run times are shares of the default's;"
        " under each case stands the largest error over its target, 1 being just met. The choice is the cheapest variant"
        " of those that meet the most targets."
    )


def _cells(name: str, score: Score, default: Score, cases: Sequence[str]) -> list[str]:
    changes = ", ".join(f"{key} {_words(value)}" for key, value in SOLVERS[name].items())
    time = f"{score.seconds / default.seconds:.2f}"
    worst = [f"{score.worst[case]:.2f}" for case in cases]
    return [f"**{name}**" if name == DEFAULT else name, changes, time, f"{score.met} of {score.measures}", *worst]


def _words(value) -> str:
    return "x 10" if callable(value) else str(value)


def verdicts(found: dict[str, Score]) -> list[str]:
    """One line for each choice that the rows can settle."""
    lines = []
    for title, names in CHOICES.items():
        names = [name for name in names if name in found]
        if len(names) < 2 or DEFAULT not in names:
            continue
        best = pick(found, names)
        parts = [
            f"{name} {found[name].met} of {found[name].measures} at {found[name].seconds / found[DEFAULT].seconds:.2f}"
            for name in names
        ]
        verdict = "the default" if best == DEFAULT else f"{best}, not the default"
        lines.append(f"{title}: {', '.join(parts)} of the default's run time. Cheapest with the most: {verdict}.")
    return lines
