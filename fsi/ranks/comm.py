"""Messages between the ranks of a run."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

SPINS = 50  # tests of a message before the processor is offered to others
NAP, SHARE = 1e-3, 0.1  # seconds of waiting from which on it is left to them, for that share of the time waited so far


class Ranks:
    """The processes of a run on an MPI communicator; `rank` of `size` is this one, and the first one is `root`.

    All but the point-to-point `swap` are collective. Waiting lets other threads and processes run, and is timed: `waited` [s],
    of which `spun` on a processor; `sent` counts the bytes that left this rank, by purpose. `waiting` tells the watch over
    faults that the others are waited for, `turns` how often that has been.
    """

    def __init__(self, comm):
        from mpi4py import MPI

        self._mpi, self.comm = MPI, comm.Dup()
        self.rank, self.size = comm.Get_rank(), comm.Get_size()
        self.root = self.rank == 0
        self.waited = self.spun = 0.0
        self.sent: dict[str, int] = {}
        self.waiting, self.turns, self.place = False, 0, 0
        self._sums = {"sum": MPI.SUM, "max": MPI.MAX, "min": MPI.MIN}

    def wait(self, *requests) -> None:
        """Until all of these requests are done."""
        start, used, spins = clock.perf_counter(), clock.process_time(), 0
        self.waiting = True
        try:
            while not self._mpi.Request.Testall(requests):
                spins += 1
                if spins > SPINS:
                    so_far = clock.perf_counter() - start
                    clock.sleep(min(NAP, SHARE * so_far) if so_far > NAP else 0)
        finally:
            self.waiting, self.turns = False, self.turns + 1
            self.waited += clock.perf_counter() - start
            self.spun += clock.process_time() - used

    def test(self, requests: list) -> None:
        """Let these messages get on."""
        self._mpi.Request.Testall(requests)

    @property
    def threaded(self) -> bool:
        """Whether several threads may send messages."""
        return self._mpi.Query_thread() == self._mpi.THREAD_MULTIPLE

    def processors(self) -> list[frozenset[int]]:
        """The processors that each rank of this machine may use; this one is the `place`-th of them."""
        here = self.comm.Split_type(self._mpi.COMM_TYPE_SHARED)
        mine = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
        found, self.place = here.allgather(frozenset(mine)), here.Get_rank()
        here.Free()
        return found

    def count(self, purpose: str, size: int) -> None:
        self.sent[purpose] = self.sent.get(purpose, 0) + size

    def reduce(self, values, how: str = "sum"):
        """Sum, max or min over the ranks of an array or a number; the same bits on all of them."""
        given = np.ascontiguousarray(values)
        found = np.empty_like(given)
        self.wait(self.comm.Iallreduce(given, found, self._sums[how]))
        self.count("reductions", given.nbytes)
        return found.reshape(np.shape(values)) if isinstance(values, np.ndarray) else found.item()

    def broadcast(self, value: Any = None) -> Any:
        """What the root gives, any object that can be pickled, on all ranks. Not for hot paths."""
        self.barrier()
        return self.comm.bcast(value, root=0)

    def barrier(self) -> None:
        self.wait(self.comm.Ibarrier())

    def once(self, call: Callable[..., Any], *arguments) -> Any:
        """The result of a call that the root makes alone; what it raises is raised on all ranks."""
        result, fault = None, None
        if self.root:
            try:
                result = call(*arguments)
            except Exception as error:
                fault = error
        result, fault = self.broadcast((result, fault))
        if fault is not None:
            raise fault
        return result

    def swap(self, given: dict[int, np.ndarray], width: int, purpose: str) -> list[tuple[int, np.ndarray]]:
        """Give rows (k, width) of doubles to some ranks, also to oneself; (rank, rows) of what this one gets, by rank."""
        counts, coming = np.zeros((2, self.size), np.int64)
        for rank, rows in given.items():
            counts[rank] = len(rows)
        self.wait(self.comm.Ialltoall(counts, coming))
        got = {rank: np.empty((int(coming[rank]), width)) for rank in np.flatnonzero(coming)}
        requests = [self.comm.Irecv(rows, source=int(rank)) for rank, rows in got.items() if rank != self.rank]
        for rank, rows in given.items():
            if rank == self.rank and len(rows):
                got[rank][:] = rows
            elif len(rows):
                rows = np.ascontiguousarray(rows, float)
                given[rank] = rows  # kept until it has been sent
                requests.append(self.comm.Isend(rows, dest=rank))
                self.count(purpose, rows.nbytes)
        self.wait(*requests)
        return [(int(rank), got[rank]) for rank in sorted(got)]

    def collect(self, values: np.ndarray, everywhere: bool = False) -> np.ndarray:
        """The rows (n, ...) of all ranks, one rank after the other, on the root (no rows on the others) or `everywhere`."""
        values = np.ascontiguousarray(values)
        row = values.itemsize * int(np.prod(values.shape[1:]))
        sizes = np.empty(self.size, np.int64)
        self.wait(self.comm.Iallgather(np.array([values.nbytes]), sizes))
        here = everywhere or self.root
        whole = np.empty(int(sizes.sum()) if here else 0, np.uint8)
        given = values.reshape(-1).view(np.uint8) if len(values) else np.empty(0, np.uint8)
        starts = np.cumsum(sizes) - sizes
        requests = []
        if here:
            for rank in range(self.size):
                part = whole[starts[rank] : starts[rank] + sizes[rank]]
                if rank == self.rank:
                    part[:] = given
                elif sizes[rank]:
                    requests.append(self.comm.Irecv(part, source=rank))
        for rank in range(self.size) if everywhere else (0,):
            if rank != self.rank and len(given):
                requests.append(self.comm.Isend(given, dest=rank))
                self.count("gathering", given.nbytes)
        self.wait(*requests)
        return whole.view(values.dtype).reshape(len(whole) // row, *values.shape[1:])

    def agree(self, *flags: int) -> Sequence[int]:
        """The largest of each flag over the ranks."""
        return [int(flag) for flag in self.reduce(np.array(flags, np.int64), "max")]
