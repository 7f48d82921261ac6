"""All runs that `fsi validate` asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cases.validation.engine import defaults
from cases.validation.engine.case import LEVELS, Row
from cases.validation.engine.jobs import Job, run_all
from cases.validation.engine.registry import choose
from cases.validation.engine.report import order_lines, table
from cases.validation.engine.solvers import DEFAULT, SOLVERS
from cases.validation.engine.store import Store
from fsi.compute.team import available_threads
from fsi.errors import SceneError
from fsi.extras import require

STUDY = "defaults"


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
    jobs: int = 1,
    figures: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> Validation:
    """Run these cases (all, if none are named; groups, and patterns such as `still_*`, are names too) at these levels
    (coarse) with these solvers (the default one); `defaults` is the study of all variants. Each row is kept as soon as it
    is there. With `jobs` above one so many run at a time, on a processor each. With `figures` each run gets a page with its
    pictures in the folder `figures` beside the rows. `say` hears of the progress.

    Cases without one of the levels leave it out. Raises SceneError for a name that does not exist, and for a level that none
    of the cases has."""
    levels = _known("--level", levels or LEVELS[:1], LEVELS)
    solvers = _known("--solver", solvers or [DEFAULT], SOLVERS)
    runs = _runs(tuple(names), levels, solvers)
    require("matplotlib", "report", "fsi validate")
    store, threads = Store.choose(out), 1 if jobs > 1 else threads or available_threads()
    rows, failures = {}, []
    say(f"{len(runs)} runs")
    for run, row, reason in run_all(runs, jobs, threads, store.folder / "figures" if figures else None):
        rows[run] = row
        store.add(row, threads)
        verdict = f"failed: {reason}" if reason else "met" if row.passed else "MISSED"
        say(f"{', '.join(run)}: {verdict} ({row.wall_seconds:.1f} s), {len(rows)} of {len(runs)}")
        if reason:
            failures.append(f"{', '.join(run)}: {reason}")
    return Validation(tuple(rows[run] for run in runs), tuple(failures), store.report)


def pages(names: Sequence[str] = (), *, out: str | Path | None = None) -> list[Path]:
    """Write a page for each of these cases (all, if none are named) from the rows that are kept; returns the files.
    Raises SceneError where none of them has rows."""
    require("matplotlib", "report", "the pages of fsi validate")
    store = Store.choose(out)
    written = store.pages([case.name for case in choose(tuple(names))])
    if not written:
        raise SceneError("no rows of these cases are kept", file=store.file, fix="run them: fsi validate CASE")
    return written


def _runs(names: tuple[str, ...], levels: Sequence[str], solvers: Sequence[str]) -> list[Job]:
    """Case, level and solver of each run; those of the study of the defaults first."""
    plain = [name for name in names if name != STUDY]
    study = defaults.jobs() if STUDY in names else []
    chosen = choose(plain) if plain or not names else []
    for level in levels if chosen else ():
        if not any(level in case.spacing for case in chosen):
            known = dict.fromkeys(v for case in chosen for v in case.spacing)
            raise SceneError(f"no case here has {level!r}", key="--level", fix=f"choose from {', '.join(known)}")
    return list(
        dict.fromkeys(study + [(c.name, v, s) for c in chosen for s in solvers for v in levels if v in c.spacing])
    )


def _known(option: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    for name in names:
        if name not in known:
            raise SceneError(f"no such choice {name!r}", key=option, fix=f"choose from {', '.join(known)}")
    return list(names)
