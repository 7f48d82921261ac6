"""Runs of cases, one after the other, or several at a time in processes that keep to a processor each."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from cases.validation.engine.case import Row
from cases.validation.engine.registry import load
from cases.validation.engine.runner import run_case
from fsi.compute.team import available_threads
from fsi.trust import trusted, trusting

Job = tuple[str, str, str]  # case, level, solver


def run_all(
    jobs: Sequence[Job], processes: int, threads: int, figures: Path | None = None
) -> Iterator[tuple[Job, Row, str]]:
    """Each job with its row and why it failed, as soon as it is done; with several processes each has one thread."""
    if processes == 1:
        for job in jobs:
            yield job, *_run(job, threads, figures)
        return
    spawn = multiprocessing.get_context("spawn")  # threads of a parent do not survive a fork
    processors = spawn.SimpleQueue()
    for processor in _processors(processes):
        processors.put(processor)
    with ProcessPoolExecutor(processes, spawn, _keep_to, (processors,)) as pool:
        running = {pool.submit(_run, job, 1, figures, trusted()): job for job in jobs}
        try:
            for done in as_completed(running):
                yield running[done], *done.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _processors(count: int) -> Iterable[int]:
    free = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else range(available_threads())
    return [free[n % len(free)] for n in range(count)]


def _keep_to(processors) -> None:
    processor = processors.get()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {processor})


def _run(job: Job, threads: int, figures: Path | None, trust: bool = False) -> tuple[Row, str]:
    case, level, solver = job
    with trusting(trust):
        return run_case(load(case), level, solver, threads, figures)
