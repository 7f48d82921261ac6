"""What this machine can do at most, measured in the vector type of the sweeps: multiply-adds, roots, quotients, memory."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import load, sqrt, store

TRIAD_BYTES = 24  # a number of a triad: two read and one written, in double precision (McCalpin 1995, STREAM)
CHAINS = 12  # independent sums, enough to hide the latency of a multiply-add


@cache
def make_chains(lanes: int, root: bool, quotient: bool):
    """n rounds of CHAINS independent roots, quotients or (with neither) multiply-adds on lanes."""
    L = lanes

    @helper(lanes, root, quotient)
    def turn(v, x, y):
        if root:
            return sqrt(v + x)
        if quotient:
            return x / (v + y)
        return v * x + y

    @compiled(lanes, root, quotient)
    def chains(a, n):
        x, y = load(a, 0, L), load(a, L, L)
        c0, c1, c2, c3 = load(a, 2 * L, L), load(a, 3 * L, L), load(a, 4 * L, L), load(a, 5 * L, L)
        c4, c5, c6, c7 = load(a, 6 * L, L), load(a, 7 * L, L), load(a, 8 * L, L), load(a, 9 * L, L)
        c8, c9, c10, c11 = load(a, 10 * L, L), load(a, 11 * L, L), load(a, 12 * L, L), load(a, 13 * L, L)
        for _ in range(n):
            c0, c1, c2, c3 = turn(c0, x, y), turn(c1, x, y), turn(c2, x, y), turn(c3, x, y)
            c4, c5, c6, c7 = turn(c4, x, y), turn(c5, x, y), turn(c6, x, y), turn(c7, x, y)
            c8, c9, c10, c11 = turn(c8, x, y), turn(c9, x, y), turn(c10, x, y), turn(c11, x, y)
        store(a, 2 * L, (c0 + c1 + c2 + c3) + (c4 + c5 + c6 + c7) + (c8 + c9 + c10 + c11))

    return chains


@compiled()
def triad(a, b, c, n):
    """a = b + 3 c, n times."""
    for _ in range(n):
        for i in range(a.size):
            a[i] = b[i] + 3.0 * c[i]


def rates(precision: str, lanes: int, threads: int, seconds: float = 0.1) -> dict:
    """Operations a second of so many threads together: multiply-adds count as two."""
    dtype = np.float32 if precision == "single" else np.float64
    numbers = lambda: (np.linspace(0.5, 0.9, (CHAINS + 2) * lanes).astype(dtype),)  # noqa: E731
    rate = lambda work: CHAINS * lanes * _rounds_per_second(work, numbers, threads, seconds)  # noqa: E731
    return {
        "precision": precision,
        "lanes": lanes,
        "threads": threads,
        "flops_per_s": 2 * rate(make_chains(lanes, False, False)),
        "roots_per_s": rate(make_chains(lanes, True, False)),
        "quotients_per_s": rate(make_chains(lanes, False, True)),
    }


def bandwidth(threads: int, megabytes: int = 256, seconds: float = 0.2) -> dict:
    """Memory traffic of a triad [B/s] of so many threads together, over three arrays of so many megabytes each."""
    size = int(megabytes * 1e6 / 8 / threads)
    arrays = lambda: tuple(np.full(size, value) for value in (0.0, 1.0, 2.0))  # noqa: E731
    rate = _rounds_per_second(triad, arrays, threads, seconds)
    return {"threads": threads, "bytes_per_s": TRIAD_BYTES * size * rate}


def limits(threads: int, lanes: dict[str, int], seconds: float = 0.1, megabytes: int = 256) -> dict[str, list[dict]]:
    """Rows of `rates` for the lanes of the sweeps on one and on all threads, and for twice as many lanes on one; rows of
    `bandwidth` for one and for all threads."""
    teams = sorted({1, threads})
    kinds = [(1, t) for t in teams] + [(2, 1)]
    return {
        "rates": [rates(p, n * wider, t, seconds) for p, n in lanes.items() for wider, t in kinds],
        "bandwidth": [bandwidth(t, megabytes, 2 * seconds) for t in teams],
    }


def _rounds_per_second(work: Callable, make_data: Callable, threads: int, seconds: float, repeats: int = 4) -> float:
    """Best rate of `work(*data, rounds)` over the repeats, summed over the threads, each with data of its own."""
    data = [make_data() for _ in range(threads)]
    clock = time.process_time if threads == 1 else time.perf_counter
    work(*data[0], 1)  # compile
    rounds, taken = 1, 0.0
    while taken < 0.2 * seconds:
        rounds, start = 2 * rounds, time.perf_counter()
        work(*data[0], rounds)
        taken = time.perf_counter() - start
    rounds = max(1, int(rounds * seconds / taken))
    best = float("inf")
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(repeats):
            start = clock()
            list(pool.map(lambda own: work(*own, rounds), data))
            best = min(best, clock() - start)
    return threads * rounds / best
