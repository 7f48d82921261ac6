"""The points of a study that are known before it starts: a grid, a list, a Latin hypercube."""

from __future__ import annotations

from itertools import product

from cases.study.plan import Study, Value
from fsi.extras import require

Point = dict[str, Value]


def points(study: Study) -> list[Point]:
    """Parameter name -> value, point by point; a grid runs through its last parameter first."""
    names, method = list(study.parameters), study.sampling.method
    if method == "list":
        return [{name: point[name] for name in names} for point in study.sampling.points]
    if method == "latin_hypercube":
        return hypercube(study, study.sampling.samples)
    return [dict(zip(names, values, strict=True)) for values in product(*(p.grid() for p in study.parameters.values()))]


def hypercube(study: Study, count: int) -> list[Point]:
    """A Latin hypercube of so many points, its discrepancy lowered by exchanges (scipy.stats.qmc)."""
    qmc = require("scipy.stats.qmc", "study", "a Latin hypercube")
    sampler = qmc.LatinHypercube(d=len(study.parameters), rng=study.sampling.seed, optimization="random-cd")
    return [
        {name: p.at(float(x)) for (name, p), x in zip(study.parameters.items(), row, strict=True)}
        for row in sampler.random(count)
    ]
