"""Does a run survive what a cluster, a laptop or a colleague does to it? `python -m cases.torture [NAME ...]`.

Each of six scenes runs once undisturbed. Then its runs are killed at random instants, lose their streams or the room on
their disk, get their logs damaged and their folders claimed by others. After each mishap what was logged must be readable
and the same as in the undisturbed run, up to 2 s of wall time before a SIGKILL; runs that were hit are resumed until they
are done, and `run.mcap` and `run.rrd` must then be those of the undisturbed run, byte for byte. `--long N` looks at memory
and time per step over N steps instead. Exit code 1 where anything was lost.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from rich.console import Console
from rich.table import Column, Table

from cases.torture.kills import kills
from cases.torture.long import long, long_recording
from cases.torture.mishaps import checkpoints, cost, damage, full_disk, locks, strangers, streams, without_log
from cases.torture.trial import SCENES, Score, subject


def main() -> None:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="python -m cases.torture", description=__doc__, formatter_class=raw)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SCENES)}; all if none")
    parser.add_argument("--kills", type=int, default=60, help="kills and signals in all")
    parser.add_argument("--others", type=int, help="tries of each other test in all; a fifth of the kills if not given")
    parser.add_argument(
        "--damages", type=int, help="damaged logs in all, which cost little; as many as kills if not given"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the random instants")
    parser.add_argument("--long", type=int, metavar="N", help="memory and time per step over N steps, and nothing else")
    parser.add_argument(
        "--recording", action="store_true", help="with --long: steps that are recorded and not computed"
    )
    options = parser.parse_args()
    if options.long:
        sys.exit("\n".join((long_recording if options.recording else long)(options.long)) or 0)
    names, dice = options.names or list(SCENES), random.Random(options.seed)
    if odd := set(names) - SCENES.keys():
        parser.error(f"no scene {min(odd)!r}; there are {', '.join(SCENES)}")
    others = options.kills // 5 if options.others is None else options.others
    damages = options.kills if options.damages is None else options.damages
    total: dict[str, Score] = {}
    with tempfile.TemporaryDirectory() as folder, suppress(KeyboardInterrupt):  # the table so far
        for n, name in enumerate(names):
            share = [
                count * (n + 1) // len(names) - count * n // len(names) for count in (options.kills, others, damages)
            ]
            for score in _all_tests(name, Path(folder), share, dice):
                total.setdefault(score.test, Score(score.test)).add(score)
            _print(total)
    sys.exit(any(score.lost for score in total.values()))


def _all_tests(name: str, folder: Path, share: list[int], dice: random.Random) -> list[Score]:
    began = time.perf_counter()
    it = subject(name, folder)
    count, few, many = share
    scores = [
        *kills(it, count, dice),
        streams(it, few, dice),
        full_disk(it, few, dice),
        locks(it, few, dice),
        without_log(it, few, dice),
        damage(it, many, dice),
        checkpoints(it, many, dice),
        strangers(it, few, dice),
        cost(it),
    ]
    tries, lost = sum(s.tries for s in scores), sum(len(s.lost) for s in scores)
    said = f"{name}: a run takes {it.seconds:.1f} s; {tries} tries, {lost} lost, in {time.perf_counter() - began:.0f} s"
    print(said, file=sys.stderr, flush=True)
    return scores


def _print(total: dict[str, Score]) -> None:
    figures = (Column(name, justify="right") for name in ("tries", "survived", "lost"))
    table = Table("test", *figures, "besides")
    for score in total.values():
        table.add_row(
            score.test, str(score.tries), str(score.survived), str(score.tries - score.survived), score.remark
        )
    console = Console()
    console.width = max(console.width, 120)
    console.print(table)
    for score in total.values():
        print(*score.lost, sep="\n", end="\n" if score.lost else "")


if __name__ == "__main__":
    main()
