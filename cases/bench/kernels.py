"""What each compiled kernel costs, and whether another checkout computes the same: `python -m cases.bench.kernels`.

A few scenes run for a moment, each kernel's call is kept with its arguments and then repeated on them alone. With `--against
DIR` a process with the code of each checkout does so, the two take turns kernel by kernel, and what a call changes in its
arguments is compared bit for bit; the signs of zeros alone are told apart from what differs.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import importlib
import importlib.util
import io
import os
import runpy
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fsi.strict_json import dumps, loads

HERE = Path(__file__).resolve().parents[2]
KEPT = (1, 2, 5, 12, 30, 80)  # of a kernel's calls; the last of these stands
UNORDERED = ("search",)  # writes into memory that holds anything: not compared
TURN = 0.02  # seconds that a kernel is repeated for, before it is the other checkout's turn
MOMENT = {  # simulated seconds of the scenes of `cases.bench.identity` (the text of a scene is kept there)
    "dam_break": 0.03, "dam_converged": 0.005, "flap": 0.06, "floating_box": 0.02, "slide_contact": 0.05,
    "sand_column": 0.02, "irregular_sea": 0.1, "two_liquids": 0.05, "periodic_channel": 0.2, "tank_still_3d": 0.05,
}  # fmt: skip
VISCOUS_BODY = ("flap", ("fluid.kinematic_viscosity=1e-2", "numerics.viscous_step=implicit", "spacing=0.05"), 0.05)
DENSE_IMPLICIT = ("two_liquids", ("numerics.viscous_step=implicit",), 0.02)


# ------------------------------------------------------------------------------------- one checkout, in its own process


def _twin(value):
    """A copy with the same layout in memory, so that it is the same type to a compiled kernel."""
    if isinstance(value, np.ndarray) and not value.flags.c_contiguous:
        wide = np.empty((*value.shape[:-1], value.shape[-1] + 1), value.dtype)
        wide[..., :-1] = value
        return wide[..., :-1]
    return copy.deepcopy(value)


def _arrays(args) -> list[np.ndarray]:
    flat = [a for arg in args for a in (arg if isinstance(arg, tuple) else (arg,))]
    return [a for a in flat if isinstance(a, np.ndarray)]


class Calls:
    """The kernels that a run calls, by name, each with the arguments of one call as they were before it."""

    def __init__(self, command: list[str]):
        self.kept, self._count = {}, Counter()
        module = "fsi.compute.team" if importlib.util.find_spec("fsi.compute") else "fsi.threads"
        Team = importlib.import_module(module).Team
        plain = Team.run

        def run(team, kernel, bounds, *args):
            key = kernel.__name__.strip("_"), kernel
            self._count[key] += 1
            if self._count[key] in KEPT:
                self.kept[key] = self._copy((bounds, *args))
            plain(team, kernel, bounds, *args)

        Team.run = run
        try:
            sys.argv = ["fsi", *command]
            with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
                runpy.run_module("fsi", run_name="__main__")
        finally:
            Team.run = plain
        numbers = Counter()
        self.named = {}
        for (name, kernel), args in self.kept.items():
            numbers[name] += 1
            self.named[f"{name} {numbers[name]}" if numbers[name] > 1 else name] = kernel, args

    @staticmethod
    def _copy(args):
        """Copies in which what was one array still is one."""
        known = {}
        one = lambda a: known.setdefault(id(a), _twin(a)) if isinstance(a, np.ndarray) else a  # noqa: E731
        return tuple(tuple(one(x) for x in a) if type(a) is tuple else one(a) for a in args)

    def measure(self, name: str, seconds: float, file: str) -> dict:
        """Best nanoseconds per particle of the kernel over so many seconds; its arrays before and after into the file."""
        kernel, args = self.named[name]
        chunks, best, spent = args[0], np.inf, 0.0
        while spent < seconds:
            fresh = self._copy(args)
            counter = np.zeros(1, np.int64)
            start = time.perf_counter()
            kernel(counter, *fresh)
            taken = time.perf_counter() - start
            if not spent:
                np.savez(file, *_arrays(args), *_arrays(fresh))
            best, spent = min(best, taken), spent + taken
        return {"ns": 1e9 * best / max(1, int(chunks[-1] - chunks[0])), "particles": int(chunks[-1])}


def verdict(one: list[np.ndarray], two: list[np.ndarray]) -> str:
    """Of two calls, each given by its arrays before and those after: "same bits" where all numbers that either call changed
    end up the same, "same values" where they differ in the signs of zeros, else "DIFFERENT"."""
    half, found = len(one) // 2, "same bits"
    if [(a.shape, a.dtype) for a in one] != [(b.shape, b.dtype) for b in two]:
        return "DIFFERENT"
    for n in range(half):
        before, after = (one[n], two[n]), (one[half + n], two[half + n])
        changed = np.logical_or(*(_bits(a) != _bits(b) for a, b in zip(before, after, strict=True)))
        if not np.array_equal(*(_bits(a)[changed] for a in after)):
            if not np.array_equal(*(a.ravel()[changed] for a in after)):
                return "DIFFERENT"
            found = "same values"
    return found


def _bits(a: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(a).ravel().view(f"u{a.itemsize}")


def serve() -> None:
    """Answer requests, one a line: the command of a run, or a kernel of that run, seconds and a file for its arrays."""
    answers, calls = sys.stdout, None
    for line in sys.stdin:
        request = loads(line)
        if "run" in request:
            calls = Calls(request["run"])
            answer = list(calls.named)
        else:
            answer = calls.measure(**request)
        print(dumps(answer), file=answers, flush=True)


# ------------------------------------------------------------------------------------- one or two of them, in turns


class Checkout:
    """A process that runs the code of a checkout."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve()), "--serve"], cwd=folder, text=True,
            env=os.environ | {"PYTHONPATH": str(folder)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def ask(self, **request):
        print(dumps(request), file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError(f"{self.folder}: the process ended with {self._process.wait()}")
        return loads(answer)

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait()


def _commands(names: list[str], folder: Path) -> dict[str, list[str]]:
    """The command of each trial's run, without the folder of its output."""
    from cases.bench.identity import TRIALS

    trials = {n: (n, (), until) for n, until in MOMENT.items()}
    trials |= {"viscous_body": VISCOUS_BODY, "dense_implicit": DENSE_IMPLICIT}
    commands = {}
    for name in names or trials:
        base, settings, until = trials[name]
        scene = TRIALS[base].scene
        if "\n" in scene:
            Path(folder, f"{base}.toml").write_text(scene)
            scene = str(folder / f"{base}.toml")
        command = ["run", scene, "--until", str(until), "--threads", "1", "--quiet"]
        for setting in (*TRIALS[base].settings, *settings, "output.timeline=false"):
            command += ["--set", setting]
        commands[name] = command
    return commands


def compare(folders: list[Path], names: list[str], rounds: int) -> Iterator[dict]:
    """A row for each kernel of each trial: ns per particle with each checkout, and the `verdict` on the last of them."""
    with tempfile.TemporaryDirectory() as scratch, contextlib.ExitStack() as stack:
        checkouts = [stack.enter_context(contextlib.closing(Checkout(folder))) for folder in folders]
        for trial, command in _commands(names, Path(scratch)).items():
            kernels = [c.ask(run=[*command, "--out", f"{scratch}/{trial}{n}"]) for n, c in enumerate(checkouts)]
            for kernel in kernels[0]:
                if any(kernel not in other for other in kernels):
                    yield {"trial": trial, "kernel": kernel, "ns": [np.nan], "verdict": "MISSING", "particles": 0}
                    continue
                best, files = [np.inf] * len(checkouts), [f"{scratch}/{n}.npz" for n in range(len(checkouts))]
                for _ in range(rounds):
                    for n, checkout in enumerate(checkouts):
                        found = checkout.ask(name=kernel, seconds=TURN, file=files[n])
                        best[n] = min(best[n], found["ns"])
                arrays = [list(np.load(file).values()) for file in files]
                judged = "unordered" if kernel in UNORDERED else verdict(arrays[0], arrays[-1])
                yield {
                    "trial": trial, "kernel": kernel, "ns": best, "verdict": judged, "particles": found["particles"],
                }  # fmt: skip


def kernel_costs(names: list[str], rounds: int) -> list[dict]:
    """ns per particle of each kernel of this checkout, in the scenes of these trials."""
    return [row | {"ns": row["ns"][0]} for row in compare([HERE], names, rounds)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=Path, help="another checkout")
    parser.add_argument("--rounds", type=int, default=10, help="turns of each kernel")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("names", nargs="*", help="of the trials; all if none")
    options = parser.parse_args()
    if options.serve:
        return serve()
    folders = [HERE] if options.against is None else [HERE, options.against.resolve()]
    bad = 0
    print(f"{'trial':18} {'kernel':14} {'particles':>9} {'ns each':>9}" + ("    there   ratio" * (len(folders) - 1)))
    for row in compare(folders, options.names, options.rounds):
        line = f"{row['trial']:18} {row['kernel']:14} {row['particles']:9} " + " ".join(
            f"{ns:9.2f}" for ns in row["ns"]
        )
        if len(folders) > 1:
            line += f"  {row['ns'][0] / row['ns'][-1]:6.3f}  {row['verdict']}"
            bad += row["verdict"] in ("DIFFERENT", "MISSING")
        print(line, flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
