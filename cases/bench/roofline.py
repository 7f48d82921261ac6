"""How close each sweep comes to what the machine can do at most, and what binds it.

Operations of a pair, counted from `fsi.sph.terms` with D the dimension. Additions, multiplications, roots and quotients are one
each; comparisons and constant factors that belong outside the loop are none. An entry of a list is processed for all
lanes of its group, also where a pair is out of reach: `processed` counts all lanes, `useful` only pairs inside the support.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Cost:
    """Of a sweep: operations of a pair, those among them that are roots and quotients, and the numbers a particle that
    must come from or go to memory besides the list, in the precision of the sweeps and in double precision."""

    flops: int
    roots: int
    quotients: int
    reals: int
    doubles: int


def costs(dimension: int) -> dict[str, Cost]:
    """Costs of the sweeps of a laminar fluid, by phase."""
    D = dimension
    row = 8 if D == 3 else 4
    distance = D + (2 * D - 1)  # x_ij, r2
    slope = 3 + 2  # root, product and difference of `closeness`; t t t
    weight = 3  # f r2 / (r2 + eta2)
    pull = weight + 2  # times p_j, added up
    coefficients = 5 + 3  # `kernel`; weight, density and f r2 added up
    viscous = 3 * D  # u_ij, times the weight, added up
    outflow = D + (2 * D - 1) + 2  # u_ij . x_ij, times f, added up
    gradient = 2 + 2 * D  # f (p_i + p_j), times x_ij, added up
    return {
        "predictor": Cost(distance + slope + weight + coefficients + viscous, 1, 1, row + D + 3, 2 * D),
        "first sweep": Cost(distance + slope + outflow + pull, 1, 1, (8 if D == 3 else 6) + 5, 0),
        "further sweeps": Cost(distance + slope + pull, 1, 1, (D + 1) + 4, 0),
        "corrector": Cost(distance + slope + gradient, 1, 0, D + (D + 1) + 2, 4 * D),
    }


def machine_peak(limits: dict, precision: str) -> dict[str, float]:
    """Largest rates of one thread in this precision, over the widths that were tried, and the bandwidth."""
    rows = [row for row in limits["rates"] if row["precision"] == precision and row["threads"] == 1]
    peak = {name: max(row[name] for row in rows) for name in ("flops_per_s", "roots_per_s", "quotients_per_s")}
    memory = next(row for row in limits["bandwidth"] if row["threads"] == 1)
    return peak | {"bytes_per_s": memory["bytes_per_s"]}


def roofline(phases: dict[str, float], passes: dict[str, int], peak: dict[str, float], fluid: dict) -> list[dict]:
    """A row for each sweep and one for all of them. `phases`: ns per particle on one thread; `passes`: how often each
    runs in a step; `fluid`: dimension, lanes, number_bytes (of a number in the sweeps), neighbours, entries.

    The limits are the times [ns] that multiply-adds, roots, quotients and memory would take alone; the largest binds."""
    rows = []
    for name, cost in costs(fluid["dimension"]).items():
        if passes.get(name):
            time = phases[name] / passes[name]
            rows.append(_row(name, time, cost, peak, fluid) | {"passes": passes[name]})
    total = sum(row["ns"] * row["passes"] for row in rows)
    useful = sum(row["useful"] * row["ns"] * row["passes"] for row in rows) / total
    processed = sum(row["processed"] * row["ns"] * row["passes"] for row in rows) / total
    bound = sum(row["of_limit"] * row["ns"] * row["passes"] for row in rows) / total
    whole = {"sweep": "all", "passes": sum(row["passes"] for row in rows), "ns": total, "useful": useful}
    return [*rows, whole | {"processed": processed, "of_limit": bound}]


def _row(name: str, ns: float, cost: Cost, peak: dict[str, float], fluid: dict) -> dict:
    pairs = fluid["entries"] * fluid["lanes"]
    size = 4 * fluid["entries"] + cost.reals * fluid["number_bytes"] + 8 * cost.doubles
    limits = {
        "multiply-adds": 1e9 * pairs * cost.flops / peak["flops_per_s"],
        "roots": 1e9 * pairs * cost.roots / peak["roots_per_s"],
        "quotients": 1e9 * pairs * cost.quotients / peak["quotients_per_s"],
        "memory": 1e9 * size / peak["bytes_per_s"],
    }
    binds = max(limits, key=limits.get)
    achieved = 1e9 * cost.flops / (ns * peak["flops_per_s"])
    return {
        "sweep": name,
        "ns": ns,
        "flops_per_pair": cost.flops,
        "bytes_per_particle": size,
        **{f"{limit}_ns": value for limit, value in limits.items()},
        "binds": binds,
        "of_limit": limits[binds] / ns,
        "processed": achieved * pairs,
        "useful": achieved * (fluid["neighbours"] + 1),
    }
