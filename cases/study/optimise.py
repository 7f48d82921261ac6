"""Optimisation of an objective by Optuna's tree-structured Parzen estimator (Bergstra et al. 2011), asked and told.

The journal `optuna.journal` in the study's folder holds every trial. Where a study was killed its open trials are asked
for again first, so that none is lost; those that were told are not run again.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path

from cases.study.judge import objective, violations
from cases.study.plan import Parameter, Study
from cases.study.points import Point, hypercube
from cases.study.worker import Outcome
from fsi.extras import require

JOURNAL = "optuna.journal"


class Search:
    """The trials of one study; `points()` are those of the trials that were told before."""

    def __init__(self, study: Study, folder: Path):
        optuna = require("optuna", "study", "an optimisation")
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self._optuna, self._study = optuna, study
        self._distributions = {name: _distribution(optuna, p) for name, p in study.parameters.items()}
        self._open: dict = {}
        first = max(3, study.sampling.samples // 3)
        self._trials = optuna.create_study(
            storage=_journal(optuna, folder / JOURNAL),
            study_name=_identity(study),
            direction="maximize" if study.objective.sign > 0 else "minimize",
            sampler=optuna.samplers.TPESampler(seed=study.sampling.seed, n_startup_trials=first),
            load_if_exists=True,
        )
        self._recover(first)

    def _recover(self, first: int) -> None:
        """Ask for what was open, or at the very start for the points of the study and a Latin hypercube."""
        states = self._optuna.trial.TrialState
        trials = self._trials.get_trials(deepcopy=False)
        self._told = [t for t in trials if t.state == states.COMPLETE or t.user_attrs.get("failed")]
        if not trials:
            given = [dict(point) for point in self._study.sampling.points]
            for point in given + hypercube(self._study, max(first - len(given), 0)):
                self._trials.enqueue_trial(point)
        for trial in trials:
            if trial.state == states.RUNNING:
                self._trials.tell(trial.number, state=states.FAIL)
                self._trials.enqueue_trial(trial.params or trial.system_attrs.get("fixed_params", {}))
        self._trials.sampler = self._optuna.samplers.TPESampler(
            seed=self._study.sampling.seed + len(trials), n_startup_trials=first
        )

    def points(self) -> list[Point]:
        """Points of the trials that were told before this start."""
        return [self._point(trial.params) for trial in self._told]

    def ask(self) -> tuple[int, Point]:
        """The next trial: its number and its point."""
        trial = self._trials.ask(self._distributions)
        self._open[trial.number] = trial
        return trial.number, self._point(trial.params)

    def tell(self, number: int, outcome: Outcome) -> None:
        """What came of a trial; a failed run is a trial without a value."""
        state = self._optuna.trial.TrialState
        trial, value = self._open.pop(number), objective(self._study, outcome)
        if math.isnan(value):
            trial.set_user_attr("failed", True)
            self._trials.tell(number, state=state.FAIL)
            return
        for name, excess in violations(self._study, outcome).items():
            trial.set_constraint(name, excess)
        self._trials.tell(number, value)

    def _point(self, values: Mapping) -> Point:
        parameters = self._study.parameters
        return {name: _rounded(parameters[name], values[name]) for name in parameters}


def _rounded(parameter: Parameter, value):
    return float(f"{value:.9g}") if isinstance(value, float) else value


def _distribution(optuna, parameter: Parameter):
    distributions = optuna.distributions
    if parameter.values:
        return distributions.CategoricalDistribution(parameter.values)
    log = parameter.scale == "log"
    if parameter.whole:
        return distributions.IntDistribution(math.ceil(parameter.min), math.floor(parameter.max), log=log)
    return distributions.FloatDistribution(parameter.min, parameter.max, log=log)


def _identity(study: Study) -> str:
    """A name that changes with everything a trial depends on: one journal may hold several searches."""
    parts = study.model_dump_json(
        include={"scene", "script", "settings", "parameters", "objective", "constraints", "measure"}
    )
    return f"{study.name}-{hashlib.sha256(parts.encode()).hexdigest()[:12]}"


def _journal(optuna, file: Path):
    """The journal's storage; the last line is dropped where a kill tore it. The lock of the study's folder keeps other
    writers away, so that the journal needs none, which would outlive a kill."""
    from optuna.storages import journal

    class SoleWriter:
        def acquire(self) -> bool:
            return True

        def release(self) -> None:
            pass

    if file.exists():
        whole = file.read_bytes()
        end = whole.rfind(b"\n") + 1
        if end < len(whole):
            file.write_bytes(whole[:end])
    return optuna.storages.JournalStorage(journal.JournalFileBackend(str(file), lock_obj=SoleWriter()))
