"""Do two checkouts compute the same, bit for bit? `python -m cases.bench.identity --against DIR [NAME ...]`.

Each scene runs for a few hundred steps on one thread by `python -m fsi run`, once with this checkout and once with the
other, and every time series of the two run folders is compared. A change of structure must leave all of them as they were.
With `--ranks 1,2,3,4,8` runs on ranks are compared with runs in one process instead (`cases.bench.rank_trials`).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cases
from cases.bench.trial_scenes import CHANNEL, LAYERS, SEA, differences
from fsi.record.dataset import load_run

HERE = Path(cases.__file__).parents[1]


@dataclass(frozen=True)
class Trial:
    """A scene (a built-in name or the text of a file), its settings and how long it runs [s]."""

    scene: str
    until: float
    settings: tuple[str, ...] = ()


TRIALS = {
    "dam_break": Trial("dam_break", 0.3),
    "dam_converged": Trial(
        "dam_break", 0.05, ("numerics.solver=converged", "numerics.precision=double", "spacing=0.04")
    ),
    "flap": Trial("flap", 0.6, ("output.series=0.02", "spacing=0.04")),
    "flap_fixed_point": Trial("flap", 0.2, ("coupler.scheme=fixed_point", "spacing=0.05", "tank.min=[0.0, -0.7]")),
    "floating_box": Trial("floating_box", 0.1, ("spacing=0.05",)),
    "floating_box_2d": Trial("floating_box_2d", 0.5),
    "slide_contact": Trial("slide_submarine_contact", 0.3),
    "sand_column": Trial("sand_column", 0.1, ("spacing=0.04",)),
    "irregular_sea": Trial(SEA, 3.0),
    "two_liquids": Trial(LAYERS, 0.4),
    "periodic_channel": Trial(CHANNEL, 5.0),
    "tank_still_3d": Trial("tank_still", 0.4, ("spacing=0.1",)),
}


def series(trial: Trial, checkout: Path, folder: Path, name: str):
    """The dataset of a trial, run with the code of a checkout."""
    scene = trial.scene
    if "\n" in scene:
        scene = str(folder / f"{name}.toml")
        Path(scene).write_text(trial.scene)
    command = [sys.executable, "-m", "fsi", "run", scene, "--until", str(trial.until), "--threads", "1", "--quiet"]
    command += ["--out", str(folder / name)]
    for setting in (*trial.settings, "output.timeline=false"):
        command += ["--set", setting]
    done = subprocess.run(
        command, cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)}, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"{name} with {checkout}: {done.stderr.strip()}")
    return load_run(folder / name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=Path, help="the other checkout")
    parser.add_argument("--ranks", metavar="N,N,...", help="numbers of ranks, to be compared with one process")
    parser.add_argument("--share", type=float, default=1.0, help="of its time that each trial on ranks runs")
    parser.add_argument("names", nargs="*", help=f"of {', '.join(TRIALS)}; all if none")
    options = parser.parse_args()
    if options.ranks:
        from cases.bench.rank_trials import report

        sys.exit(1 if report(options.names, [int(n) for n in options.ranks.split(",")], options.share) else 0)
    if options.against is None:
        parser.error("--against DIR or --ranks N,N,... is needed")
    other, bad = options.against.resolve(), 0
    with tempfile.TemporaryDirectory() as folder:
        for name in options.names or TRIALS:
            for side in ("here", "there"):
                Path(folder, side).mkdir(exist_ok=True)
            here = series(TRIALS[name], HERE, Path(folder, "here"), name)
            there = series(TRIALS[name], other, Path(folder, "there"), name)
            wrong = differences(here, there)
            bad += bool(wrong)
            verdict = f"DIFFERENT: {', '.join(wrong)}" if wrong else "identical"
            print(f"{name:18} {here.sizes['time']:5} frames, {len(here.data_vars):3} series  {verdict}", flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
