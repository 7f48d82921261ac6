"""The command `fsi` from its first moment: signals are heard before the rest is imported, which takes a while, and numpy's
products of matrices keep to one thread, which has to be said before numpy is imported: those of a sea are small, and a second
thread, waiting for the next one, took half of the processors from the fluid."""

from __future__ import annotations

import os
import signal

from fsi import garbage
from fsi.messages import Messages, open_closed_streams
from fsi.simulation.signals import at_once


def main() -> None:
    """The command `fsi`, which ends with 130 after SIGINT and with 143 after the other signals that end a run."""
    open_closed_streams()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    garbage.pause()
    before = signal.getsignal(signal.SIGINT)
    with at_once(Messages(), signal.SIGINT):
        from fsi.command import main as command

        signal.signal(signal.SIGINT, before)  # from here on it is Python's
        command()
