"""Runs that are ended by a signal at a random instant, looked at, and resumed until they are done."""

from __future__ import annotations

import os
import random
import signal
import time
from datetime import datetime
from pathlib import Path

import numpy as np

from cases.torture.trial import Score, Subject, fork, go, is_done, load, prefix_faults, wait
from cases.torture.trial import compare as compared
from fsi.errors import SceneError
from fsi.record.manifest import read_manifest
from fsi.resuming import recover

CAUGHT = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGHUP, signal.SIGXCPU)
BOUND = 2.0  # wall time [s]: what a SIGKILL may take of the log, and what a run may take to end after the others


def kills(subject: Subject, count: int, dice: random.Random) -> list[Score]:
    """End runs of a scene so many times, half of them by SIGKILL; each run that was hit is resumed until it is done."""
    killed, caught, whole = Score("kills (SIGKILL)"), Score("signals"), Score("resumed runs")
    reference, attempt, length = load(subject.whole), 0, subject.seconds
    while killed.tries + caught.tries < count:
        attempt += 1
        folder = subject.new("kill", attempt)
        while not is_done(folder) and killed.tries + caught.tries < count:
            number = dice.choice((signal.SIGKILL, dice.choice(CAUGHT)))
            resumed = any(folder.glob("checkpoints/*.checkpoint"))
            whole.counts["resumes"] += resumed
            sent, ended = _hit(subject, folder, dice.uniform(0.0, 0.7) * length, number, dice.choice((1, 2)))
            if sent is None:  # it was done before: the machine is less busy than it was
                length = length if resumed else min(length, 0.5 * (length + ended))
                continue
            score = killed if number == signal.SIGKILL else caught
            faults = _look(folder, reference, number, sent)
            if number != signal.SIGKILL:
                caught.slowest_end = max(caught.slowest_end, ended)
                faults += [f"took {ended:.1f} s to end"] if ended > BOUND else []
            score.book(f"{subject.name} by {signal.Signals(number).name}", faults)
        if not is_done(folder):
            whole.counts["resumes"] += any(folder.glob("checkpoints/*.checkpoint"))
            wait(fork(lambda to=folder: go(subject.scene, to)))
        whole.book(subject.name, compared(folder, subject.whole) if is_done(folder) else ["cannot be resumed"])
    return [killed, caught, whole]


def _hit(subject: Subject, folder: Path, after: float, number: int, threads: int) -> tuple[float | None, float]:
    """Start or resume the run and send it a signal `after` so many seconds: when it was sent, on the clock of files, None where
    the run had ended before; and how long the process took to end since then, or in all [s]."""
    started = time.perf_counter()
    child = fork(lambda: go(subject.scene, folder, threads))
    while time.perf_counter() < started + after:
        if os.waitpid(child, os.WNOHANG)[0]:
            return None, time.perf_counter() - started
        time.sleep(0.002)
    os.kill(child, number)
    sent, began = time.time(), time.perf_counter()
    wait(child)
    ended = time.perf_counter() - began
    return (None, time.perf_counter() - started) if is_done(folder) else (sent, ended)


def _look(folder: Path, whole, number: int, killed: float) -> list[str]:
    """What is wrong with what a signal left."""
    if not (folder / "run.json").exists() or not (folder / "run.mcap").exists():
        return []  # before the first step
    try:
        left, facts = load(folder), read_manifest(folder)
        status = left.attrs["status"]
        faults = [] if status in ("killed", "interrupted") else [f"a run that has ended counts as {status}"]
        if number == signal.SIGKILL:
            recover(folder)
            before, left = left, load(folder)
            if before.sizes["time"] != left.sizes["time"]:
                faults.append("recover changed the number of frames")
        faults += prefix_faults(folder, whole, left)
        if left.sizes.get("time") and not facts.get("resumed"):  # a resumed run has the clock of two runs
            age = killed - datetime.fromisoformat(facts["started"]).timestamp()
            if (gap := age - float(np.nanmax(left.wall_time, initial=0.0))) > BOUND:
                faults.append(f"the last {gap:.1f} s of wall time are not in the log")
        return faults
    except (SceneError, OSError, ValueError, KeyError) as fault:
        return [f"{type(fault).__name__}: {fault}"]
