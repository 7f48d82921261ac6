"""What the benchmark is held against: the targets, and what other codes reach on such a machine, quiet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cases.bench.speed import find

NEIGHBOURS = 113.0  # particles in the support of h = 1.5 dr in three dimensions: 4/3 pi 3^3

# (code, dimension, particles, neighbours, threads, million particle-steps/s); DualSPHysics on such a machine, quiet
YARDSTICKS = (
    ("DualSPHysics 5.4, dam break", 3, 171_496, 163, 1, 0.147),
    ("DualSPHysics 5.4, dam break", 3, 171_496, 163, 2, 0.281),
    ("DualSPHysics 5.4, dam break, compiled for the processor", 3, 171_496, 163, 1, 0.169),
    ("DualSPHysics 5.4, dam break, compiled for the processor", 3, 171_496, 163, 2, 0.311),
    ("DualSPHysics 5.4, dam break", 2, 21_001, 23, 1, 0.93),
    ("DualSPHysics 5.4, dam break", 2, 21_001, 23, 2, 1.72),
    ("PySPH WCSPH, double precision", 3, None, 79, 1, 0.08),
    ("SPlisHSPlasH WCSPH, single precision", 3, None, 28, 1, 0.35),
    ("SPlisHSPlasH DFSPH", 3, None, 28, 1, 0.21),
)
CPP_SPEED = YARDSTICKS[0][-1]  # the leading C++ code on one thread


@dataclass(frozen=True)
class Target:
    """A figure that is wanted: `measure` finds it in the results (None where it was not measured) and `profile` says in
    words where the time or the memory goes."""

    name: str
    unit: str
    sense: str
    value: float
    measure: Callable[[dict], float | None]
    profile: Callable[[dict], str]

    def met(self, figure: float) -> bool:
        return figure >= self.value if self.sense == ">=" else figure <= self.value


def verdicts(result: dict) -> list[dict]:
    """Each target that was measured, with its figure, whether it is met, and the profile."""
    rows = []
    for target in TARGETS:
        figure = target.measure(result)
        if figure is not None:
            row = {"target": target.name, "unit": target.unit, "wanted": f"{target.sense} {target.value:g}"}
            rows.append(row | {"measured": figure, "met": target.met(figure), "profile": target.profile(result)})
    return rows


def yardsticks(rows: list[dict]) -> list[dict]:
    """Other codes, and how many times as fast the first block of that dimension is here on as many threads, by
    particle-steps and by particle-steps times neighbours."""
    out = []
    for code, dimension, particles, neighbours, threads, speed in YARDSTICKS:
        row = {"code": code, "dimension": dimension, "particles": particles, "neighbours": neighbours}
        row |= {"threads": threads, "million_particle_steps_per_s": speed}
        ours = find(rows, dimension=dimension, threads=threads, precision="single", sweeps=1)
        if ours:
            ratio = 1e-6 * ours["particle_steps_per_s"] / speed
            row |= {"ratio": ratio, "ratio_with_neighbours": ratio * ours["neighbours"] / neighbours}
        out.append(row)
    return out


def value(key: str, name: str, factor: float = 1.0, **facts) -> Callable[[dict], float | None]:
    """Finds `name` in the row of result[key] with these facts."""

    def measure(result: dict) -> float | None:
        row = find([r for r in result[key] if r.get(name) is not None], **facts)
        return None if row is None else factor * row[name]

    return measure


def million_steps(case: str, precision: str) -> Callable[[dict], float | None]:
    """Million particle-steps/s on one thread with one sweep; in three dimensions, where particles at the faces of the
    block have fewer than NEIGHBOURS, as many as it would be at the same pairs a second with all of them."""

    def measure(result: dict) -> float | None:
        row = find(result["speed"], case=case, precision=precision, sweeps=1, threads=1)
        if row is None:
            return None
        fewer = min(1.0, (row["neighbours"] + 1) / NEIGHBOURS) if row["dimension"] == 3 else 1.0
        return 1e-6 * row["particle_steps_per_s"] * fewer

    return measure


def over_cpp(case: str) -> Callable[[dict], float | None]:
    """Particle-steps/s over those of the C++ code."""
    measure = million_steps(case, "single")
    return lambda result: None if measure(result) is None else measure(result) / CPP_SPEED


def in_words(parts: dict[str, float], unit: str) -> str:
    """The parts of a sum, the largest first."""
    shown = sorted(((size, name) for name, size in parts.items() if size >= 0.5), reverse=True)
    return ", ".join(f"{name} {size:.0f}" for size, name in shown) + f" {unit}"


def phases(case: str, precision: str = "single", sweeps: int = 1, threads: int = 1) -> Callable[[dict], str]:
    def profile(result: dict) -> str:
        row = find(result["phases"], case=case, precision=precision, sweeps=sweeps, threads=threads)
        return in_words(row["ns"], "ns per particle")

    return profile


def both_teams(case: str) -> Callable[[dict], str]:
    """Phases on one and on all threads, and what the machine itself gains from all of them at the time."""

    def profile(result: dict) -> str:
        rows = [r for r in result["phases"] if (r["case"], r["precision"], r["sweeps"]) == (case, "single", 1)]
        texts = [f"threads {row['threads']}: {in_words(row['ns'], 'ns per particle')}" for row in rows]
        one, many = result["limits"]["rates"][:2]
        gain = many["flops_per_s"] / one["flops_per_s"]
        return "; ".join(texts) + f"; multiply-adds of the machine at that time: {gain:.2f} x"

    return profile


def parts_of(numerics: str) -> Callable[[dict], str]:
    return lambda result: in_words(find(result["memory"], numerics=numerics)["parts"], "B per particle")


def flap_phases(result: dict) -> str:
    rows = [row for row in result["flap"] if row["threads"] == 1]
    return "; ".join(f"{row['run']}: {in_words(row['phases_ns'], 'ns per particle')}" for row in rows)


def logging_phases(result: dict) -> str:
    row = find(result["flap"], run="bodies and default logging", threads=1)
    return in_words(row["phases_ns"], "ns per particle, of wall time") + " (logging in the loop is `record`)"


def binding(case: str) -> Callable[[dict], str]:
    """What binds each sweep, and how close it comes to it."""

    def profile(result: dict) -> str:
        rows = [
            r for r in result["roofline"] if (r["case"], r["precision"]) == (case, "single") and r["sweep"] != "all"
        ]
        return ", ".join(f"{row['sweep']}: {row['binds']} ({100 * row['of_limit']:.0f} %)" for row in rows)

    return profile


def nothing(result: dict) -> str:
    return ""


def _speed_targets() -> list[Target]:
    out = []
    for case in ("3D 300k", "3D 1M"):
        steps, cpp, double = million_steps(case, "single"), over_cpp(case), million_steps(case, "double")
        more = value("ratios", "further_sweep_ns", case=case, precision="single")
        team = value("ratios", "speedup", case=case, precision="single", sweeps=1)
        where, four = phases(case), phases(case, sweeps=4)
        out += [
            Target(f"{case}, single, 1 thread", "million particle-steps/s", ">=", 1.3, steps, where),
            Target(f"{case}, single, 1 thread", "x the C++ code", ">=", 8.0, cpp, where),
            Target(f"{case}, all threads", "x one thread", ">=", 1.85, team, both_teams(case)),
            Target(f"{case}, each further pressure sweep", "ns per particle", "<=", 130.0, more, four),
            Target(f"{case}, double, 1 thread", "million particle-steps/s", ">=", 0.85, double, phases(case, "double")),
        ]
    flat = million_steps("2D 80k", "single")
    return [*out, Target("2D 80k, single, 1 thread", "million particle-steps/s", ">=", 4.0, flat, phases("2D 80k"))]


def _other_targets() -> list[Target]:
    size = lambda numerics: value("memory", "bytes_per_particle", numerics=numerics)  # noqa: E731
    flap = {"run": "bodies and default logging"}
    peak = value("roofline", "processed", 100.0, case="3D 300k", precision="single", sweep="all")
    start = lambda cache: value("start", "wall_s", cache=cache)  # noqa: E731
    viscous, plain = "single", "single, no viscosity"
    return [
        Target("memory, single, viscous", "B per particle", "<=", 400.0, size(viscous), parts_of(viscous)),
        Target("memory, single, no viscosity", "B per particle", "<=", 300.0, size(plain), parts_of(plain)),
        Target(
            "flap with bodies and default logging, 1 thread", "x the plain flume", ">=", 0.8,
            value("flap", "speed_over_plain", threads=1, **flap), flap_phases,
        ),
        Target(
            "logging of the flap", "% of wall time", "<", 3.0,
            value("flap", "logging_share_of_wall", 100.0, threads=1, **flap), logging_phases,
        ),
        Target("sweeps, 3D 300k, single", "% of vector peak", ">=", 35.0, peak, binding("3D 300k")),
        Target("fsi run dam_break to its first step, cold", "s", "<", 30.0, start("cold"), nothing),
        Target("fsi run dam_break to its first step, warm", "s", "<", 3.0, start("warm"), nothing),
    ]  # fmt: skip


TARGETS = (*_speed_targets(), *_other_targets())
