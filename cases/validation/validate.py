"""All runs that `fsi validate` asks for, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cases.validation import LEVELS, SOLVERS, choose
from cases.validation.case import Row
from cases.validation.report import order_lines, table
from cases.validation.runner import run_case
from cases.validation.solvers import DEFAULT
from cases.validation.store import Store
from fsi.errors import SceneError
from fsi.extras import require
from fsi.threads import available_threads


@dataclass(frozen=True)
class Validation:
    """The rows of this call, the runs that failed in words, and the report they went into."""

    rows: tuple[Row, ...]
    failures: tuple[str, ...]
    report: Path

    def tables(self) -> Iterable[object]:
        """What a rich console prints: a table for each case, and orders of convergence."""
        for name in dict.fromkeys(row.case for row in self.rows):
            (case,), own = choose([name]), [row for row in self.rows if row.case == name]
            yield table(case, own)
            yield from order_lines(case, own)


def validate(
    names: Sequence[str] = (),
    *,
    levels: Sequence[str] = (),
    solvers: Sequence[str] = (),
    out: str | Path | None = None,
    threads: int | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Validation:
    """Run these cases (all, if none are named; patterns such as `still_*` are names too) at these levels (coarse) with
    these solvers (the default one); each row is kept as soon as it is there. `say` hears of the progress.

    Raises SceneError for a name that does not exist."""
    cases = choose(names)
    levels = _known("--level", levels or LEVELS[:1], LEVELS)
    solvers = _known("--solver", solvers or [DEFAULT], SOLVERS)
    require("matplotlib", "report", "fsi validate")
    store, threads = Store.choose(out), threads or available_threads()
    rows, failures = [], []
    for case, level, solver in [(c, v, s) for c in cases for s in solvers for v in levels]:
        say(f"{case.name}, {level}, {solver} ...")
        row, reason = run_case(case, level, solver, threads)
        rows.append(row)
        store.add(row, threads)
        verdict = f"failed: {reason}" if reason else "met" if row.passed else "MISSED"
        say(f"{case.name}, {level}, {solver}: {verdict} ({row.wall_seconds:.1f} s)")
        if reason:
            failures.append(f"{case.name}, {level}, {solver}: {reason}")
    return Validation(tuple(rows), tuple(failures), store.report)


def _known(option: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    for name in names:
        if name not in known:
            raise SceneError(f"no such choice {name!r}", key=option, fix=f"choose from {', '.join(known)}")
    return list(names)
