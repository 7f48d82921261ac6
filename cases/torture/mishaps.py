"""What happens to a run beside signals: its streams close, the disk is full, its log is damaged, its folder is wanted twice."""

from __future__ import annotations

import os
import random
import resource
import shutil
import sys
import threading
import time
from pathlib import Path

import numpy as np

from cases.torture.trial import (
    DONE,
    FAILED,
    REFUSED,
    Score,
    Subject,
    compare,
    fork,
    go,
    is_done,
    load,
    prefix_faults,
    wait,
)
from fsi.errors import SceneError
from fsi.record.manifest import read_manifest


def streams(subject: Subject, count: int, dice: random.Random) -> Score:
    """stdout and stderr close, fill up or lose their reader, before the run or within it: it is done as if nothing was."""
    score = Score("closed streams")
    for number in range(count):
        folder = subject.new("stream", number)
        which, how = dice.choice(((1,), (2,), (1, 2))), dice.choice(("closed", "full", "dead"))
        after = dice.choice((0.0, dice.uniform(0.0, subject.seconds)))
        code = wait(fork(lambda: _deaf(subject, folder, which, how, after)))  # noqa: B023 it is called at once
        faults = compare(folder, subject.whole) if is_done(folder) else ["not done"]
        faults = [fault for fault in faults if not fault.startswith("event")]  # the loss of messages is one
        score.book(f"{subject.name}, {how} {which}", faults + ([f"exit code {code}"] if code != DONE else []))
    return score


def _deaf(subject: Subject, folder: Path, which: tuple[int, ...], how: str, after: float) -> int:
    """The command `fsi run`, whose streams fail after a while."""

    def fail() -> None:
        time.sleep(after)
        for number in which:
            if how == "closed" and after == 0.0:
                os.close(number)
                setattr(sys, {1: "stdout", 2: "stderr"}[number], None)
                continue
            if how == "full":
                end = os.open("/dev/full", os.O_WRONLY)
            else:
                reader, end = os.pipe()
                os.close(reader)
            os.dup2(end, number)

    from fsi.command import main

    quiet = os.open(os.devnull, os.O_WRONLY)  # what it has to say is of no interest here
    os.dup2(quiet, 1), os.dup2(quiet, 2)
    fail() if after == 0.0 else threading.Thread(target=fail, daemon=True).start()
    sys.argv = ["fsi", "run", str(subject.file), "--out", str(folder), "--threads", "1"]
    main()
    return DONE


def full_disk(subject: Subject, count: int, dice: random.Random) -> Score:
    """No file may grow beyond a random size, which is how a full disk looks to one who writes: the run fails and says why, what
    it logged before is right, and it can be resumed, or run again, when there is room."""
    score = Score("full disk")
    largest = max(file.stat().st_size for file in subject.whole.glob("run.*"))
    reference = load(subject.whole)
    for number in range(count):
        folder = subject.new("full", number)
        limit = int(largest ** dice.uniform(0.5, 1.02))
        code = wait(fork(lambda: _within(limit, subject, folder)))  # noqa: B023
        faults = _after_full_disk(folder, code, reference)
        score.counts["of them resumed"] += any(folder.glob("checkpoints/*.checkpoint"))
        if not is_done(folder):
            code = wait(fork(lambda: go(subject.scene, folder)))  # noqa: B023
            faults += [f"exit code {code} when there was room again"] if code != DONE else []
        score.book(
            f"{subject.name}, {limit} bytes", faults + (compare(folder, subject.whole) if is_done(folder) else [])
        )
    return score


def _within(limit: int, subject: Subject, folder: Path) -> int:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    return go(subject.scene, folder)


def _after_full_disk(folder: Path, code: int | None, reference) -> list[str]:
    if code not in (DONE, FAILED, REFUSED):
        return [f"exit code {code}"]
    faults = [
        f"{file.name} is empty" for file in folder.glob("run.*") if not file.stat().st_size and file.suffix != ".lock"
    ]
    try:
        manifest = read_manifest(folder)
    except SceneError:
        return faults + (["no run.json after exit code 0"] if code == DONE else [])
    if (code == DONE) != (manifest["status"] == "done"):
        faults.append(f"exit code {code}, status {manifest['status']}")
    try:
        return faults + prefix_faults(folder, reference)
    except SceneError:
        return faults


