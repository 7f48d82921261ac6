"""Messages to stderr that cannot end a run: a terminal may close, a pipe lose its reader, a disk fill up."""

from __future__ import annotations

import os
import sys
from io import TextIOBase

NAMES = {1: "stdout", 2: "stderr"}


class Messages(TextIOBase):
    """Says lines on stderr, none if `quiet`; also a text stream. What goes wrong is kept for `new_fault`, not raised."""

    def __init__(self, quiet: bool = False):
        self._quiet = quiet
        closed = [name for number, name in NAMES.items() if number in closed_at_start]
        self._fault = f"{' and '.join(closed)} closed when the run began" if closed else ""
        self._told = quiet  # that nobody hears what nobody says is no news

    def __call__(self, line: str) -> None:
        if not self._quiet:
            self.write(f"{line}\n")
            self.flush()

    def write(self, text: str) -> int:
        self._try("write", text)
        return len(text)

    def flush(self) -> None:
        self._try("flush")

    def isatty(self) -> bool:
        return self.terminal

    @property
    def terminal(self) -> bool:
        """Whether someone may be watching."""
        try:
            return sys.stderr is not None and sys.stderr.isatty()
        except ValueError:  # it was closed
            return False

    def new_fault(self) -> str:
        """Why lines were lost, the first time that it is asked after one was; else empty."""
        if not self._fault or self._told:
            return ""
        self._told = True
        return self._fault

    def _try(self, method: str, *arguments) -> None:
        if sys.stderr is None:  # print would take stdout instead
            return
        try:
            getattr(sys.stderr, method)(*arguments)
        except (OSError, ValueError) as fault:
            why = fault.strerror if isinstance(fault, OSError) else str(fault)
            self._fault = self._fault or f"stderr cannot be written: {why}"


closed_at_start: set[int] = set()


def open_closed_streams() -> None:
    """Put /dev/null where stdin, stdout or stderr was closed before the program began: the next file to be opened would take
    its place, and what libraries write to it would end up in there."""
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            closed_at_start.add(number)
            found = os.open(os.devnull, os.O_RDWR)
            if found != number:
                os.dup2(found, number)
                os.close(found)
    for name in NAMES.values():
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 as long as the program
