"""All fuzzed inputs through `fsi check`, some of the accepted for some steps: `python -m tests.fuzz`."""

from __future__ import annotations

import argparse
import time
from collections import Counter

from tests.fuzz.pool import Worker


def main() -> None:
    """Exit code 1 where an input broke something or was answered late."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--mjcfs", type=int, default=300)
    parser.add_argument("--runs", type=int, default=60, help="accepted inputs to run for 20 steps")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--slow", type=float, default=10.0, help="[s] of processor time that an answer may take")
    arguments = parser.parse_args()
    worker, total, left, bad, longest = Worker(), Counter(), arguments.runs, 0, 0.0
    began = time.perf_counter()
    most = arguments.runs - arguments.runs // 4  # fewer body files than scenes are accepted
    for kind, count in (("scene", arguments.scenes), ("mjcf", arguments.mjcfs)):
        share = most if kind == "scene" else left
        for number in range(arguments.first, arguments.first + count):
            answer = worker.answer(kind, number, arguments.seed, runs=share > 0)
            state = answer["state"]
            total[f"{kind} {state}"] += 1
            longest = max(longest, answer["seconds"])
            if state == "broken" or answer["seconds"] > arguments.slow:
                bad += 1
                print(f"{kind} {number}: {state}, {answer['seconds']:.1f} s: {answer['text']}", flush=True)
            if "run" in answer:
                share, left = share - 1, left - 1
                total[f"run {answer['run']}"] += 1
                if answer["run"] != "calm":
                    bad += answer["run"] == "broken"
                    print(f"{kind} {number}: run: {answer['run']}: {answer['why']}", flush=True)
    worker.close()
    print(f"{dict(sorted(total.items()))}; longest check {longest:.1f} s; {time.perf_counter() - began:.0f} s")
    raise SystemExit(1 if bad else 0)


if __name__ == "__main__":
    main()
