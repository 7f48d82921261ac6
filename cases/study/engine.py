"""Runs a study: every point a run, in a folder named by the hash of its scene, until the table is full.

Everything that must outlive a kill is on disk and replaced in one go: the status of a run in its `run.json`, its figures
beside it, the trials of an optimisation in a journal. A study that is started again takes what is done and goes on.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from cases.study.design import Design, design
from cases.study.judge import objective, violations
from cases.study.plan import Study, Value
from cases.study.points import points
from cases.study.pool import open_pool
from cases.study.results import Row, dataset, write
from cases.study.routines import analysed, check_routine
from cases.study.study_file import load_study
from cases.study.watch import Watch
from cases.study.worker import Job, Outcome, replace
from fsi.errors import SceneError, short
from fsi.record.files import Claim
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene
from fsi.scene.toml import dumps
from fsi.trust import may_run, trusting

LOCK = "study.lock"
KEPT = "# Kept by Spindrift: the study of this folder, to read and run again.\n\n"


def sweep(
    study: Study | str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    threads: int = 1,
    retry: bool = False,
    trust: bool = False,
    quiet: bool = False,
):
    """Run a study, or what is left of it, into the folder `out` (`studies/NAME`); returns its `xarray.Dataset`.

    `workers` processes of `threads` threads each run on this machine (as many as it has cores if None; 0: in this
    process), or those of the Dask scheduler at an address. `retry` runs failed runs again; `trust` lets the Python code
    run that the study and its scene name (`fsi.trust`). Progress goes to stderr.
    Raises SceneError where the study is wrong; a run that fails is a row with its reason.
    """
    study = load_study(study)
    folder = Path(out).expanduser().absolute() if out else Path("studies", study.name).absolute()
    check_routine(study)
    if study.script:
        with trusting(trust):
            may_run(study.script, "script", study.name)
    with trusting(trust), _alone(folder):
        _check(study)
        _keep(study, folder)
        progress = _Progress(study, folder, threads, retry, trust)
        with open_pool(workers, scheduler, threads) as pool:
            total = study.sampling.samples if study.sampling.method == "optimise" else None
            feed = _Trials(study, folder, pool) if total else _Fixed(study, pool)
            figure = study.objective.figure if study.objective else ""
            with Watch(total or len(points(study)), pool.workers, figure, quiet=quiet) as watch:
                progress.run(pool, feed, watch)
        data = dataset(study, progress.rows)
        data = analysed(study, data)
        data.attrs["folder"] = str(folder)
        write(data, folder)
    return data


@dataclass
class _Progress:
    """The runs of a study that are under way, and the rows of those that have ended."""

    study: Study
    folder: Path
    threads: int
    retry: bool
    trust: bool
    _rows: dict[int, Row] = field(default_factory=dict)
    _waiting: dict[str, list[tuple[int, Design]]] = field(default_factory=lambda: defaultdict(list))

    @property
    def rows(self) -> list[Row]:
        """In the order of the points."""
        return [self._rows[number] for number in sorted(self._rows)]

    def run(self, pool, feed, watch: Watch) -> None:
        """Hand points to the pool as the feed gives them, until there are none and nothing is under way."""
        while True:
            started = list(feed.ready(sum(map(len, self._waiting.values()))))
            for number, values in started:
                self._start(pool, number, values, feed, watch)
            if not self._waiting:
                if not started:
                    return
                continue
            job, outcome = pool.next()
            for number, made in self._waiting.pop(job.folder.name):
                self._end(number, Row(made.values, made.hash, outcome), feed, watch)

    def _start(self, pool, number: int, values: dict[str, Value], feed, watch: Watch) -> None:
        try:
            made = design(self.study, values, self.folder / "runs")
        except SceneError as error:
            self._end(number, Row(values, "", Outcome("invalid", str(error), {})), feed, watch)
            return
        if made.hash not in self._waiting:
            how = (self.study.measure, self.study.routine, self.threads, self.retry, self.trust)
            pool.submit(Job(made.scene, made.folder, *how))
        self._waiting[made.hash].append((number, made))

    def _end(self, number: int, row: Row, feed, watch: Watch) -> None:
        self._rows[number] = row
        if row.outcome.status == "done" and self.study.objective:  # a figure that no run has ends the study at once
            objective(self.study, row.outcome)
            violations(self.study, row.outcome)
        watch.add(row)
        feed.ended(number, row.outcome)


class _Fixed:
    """Points that are known from the start: all are ready at once."""

    def __init__(self, study: Study, pool):
        self._points = list(enumerate(points(study)))

    def ready(self, under_way: int) -> list:
        """Number and values of the points to start."""
        ready, self._points = self._points, []
        return ready

    def ended(self, number: int, outcome: Outcome) -> None:
        """Take note of an outcome."""


class _Trials:
    """Trials of an optimisation: as many under way as there are workers, each the next best guess."""

    def __init__(self, study: Study, folder: Path, pool):
        from cases.study.optimise import Search

        self._search, self._at_once = Search(study, folder), pool.workers
        self._told = [(-1 - n, point) for n, point in enumerate(reversed(self._search.points()))][::-1]
        self._left = study.sampling.samples - len(self._told)

    def ready(self, under_way: int) -> Iterator[tuple[int, dict]]:
        """Number and values of the trials to start; those of an earlier start first, to have their rows."""
        told, self._told = self._told, []
        yield from told
        for _ in range(min(self._left, self._at_once - under_way - len(told))):
            self._left -= 1
            yield self._search.ask()

    def ended(self, number: int, outcome: Outcome) -> None:
        """Tell the search what came of a trial."""
        if number >= 0:
            self._search.tell(number, outcome)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Hold the study's folder; SceneError where it cannot be made or another process has it."""
    claim = Claim(folder / LOCK)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        taken = claim.take()
    except OSError as fault:
        fix = "choose another folder"
        raise SceneError(f"{short(folder)} cannot be written: {fault.strerror}", key="--out", fix=fix) from None
    if not taken:
        fix = "wait for it to end, or choose another folder"
        raise SceneError(f"another process is at work on {folder}", key="--out", fix=fix)
    try:
        yield
    finally:
        claim.drop()


