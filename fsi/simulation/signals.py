"""Signals that end a run: after the step in hand, or without it where it takes too long."""

from __future__ import annotations

import os
import signal
import socket
import threading
from collections.abc import Callable
from types import TracebackType

PATIENCE = 1.0  # wall time [s] that the step in hand may take
LAST = 0.5  # and what is done without it
CAUGHT = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGXCPU", "SIGUSR1")  # the last is what SLURM warns with
    if hasattr(signal, name)
)


def exit_code(number: int | None) -> int:
    """Of a command that this signal has ended: 130 for SIGINT, else 143."""
    return 130 if number == signal.SIGINT else 143


def _shielded(number: signal.Signals) -> bool:
    """Whether this is the SIGHUP of a program that was started by `nohup`, and goes on when its terminal closes."""
    return number.name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN


def at_once(say: Callable[[str], None], *also: signal.Signals) -> Interruption:
    """Ends the process by its exit code at a signal, for as long as there is nothing to complete: before a run and after it,
    also within a compiler that Python's handlers have to wait for. SIGINT is left to Python, unless it is among `also`."""
    numbers = tuple(number for number in CAUGHT if number != signal.SIGINT or number in also)
    return Interruption(say, lambda name: say(f"stopped by {name}"), numbers, patience=0.0)


class Interruption:
    """Catches the signals while it is entered, in the main thread; `number` is the first one, None before.

    A step may compile for a minute, and Python's handlers wait for it. A thread that the signal wakes without them waits
    `patience` [s] for the run to come to its end, then calls `last` (which completes the log) and ends the process. A
    second SIGINT ends it at once.
    """

    def __init__(
        self,
        say: Callable[[str], None],
        last: Callable[[str], None],
        numbers: tuple[signal.Signals, ...] = CAUGHT,
        patience: float = PATIENCE,
    ):
        self.number: int | None = None
        self._say, self._last, self._numbers, self._patience = say, last, numbers, patience
        self._over = threading.Event()

    def __enter__(self) -> Interruption:
        self._before = None
        if threading.current_thread() is not threading.main_thread():
            return self  # signals are left alone
        self._ear, self._mouth = socket.socketpair()
        self._mouth.setblocking(False)
        self._numbers = tuple(number for number in self._numbers if not _shielded(number))
        self._before = {number: signal.signal(number, self._note) for number in self._numbers}
        self._wakeup = signal.set_wakeup_fd(self._mouth.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._listen, name="signals", daemon=True).start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._over.set()
        if self._before is None:
            return
        signal.set_wakeup_fd(self._wakeup)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._mouth.close()

    def check(self) -> None:
        """Raise KeyboardInterrupt where a signal has come."""
        if self.number is not None:
            raise KeyboardInterrupt(signal.Signals(self.number).name)

    def _note(self, number: int, _) -> None:
        self.number = self.number or number

    def _listen(self) -> None:
        first = True
        while numbers := self._ear.recv(16):
            for number in numbers:
                if number not in self._numbers:
                    continue
                if first:
                    first = False
                    self._note(number, None)
                    if self._patience:
                        self._say("stopping after this step; press Ctrl-C again to stop at once")
                    threading.Thread(target=self._wait, name="patience", daemon=True).start()
                elif number == signal.SIGINT:
                    os._exit(exit_code(self.number))

    def _wait(self) -> None:
        if self._over.wait(self._patience):
            return
        rest = threading.Thread(target=self._last, args=(signal.Signals(self.number).name,), daemon=True)
        rest.start()
        rest.join(LAST)
        os._exit(exit_code(self.number))
