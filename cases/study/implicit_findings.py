"""The four parameter studies of implicit ISPH beside what their source found (Sampath et al. 2016, sections 7 and 8).

`python -m cases.study.implicit_findings [FOLDER]` runs examples/studies/implicit_*.toml with the scheme of the source, prints
their tables and findings, and exits 1 where one differs from what is written down here: a finding that no longer holds, or
one that was known not to and does. Work is counted in sweeps, which no other load of the machine changes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cases

STUDIES = Path("examples/studies")  # from the folder of the project
GROWTH = 1.6, 2.0  # of the work per halving of xi; 1.78 in the source
FLAT = 1.2  # largest over smallest of what is called flat


@dataclass(frozen=True)
class Finding:
    """What a study is asked: values of its parameter and its figures -> whether the source's finding holds, and in words.

    study: name of its file; figures: those that are printed; known: whether it holds here, as measured."""

    study: str
    claim: str
    figures: tuple[str, ...]
    judge: Callable[[np.ndarray, dict[str, np.ndarray]], tuple[bool, str]]
    known: bool = True


def optimum(values: np.ndarray, figures: dict[str, np.ndarray]) -> tuple[bool, str]:
    """The run takes the least time inside the range; runs that failed are nan."""
    seconds = np.where(np.isfinite(figures["wall_seconds"]), figures["wall_seconds"], np.inf)
    best = int(np.argmin(seconds))
    return bool(0 < best < len(values) - 1), f"fastest at {values[best]:g}, {seconds[best]:.3g} s"


def growth(values: np.ndarray, figures: dict[str, np.ndarray]) -> tuple[bool, str]:
    """Sweeps grow by so much per halving of the tolerance, in the mean."""
    work = figures["pressure_iterations"] / figures["time_step_mean"]
    each = (work[-1] / work[0]) ** (1 / np.log2(values[0] / values[-1]))
    return bool(GROWTH[0] <= each <= GROWTH[1]), f"times {each:.2f} per halving"


def flat(name: str) -> Callable[[np.ndarray, dict[str, np.ndarray]], tuple[bool, str]]:
    """The figure of this name changes by no more than `FLAT` over the range."""

    def judge(values: np.ndarray, figures: dict[str, np.ndarray]) -> tuple[bool, str]:
        ratio = float(figures[name].max() / figures[name].min())
        return ratio <= FLAT, f"largest over smallest {ratio:.2f}"

    return judge


def level(values: np.ndarray, figures: dict[str, np.ndarray]) -> tuple[bool, str]:
    """The largest domain takes no more memory than the smallest."""
    memory = figures["memory_mb"]
    return bool(
        memory[-1] <= FLAT * memory[0]
    ), f"{memory[-1]:.3g} MB in the largest, {memory[0]:.3g} MB in the smallest"


COST = "pressure_iterations", "pressure_seconds", "search_seconds", "wall_seconds"
FINDINGS = (
    Finding("step", "run time has an optimum of lambda_max", COST, optimum),
    Finding("tolerance", "pressure work grows by 1.6 to 2.0 per halving of xi", COST, growth),
    Finding("spacing", "iterations are flat over the spacing", COST, flat("pressure_iterations"), known=False),
    Finding("space", "memory is flat over the empty space", ("search_seconds", "memory_mb"), level),
)
NO_TABLE = "search time over the size of the hash table: there is no table; cells are found in the order of the sort"


def judged(finding: Finding, folder: Path) -> tuple[bool, list[str]]:
    """Whether a finding holds, and its table and verdict, line by line. The study is in `folder`, or is run there."""
    data = cases.sweep(STUDIES / f"implicit_{finding.study}.toml", out=folder / finding.study, workers=0, quiet=True)
    parameter = next(iter(data.dims))
    values = data[parameter].values.astype(float)
    figures = {
        name: data[name].values for name in {*finding.figures, "pressure_iterations", "time_step_mean", "memory_mb"}
    }
    lines = [" ".join(f"{name:>20}" for name in (parameter, *finding.figures))]
    for n, value in enumerate(values):
        lines.append(" ".join(f"{x:20.4g}" for x in (value, *(figures[name][n] for name in finding.figures))))
    holds, words = finding.judge(values, figures)
    verdict = ("holds" if holds else "MISSED") + (", as known" if not finding.known and not holds else "")
    return holds, [*lines, f"{finding.claim}: {verdict}, {words}", ""]


def main(folder: Path) -> int:
    """Print all findings; 1 where one is not as known. SystemExit where the studies are not there."""
    if not STUDIES.is_dir():
        raise SystemExit(f"no folder {STUDIES} here; run this in the folder of the project")
    status = 0
    for finding in FINDINGS:
        holds, lines = judged(finding, folder)
        print("\n".join(lines), flush=True)
        status |= holds != finding.known
    print(NO_TABLE)
    return int(status)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "studies/implicit")))
