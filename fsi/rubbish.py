"""Python's search for rubbish, which waits until a command has started: what is imported stays, and going through it again and
again took a seventh of a start."""

from __future__ import annotations

import gc

_waits = False


def wait() -> None:
    """Do not search until `go_on`; where nothing is searched for anyway, that stays so."""
    global _waits
    _waits = gc.isenabled()
    gc.disable()


def go_on() -> None:
    """What stands now stays, and Python searches among what comes; nothing where it does not wait."""
    global _waits
    if _waits:
        _waits = False
        gc.freeze()
        gc.enable()
