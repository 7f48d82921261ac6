"""Python's garbage collection, paused until a command has started: what is imported stays, and to go through it again and again
took a seventh of a start."""

from __future__ import annotations

import gc

_paused = False


def pause() -> None:
    """Collect nothing until `resume`; where collection is off already, it stays so."""
    global _paused
    _paused = gc.isenabled()
    gc.disable()


def resume() -> None:
    """What stands now is kept, and garbage is collected among what comes; nothing where it is not paused."""
    global _paused
    if _paused:
        _paused = False
        gc.freeze()
        gc.enable()
