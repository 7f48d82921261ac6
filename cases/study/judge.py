"""How good a design is: its objective, whether it keeps the constraints, and the best of a study."""

from __future__ import annotations

import json
import math

from cases.study.plan import Study
from cases.study.results import names_in_order, table
from cases.study.worker import Outcome
from fsi.errors import SceneError


def objective(study: Study, outcome: Outcome) -> float:
    """The objective of a run, nan where it failed. Raises SceneError where its figures do not hold it."""
    return _figure(outcome, study.objective.figure, "objective") if outcome.status == "done" else math.nan


def violations(study: Study, outcome: Outcome) -> dict[str, float]:
    """Constraint -> by how much a run breaks it; 0 or less keeps it."""
    return {key: b.excess(_figure(outcome, key, f"constraints.{key}")) for key, b in study.constraints.items()}


def _figure(outcome: Outcome, key: str, place: str) -> float:
    figures = outcome.figures or {}
    if key not in figures:
        fix = f"a run has {', '.join(figures)}"
        raise SceneError(f"no figure {key!r}", key=place, fix=fix)
    return float(figures[key][1])


def best_row(data) -> dict | None:
    """The best point of a study: its parameters, objective and figures; None without an objective or a run that keeps
    the constraints."""
    design = data.attrs["routine"] in ("", "damping_sweep")  # the points of other routines are seas, not designs
    key = data.attrs.get("objective") or ("mean_power" if "mean_power" in data and design else "")
    if not key:
        return None
    frame, sign = table(data), int(data.attrs.get("sense", 1))
    good = feasible(data, frame)
    if key not in frame or not good.any():
        return None
    place = (sign * frame[key].where(good)).idxmax()
    row = frame.loc[place]
    return {
        "parameters": {name: row[name] for name in names_in_order(data)},
        "objective": key,
        "value": float(row[key]),
        "run": row["run_hash"],
        "figures": row.to_dict(),
    }


def feasible(data, frame):
    """Which rows of a table are done and keep the constraints of the study, as booleans."""
    good = frame["status"] == "done"
    for key, limits in json.loads(data.attrs.get("constraints", "{}")).items():
        if key in frame:
            good &= frame[key] <= limits.get("max", math.inf)
            good &= frame[key] >= limits.get("min", -math.inf)
    return good
