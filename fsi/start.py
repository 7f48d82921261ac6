"""The command `fsi` from its first moment: signals are heard before the rest is imported, which takes a while."""

from __future__ import annotations

import signal

from fsi.messages import Messages, open_closed_streams
from fsi.simulation.signals import at_once


def main() -> None:
    """The command `fsi`, which ends with 130 after SIGINT and with 143 after the other signals that end a run."""
    open_closed_streams()
    before = signal.getsignal(signal.SIGINT)
    with at_once(Messages(), signal.SIGINT):
        from fsi.command import main as command

        signal.signal(signal.SIGINT, before)  # from here on it is Python's
        command()