def damage(subject: Subject, count: int, dice: random.Random) -> Score:
    """The log of a finished run is cut, or some of it is changed: what is read is right, and what is missing is said."""
    score = Score("damaged logs")
    folder, reference = subject.new("damage", 0), load(subject.whole)
    shutil.copytree(subject.whole, folder)
    data = (folder / "run.mcap").read_bytes()
    for _ in range(count):
        kind, at = dice.choice(("flipped bit", "cut", "zeros", "swapped")), dice.randrange(len(data))
        (folder / "run.mcap").write_bytes(_damaged(data, kind, at, dice))
        try:
            faults = _read(folder, reference)
        except SceneError:
            faults = []
            score.counts["refused as a whole"] += 1
        except Exception as fault:
            faults = [f"{type(fault).__name__}: {fault}"]
        score.book(f"{subject.name}, {kind} at {at}", faults)
    return score


def _damaged(data: bytes, kind: str, at: int, dice: random.Random) -> bytes:
    if kind == "cut":
        return data[:at]
    if kind == "flipped bit":
        return data[:at] + bytes([data[at] ^ 1 << dice.randrange(8)]) + data[at + 1 :]
    length = min(dice.choice((1, 16, 512, 4096)), len(data) - at)
    block = bytes(length) if kind == "zeros" else data[at : at + length][::-1]
    return data[:at] + block + data[at + length :]


def _read(folder: Path, reference) -> list[str]:
    """What is wrong with a damaged log as it is read: values that are others, frames that are missing without a word."""
    left = load(folder)
    known = reference.time.values
    times = left.time.values if "time" in left.coords else known[:0]
    if not np.isin(times, known).all():
        return ["frames that never were"]
    kept = reference.isel(time=np.searchsorted(known, times))
    faults = []
    for name, values in left.data_vars.items():
        if name.startswith("event") or name not in kept or "time" not in values.dims:
            continue
        ours, theirs = values.values, kept[name].values
        if ours.shape != theirs.shape or not ((ours == theirs) | np.isnan(ours)).all():
            faults.append(f"other values: {name}")
    gaps = [n for n in kept.data_vars if n in left and kept[n].dtype.kind == "f" and "time" in kept[n].dims]
    missing = len(times) < len(known) or any((np.isnan(left[n].values) & ~np.isnan(kept[n].values)).any() for n in gaps)
    if missing and left.attrs["log_complete"] and not left.attrs.get("damage"):
        faults.append(f"{len(known) - len(times)} frames are missing without a word")
    return faults


def locks(subject: Subject, count: int, dice: random.Random) -> Score:
    """A second process runs, resumes or recovers in the folder of a run that is going on: it is refused, and the run is as if
    nothing was."""
    score = Score("locked folders")
    for number in range(count):
        folder = subject.new("lock", number)
        second = dice.choice(("run", "resume", "recover"))
        one = fork(lambda: go(subject.scene, folder))  # noqa: B023
        time.sleep(dice.choice((0.0, dice.uniform(0.0, 0.8))) * subject.seconds)
        going_on = not is_done(folder)
        other = fork(lambda: _intrude(second, subject, folder))  # noqa: B023
        codes = wait(one), wait(other)
        faults = compare(folder, subject.whole) if is_done(folder) else ["not done"]
        allowed = [(DONE, REFUSED), (REFUSED, DONE)] if second == "run" else [(DONE, REFUSED)]
        if going_on and codes not in allowed and (second != "recover" or codes != (DONE, DONE)):
            faults.append(f"exit codes {codes}")
        score.book(f"{subject.name}, {second}", faults)
    return score


def _intrude(what: str, subject: Subject, folder: Path) -> int:
    from fsi.resuming import recover, resume
    from fsi.runner import run

    if what == "run":
        return run(subject.scene, out=folder, threads=1, quiet=True).exit_code
    if what == "resume":
        return resume(folder, threads=1, quiet=True).exit_code
    recover(folder)
    return DONE
