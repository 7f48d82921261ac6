"""A team of threads over chunks of particles.

A kernel takes `(counter, bounds, ...)`, releases the GIL, and claims chunk after chunk until none is left; chunk c holds
the particles bounds[c] to bounds[c + 1]. Chunks depend on the particles alone, so results do not depend on the threads.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

CHUNK = 2048  # particles; small enough to balance, large enough to hide the claim


def available_threads() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def chunk_bounds(count: int, chunk: int = CHUNK) -> np.ndarray:
    """Bounds (chunks + 1,) of equal chunks of `count` particles."""
    pieces = max(1, -(-count // chunk))
    return np.arange(pieces + 1, dtype=np.int64) * count // pieces


class Team:
    """Runs kernels on a fixed number of threads; the calling thread is one of them."""

    def __init__(self, threads: int | None = None):
        self.threads = threads or available_threads()
        self._pool = ThreadPoolExecutor(self.threads - 1, "sweep") if self.threads > 1 else None

    def run(self, kernel, bounds: np.ndarray, *args) -> None:
        """Call the kernel once on every thread and wait for all; its faults are raised here."""
        counter = np.zeros(1, np.int64)
        helpers = min(self.threads, len(bounds) - 1) - 1
        futures = [self._pool.submit(kernel, counter, bounds, *args) for _ in range(helpers)]
        kernel(counter, bounds, *args)
        for future in futures:
            future.result()

    def close(self) -> None:
        if self._pool:
            self._pool.shutdown()
