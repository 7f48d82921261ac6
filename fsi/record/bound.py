"""Child processes that end with their parent, also where that is killed: `bound(COMMAND)` is the command to start.

The child starts as this file. On Linux it asks the kernel for a signal at its parent's death and becomes the command; on other
POSIX systems it stays, and ends the command when it has become an orphan. Elsewhere the command is left as it is.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence

PR_SET_PDEATHSIG = 1
LOOK_EVERY = 0.5  # [s]


def bound(command: Sequence[str]) -> list[str]:
    """A command line that runs `command` and ends with this process."""
    if os.name != "posix":
        return list(command)
    return [sys.executable, "-I", "-S", __file__, str(os.getpid()), *command]


def main(parent: int, command: Sequence[str]) -> int:
    """Become the command, or watch over it; its exit status."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before we asked
            return 1
        os.execvp(command[0], command)
    child = subprocess.Popen(command)
    while child.poll() is None:
        if os.getppid() != parent:
            child.kill()
        time.sleep(LOOK_EVERY)
    return child.returncode


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), sys.argv[2:]))
