"""Where the runs of a study are done: worker processes of this machine or of a Dask cluster, by one interface.

Both are Dask's: without a scheduler a local cluster is started, one process a worker. Its workers are spawned, pinned to
their cores, and end with the study. A worker that dies takes its run with it; Dask starts it anew and tries once more.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from cases.study.worker import Job, Outcome, execute, follow_parent, record_failure
from fsi.compute.team import available_threads
from fsi.errors import RunError, SceneError
from fsi.extras import require

CONNECT_WITHIN = 10.0  # [s]
TRIES = 2  # of a run whose worker dies


class InProcess:
    """Runs jobs one after the other in this process."""

    workers = 1

    def __init__(self):
        self._jobs: deque[Job] = deque()

    def submit(self, job: Job) -> None:
        self._jobs.append(job)

    def next(self) -> tuple[Job, Outcome]:
        """The next job that is finished."""
        job = self._jobs.popleft()
        outcome = execute(job)
        if outcome.status == "interrupted":  # by Ctrl-C, which a run takes for itself
            raise KeyboardInterrupt
        return job, outcome


class Cluster:
    """Runs jobs through a Dask client, at any time no more than it has workers for: a job that waited in the queue of a
    worker would be counted as its victim when that dies."""

    def __init__(self, client):
        from distributed import as_completed

        self._client = client
        self._waiting: deque[Job] = deque()
        self._jobs: dict[str, Job] = {}
        self._under_way = 0
        self._finished = as_completed()

    @property
    def workers(self) -> int:
        """Runs that the cluster can be at now; it may grow and shrink."""
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, job: Job) -> None:
        """Hand a job to the cluster."""
        self._waiting.append(job)

    def _fill(self) -> None:
        for _ in range(min(len(self._waiting), self.workers - self._under_way)):
            job = self._waiting.popleft()
            key = f"{job.folder.name}-{os.getpid()}-{len(self._jobs)}"
            future = self._client.submit(execute, job, pure=False, key=key)
            self._jobs[key] = job
            self._under_way += 1
            self._finished.add(future)

    def next(self) -> tuple[Job, Outcome]:
        """The next job that is finished, in whatever order. Raises RunError where the cluster has gone or does not see
        the folder of the study."""
        from concurrent.futures import CancelledError

        from distributed import KilledWorker
        from distributed.comm import CommClosedError

        try:
            self._fill()
            future = next(self._finished)
            self._under_way -= 1
            job = self._jobs[future.key]
            outcome = future.result()
        except KilledWorker:
            reason = f"its worker process died {TRIES} times; it may have run out of memory"
            record_failure(job.folder, reason)
            return job, Outcome("failed", reason, {})
        except (CancelledError, CommClosedError, OSError) as fault:
            reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
            raise RunError(f"the Dask scheduler has gone: {reason}; start the study again to go on") from None
        if not (job.folder / "run.json").exists():
            raise RunError(f"the workers do not share {job.folder.parent} with this machine; use a folder that they do")
        return job, outcome


@contextmanager
def open_pool(workers: int | None, scheduler: str | None, threads: int) -> Iterator[InProcess | Cluster]:
    """Workers for the runs of a study, of `threads` threads each: `workers` processes (as many as the cores hold if
    None, 0 for this process) or those of the Dask scheduler at an address such as tcp://host:8786.

    Raises SceneError where the scheduler does not answer or has no worker.
    """
    if scheduler is None and workers == 0:
        yield InProcess()
        return
    distributed = require("distributed", "study", "a study on worker processes")
    _quieten()
    if scheduler is not None:
        with _connected(distributed, scheduler) as client:
            if not client.nthreads():
                fix = f"start some: dask worker {scheduler} --nthreads 1"
                raise SceneError(f"the scheduler {scheduler} has no workers", key="--scheduler", fix=fix)
            yield Cluster(client)
        return
    cores = available_threads()
    count = workers or max(1, cores // threads)
    options = {"n_workers": count, "threads_per_worker": 1, "processes": True, "memory_limit": None, "silence_logs": 50}
    options |= {"host": "127.0.0.1", "scheduler_kwargs": {"dashboard": False, "dashboard_address": "127.0.0.1:0"}}
    options |= {"dashboard_address": None, "worker_dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        client.register_plugin(_placement(distributed, threads))
        yield Cluster(client)


@contextmanager
def _connected(distributed, address: str) -> Iterator:
    try:
        client = distributed.Client(address, timeout=CONNECT_WITHIN)
    except (OSError, ValueError) as fault:
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        fix = "give the address that `dask scheduler` printed, e.g. tcp://127.0.0.1:8786"
        raise SceneError(f"no Dask scheduler at {address}: {reason}", key="--scheduler", fix=fix) from None
    with client:
        yield client


def _quieten() -> None:
    """A worker's death is reported as the outcome of its run, a scheduler's as an error, not as a log of Dask's."""
    import logging

    import dask

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    dask.config.set(
        {
            "distributed.scheduler.allowed-failures": TRIES - 1,
            "distributed.worker.daemon": True,
            "distributed.worker.multiprocessing-method": "spawn",
            "distributed.admin.large-graph-warning-threshold": "1GB",
            "distributed.comm.timeouts.connect": CONNECT_WITHIN,
        }
    )


def _placement(distributed, threads: int):
    """Pins the n-th worker to its own cores and makes it end with this process."""

    class Placement(distributed.WorkerPlugin):
        def __init__(self, threads: int):
            self.threads = threads

        def setup(self, worker) -> None:
            pin(int(worker.name), self.threads)
            follow_parent()

    return Placement(threads)


def pin(number: int, threads: int) -> None:
    """Keep this process to the cores of worker `number`, where the system can and there are enough."""
    if not hasattr(os, "sched_setaffinity"):
        return
    cores = sorted(os.sched_getaffinity(0))
    first = number * threads % len(cores)
    if threads < len(cores):
        os.sched_setaffinity(0, (cores[first:] + cores[:first])[:threads])
