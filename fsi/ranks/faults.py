"""A rank that fails, dies or hangs ends all of them, with one message.

Every rank tells the root twice a second, from a thread of its own, whether it waits for others and how much processor time
it has used. The root ends the run where one has failed alone, says nothing any more, stands still, or is busy far longer than
ever before while the root waits for it; the second rank watches over the root in the same way. What the starter of the
processes sees first, a rank that was killed, it ends itself.
"""

from __future__ import annotations

import os
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager

BEAT = 0.5  # wall time [s] between the signs of life of a rank
SILENT = 15.0  # wall time [s] without one, after which a rank counts as dead
STILL = 15.0  # wall time [s] without waiting and without using a processor, after which a rank counts as hanging
BUSY, LONGER = 25.0, 10.0  # and so much processor time [s] on its own, and so many times as much as ever before
GRACE = 5.0  # wall time [s] in which all ranks come to the same end
LAST = 3.0  # wall time [s] to complete the log
ALIVE, FAILED, ENDED = 0, 1, 2


class Watch:
    """Watches over the ranks of a run from a thread; `leave(text)` completes the log on the root, once there is one."""

    def __init__(self, ranks):
        self._ranks, self._comm = ranks, ranks.comm.Dup()
        self._over = threading.Event()
        self.leave: Callable[[str], None] | None = None
        self._voice = sys.stderr
        now = clock.monotonic()
        watched = range(1, ranks.size) if ranks.root else (0,) if ranks.rank == 1 else ()
        self._seen = {rank: [now, now, 0.0, False, 0.0, 0, 0.0] for rank in watched}
        self._finished: set[int] = set()
        self._told: list = []  # messages on their way
        self._telling = threading.Lock()
        self._own_end = False
        many = ranks.size > 1 and ranks.threaded
        self._thread = threading.Thread(target=self._serve, name="ranks", daemon=True) if many else None
        if self._thread:
            self._thread.start()

    @contextmanager
    def over(self) -> Iterator[None]:
        """The run inside; a fault in it ends all ranks. Where all fail alike, each goes on with its own fault."""
        try:
            yield
        except BaseException as fault:
            self._end(FAILED, f"{type(fault).__name__}: {fault}" if not str(fault) else str(fault))
            raise
        self._end(ENDED, "")

    # -------------------------------------------------------------------------------------- every rank

    def _end(self, kind: int, text: str) -> None:
        """Tell the root, and wait for the others to come to their end as well."""
        if not self._thread:
            return
        self._own_end = True
        self._tell(kind, text)
        request, start = self._comm.Ibarrier(), clock.monotonic()
        while not request.Test():
            clock.sleep(0.01)
            if clock.monotonic() - start > GRACE + LAST:
                self._abort(f"rank {self._ranks.rank}: {text or 'the other ranks go on without it'}")
        self._over.set()
        self._thread.join()

    def _state(self) -> tuple[bool, int, float]:
        """Whether it waits for others, how often it has, processor time [s]."""
        return self._ranks.waiting, self._ranks.turns, clock.process_time()

    def _tell(self, kind: int, text: str = "") -> None:
        """Tell the rank that watches over this one, without waiting until it hears that."""
        watcher = 1 if self._ranks.root else 0
        with self._telling:
            self._told = [request for request in self._told if not request.Test()]
            self._told.append(self._comm.isend((kind, self._state(), text), dest=watcher, tag=1))

    def _serve(self) -> None:
        while not self._over.wait(BEAT):
            self._tell(ALIVE)
            if self._seen:
                self._listen()

    # -------------------------------------------------------------------------------------- those that watch

    def _listen(self) -> None:
        from mpi4py import MPI

        status = MPI.Status()
        while self._comm.iprobe(source=MPI.ANY_SOURCE, tag=1, status=status):
            rank = status.Get_source()
            kind, (waiting, turns, used), text = self._comm.recv(source=rank, tag=1)
            if kind != ALIVE:
                self._finished.add(rank)
            if kind == FAILED and not self._own_end:
                threading.Thread(target=self._after_grace, args=(rank, text), daemon=True).start()
            self._note(rank, waiting, turns, used)
        self._judge()

    def _note(self, rank: int, waiting: bool, turns: int, used: float) -> None:
        seen, now = self._seen[rank], clock.monotonic()
        _, moved, before, _, since, last_turns, longest = seen
        if turns != last_turns or waiting:  # it has come back to the others
            longest, since = max(longest, used - since if turns == last_turns + 1 else 0.0), used
        if waiting or used > before + 0.02:
            moved = now
        self._seen[rank] = [now, moved, used, waiting, since, turns, longest]

    def _judge(self) -> None:
        """End the run where a rank that this one waits for is dead, or hangs."""
        if not self._ranks.waiting and not self._own_end:
            return
        now = clock.monotonic()
        for rank, (heard, moved, used, waiting, since, _, longest) in self._seen.items():
            if rank in self._finished:
                continue
            if now - heard > SILENT:
                self._give_up(f"rank {rank} has not been heard of for {now - heard:.0f} s")
            elif not waiting and now - moved > STILL:
                self._give_up(f"rank {rank} has been standing still for {now - moved:.0f} s")
            elif not waiting and used - since > max(BUSY, LONGER * longest):
                self._give_up(f"rank {rank} has been busy for {used - since:.0f} s, ten times as long as ever before")

    def _after_grace(self, rank: int, text: str) -> None:
        """A rank has failed: end the run, unless this one comes to its own end meanwhile."""
        start = clock.monotonic()
        while clock.monotonic() - start < GRACE:
            if self._own_end:
                return
            clock.sleep(0.05)
        self._give_up(f"rank {rank} failed: {text}")

    def _give_up(self, text: str) -> None:
        if self.leave:
            rest = threading.Thread(target=self.leave, args=(text,), daemon=True)
            rest.start()
            rest.join(LAST)
        self._abort(text + "; `fsi resume` goes on from the last checkpoint")

    def _abort(self, text: str) -> None:
        print(text, file=self._voice, flush=True)
        try:
            self._comm.Abort(1)
        finally:
            os._exit(1)