def _check(study: Study) -> None:
    """Raises SceneError where no point of the study can be a scene: a mistake in the study, not in a point."""
    from fsi.scene.binding import bind

    faults = []
    with TemporaryDirectory() as scratch:
        for values in _first_points(study):
            try:
                made = design(study, values, Path(scratch))
                bind(made.scene, made.scene.name)
                return
            except SceneError as error:
                faults.append(error)
    raise faults[0]


def _first_points(study: Study) -> list[dict]:
    if study.sampling.method == "optimise":
        return [{name: p.at(fraction) for name, p in study.parameters.items()} for fraction in (0.5, 0.0, 1.0)]
    return points(study)


def _keep(study: Study, folder: Path) -> None:
    """Write the study as `study.toml`, to read and run again; a scene that was made in Python stands beside it.
    Raises SceneError where the folder holds something else than a study that was kept so."""
    values = json.loads(study.model_dump_json(by_alias=True, exclude_none=True))
    own = isinstance(study.scene, Scene)
    if own:
        values["scene"] = "scene.toml"
    file, text = folder / "study.toml", dumps(values)
    kept = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
    others = sorted(entry.name for entry in folder.iterdir() if entry.name != LOCK)
    if others and not kept.startswith(KEPT) and kept != text:
        fault = f"{folder} holds {others[0]}, which no study of Spindrift has made"
        raise SceneError(fault, key="--out", fix="choose another folder, or an empty one")
    if own:
        replace(folder / "scene.toml", resolved_toml(study.scene))
    replace(file, KEPT + text)
