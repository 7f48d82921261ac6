"""A team of threads over chunks of particles.

A kernel takes `(counter, bounds, ...)`, releases the GIL, and claims chunk after chunk until none is left; chunk c holds
the particles bounds[c] to bounds[c + 1]. Chunks depend on the particles alone, so results do not depend on the threads.
"""

from __future__ import annotations

import os
import time as clock
from threading import Lock, Thread

import numpy as np

SHORT, LONG = 1.5e-4, 2.5e-4  # seconds of a call on several threads, and on one, below which one does it
CHUNK = 2048  # particles; small enough to balance, large enough to hide the claim


def available_threads() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def chunk_bounds(count: int, chunk: int = CHUNK) -> np.ndarray:
    """Bounds (chunks + 1,) of equal chunks of `count` particles."""
    pieces = max(1, -(-count // chunk))
    return np.arange(pieces + 1, dtype=np.int64) * count // pieces


class Team:
    """Runs kernels on a fixed number of threads; the calling thread is one of them.

    A call that is too short for a second thread to wake up in time stays on the calling one: the team remembers how long
    each took. Nothing but the time depends on that.
    """

    def __init__(self, threads: int | None = None):
        self.threads = threads or available_threads()
        self._helpers: list[_Helper] = []  # for `close`, should the system refuse a thread
        self._helpers = [_Helper() for _ in range(self.threads - 1)]
        self._alone: dict[tuple, bool] = {}  # by kernel and number of chunks

    def run(self, kernel, bounds: np.ndarray, *args) -> None:
        """Call the kernel once on every thread and wait for all; its faults are raised here."""
        args = (np.zeros(1, np.int64), bounds, *args)
        chunks = len(bounds) - 1
        if chunks < 2 or not self._helpers:
            kernel(*args)
            return
        call, start = (kernel, chunks), clock.perf_counter()
        alone = self._alone.get(call, False)
        helpers = [] if alone else self._helpers[: chunks - 1]
        for helper in helpers:
            helper.begin(kernel, args)
        try:
            kernel(*args)
        finally:
            faults = [fault for helper in helpers if (fault := helper.finish())]
        if faults:
            raise faults[0]
        taken = clock.perf_counter() - start
        self._alone[call] = taken < (LONG if alone else SHORT)

    def close(self) -> None:
        for helper in self._helpers:
            helper.close()
        self._helpers = []

    def __del__(self):
        self.close()


class _Helper:
    """A thread that waits for a kernel to run."""

    def __init__(self):
        self._job, self._fault = None, None
        self._go, self._done = Lock(), Lock()
        self._go.acquire(), self._done.acquire()
        Thread(target=self._serve, name="sweep", daemon=True).start()

    def begin(self, kernel, args: tuple) -> None:
        self._job = kernel, args
        self._go.release()

    def finish(self) -> BaseException | None:
        """Wait for the kernel; what went wrong in it."""
        self._done.acquire()
        fault, self._job, self._fault = self._fault, None, None
        return fault

    def close(self) -> None:
        self._job = None
        self._go.release()

    def _serve(self) -> None:
        while self._go.acquire() and self._job:
            kernel, args = self._job
            try:
                kernel(*args)
            except BaseException as fault:  # it belongs to the thread that asked
                self._fault = fault
            del kernel, args
            self._done.release()
