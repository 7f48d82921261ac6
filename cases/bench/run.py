"""The whole benchmark: what is measured in which order, and where the report goes."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import cases
from cases.bench import speed
from cases.bench.ablation import ablation
from cases.bench.child import start_up
from cases.bench.determinism import determinism
from cases.bench.equal_error import TRIALS, equal_error
from cases.bench.flume import flap_cost
from cases.bench.kernels import kernel_costs
from cases.bench.limits import limits
from cases.bench.memory import memory
from cases.bench.report import led_by, markdown, tables
from cases.bench.targets import verdicts
from cases.bench.unordered import cost_of_order
from cases.bench.users import SCENES, users
from fsi.compute.team import available_threads
from fsi.errors import SceneError
from fsi.extras import require

LANES = {"single": 8, "double": 4}  # of 256 bits; `limits` tries twice as many too
PACKAGES = ("spindrift", "numba", "llvmlite", "numpy", "mujoco", "rerun-sdk")


@dataclass(frozen=True)
class Plan:
    """How much is measured. sizes: case -> (dimension, particles); visit: seconds a block is stepped for at a time."""

    sizes: dict[str, tuple[int, int]]
    rounds: int
    visit: float
    flat: tuple[tuple[int, ...], ...]  # sizes, in groups that are measured in turns
    still: int  # fluid particles of the tank whose memory is counted
    spacing: float  # of the flume [m]
    steps: int  # of a visit to a flume: some frames of the timeline
    fresh: bool  # whether to start processes with an empty numba cache
    judged: bool  # whether the figures may be held against the targets
    check: int  # particles of the block that shows determinism
    kernels: tuple[str, ...]  # the trials of `cases.bench.kernels`
    peak: float  # seconds of a measurement of a limit
    megabytes: int  # of an array of the triad
    scenes: tuple[str, ...] = ()  # that users run
    errors: tuple[str, ...] = ()  # the trials of `cases.bench.equal_error`


FULL = Plan(
    {"2D 80k": (2, 80_000), "3D 300k": (3, 300_000), "3D 1M": (3, 1_000_000)}, rounds=3, visit=0.3,
    flat=((10_000, 30_000, 100_000, 300_000, 1_000_000),), still=300_000, spacing=0.02, steps=120, fresh=True,
    judged=True, check=30_000, kernels=("flap", "floating_box", "sand_column"), peak=0.1, megabytes=256, scenes=SCENES,
    errors=tuple(TRIALS),
)  # fmt: skip
QUICK = Plan(
    {"3D 3k": (3, 3_000)}, rounds=1, visit=0.05, flat=((1_000, 8_000),), still=1_000, spacing=0.05, steps=4, fresh=False,
    judged=False, check=1_000, kernels=(), peak=0.01, megabytes=16,
)  # fmt: skip
LARGE = ((3_000_000,), (10_000_000,), (20_000_000,))


@dataclass(frozen=True)
class Bench:
    """The results, and the file of the report, if it was written."""

    result: dict
    report: Path | None

    def tables(self) -> list:
        """What a rich console prints."""
        return [table.rich() for table in tables(self.result)]


def bench(
    *,
    quick: bool = False,
    large: bool = False,
    only_users: bool = False,
    against: str | Path | None = None,
    out: str | Path | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Bench:
    """Measure everything and write the report to `out`; without it to BENCHMARK.md in the root of the project, or in the
    working directory where the project is installed without its sources. `quick` is a trial on tiny sizes, whose figures
    mean nothing: it is written only where `out` says so. `large` adds sizes of up to 2e7 particles.
    `only_users` leaves it at what users run and at the time to equal error, and replaces those two in the report; `against` is
    another checkout, whose scenes are stepped in turns with those of this one.

    Raises SceneError where the report cannot be written."""
    for package in ("mujoco", "trimesh"):
        require(package, "bodies", "fsi bench")
    require("rerun", "viewer", "fsi bench")
    plan = QUICK if quick else FULL
    plan = replace(plan, flat=plan.flat + LARGE) if large else plan
    if only_users:
        result = {"machine": machine(1)} | _of_users(plan, against, say)
    else:
        result = run_plan(plan, available_threads(), say, against)
    report = Path(out).expanduser() if out else None if quick else _default_report()
    if report:
        try:
            report.write_text(led_by(report, result) if only_users else markdown(result), encoding="utf-8")
        except OSError as fault:
            raise SceneError(
                f"{report} cannot be written: {fault.strerror}", key="--out", fix="choose another"
            ) from None
    return Bench(result, report)


def _of_users(plan: Plan, against: str | Path | None, say: Callable[[str], None]) -> dict:
    """What users run, and the time to equal error."""
    say("what users run ...")
    rows = users(plan.scenes, plan.rounds, 2.0, Path(against) if against else None)
    say("time to equal error ...")
    return {"users": rows, "equal_error": equal_error({name: TRIALS[name] for name in plan.errors})}


def run_plan(plan: Plan, threads: int, say: Callable[[str], None], against: str | Path | None = None) -> dict:
    """All results of a plan, as plain rows by section."""
    result = {"machine": machine(threads)} | _of_users(plan, against, say)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        say("limits of the machine ...")
        result["limits"] = limits(threads, LANES, plan.peak, plan.megabytes)
        say("speed of the plain fluid ...")
        result["speed"], result["phases"] = speed.speeds(plan.sizes, threads, plan.rounds, plan.visit)
        result["ratios"] = speed.ratios(result["speed"], result["phases"])
        result["roofline"] = speed.rooflines(result["speed"], result["phases"], result["limits"])
        result["flatness"] = speed.flatness(3, plan.flat, plan.rounds, plan.visit)
        say("memory and determinism ...")
        result["memory"] = memory(3, plan.still)
        result["determinism"] = determinism(threads, 3, plan.check)
        result["order"] = cost_of_order(plan.check, 4 * plan.rounds)
        say("the flap, with bodies and logging ...")
        result["flap"] = flap_cost(folder / "flap", threads, plan.spacing, plan.steps, plan.rounds)
        say("what each kernel costs ...")
        result["kernels"] = kernel_costs(list(plan.kernels), 2 * plan.rounds) if plan.kernels else []
        say("what each term costs ...")
        result["ablation"] = ablation(folder / "terms", plan.spacing, plan.steps // 2, 2 * plan.rounds, plan.fresh)
        say("start-up ...")
        result["start"] = start_up(folder / "start") if plan.fresh else []
    result["machine"]["load_at_the_end"] = load()
    result["targets"] = verdicts(result) if plan.judged else []
    return result


def machine(threads: int) -> dict:
    """The machine, the software, the date, and how busy the machine is."""
    try:
        info = Path("/proc/cpuinfo").read_text()
        processor = next(s.partition(":")[2].strip() for s in info.splitlines() if s.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor() or platform.machine()
    software = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return {
        "date": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        "processor": f"{processor}, {os.cpu_count()} cores, {threads} threads used at most",
        "versions": f"Python {platform.python_version()}, {software}",
        "load_before": load(),
    }


def load() -> str:
    """Processes that want a processor, averaged over a minute; what exceeds the benchmark's own disturbs it."""
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def _default_report() -> Path:
    root = Path(cases.__file__).parents[1]
    return root / "BENCHMARK.md" if (root / "pyproject.toml").is_file() else Path("BENCHMARK.md")
