"""Fuzzed inputs in a process of their own, started anew when one dies or does not answer."""

from __future__ import annotations

import json
import select
import subprocess
import sys
import tempfile
from pathlib import Path

ANSWER_WITHIN = 300.0  # [s] of wall time: what takes longer hangs; the promise is in processor time, by `--slow`
RUN_WITHIN = 600.0  # [s] for an input whose steps are run, the compiler's time with it


class Worker:
    """Answers one input at a time."""

    def __init__(self):
        self._process: subprocess.Popen | None = None
        self._folder = tempfile.TemporaryDirectory()

    def answer(self, kind: str, number: int, seed: int = 0, *, runs: bool = False) -> dict:
        """`state` accepted, refused or broken, `text`, `seconds`; with `runs`, `run` calm, alarm or broken, and `why`."""
        if self._process is None:
            command = [sys.executable, "-m", "tests.fuzz.one"]
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                cwd=Path(__file__).parents[2],
            )
        folder = Path(self._folder.name)
        try:
            self._process.stdin.write(json.dumps([kind, number, seed, str(folder), runs]) + "\n")
            self._process.stdin.flush()
            ready, _, _ = select.select([self._process.stdout], [], [], RUN_WITHIN if runs else ANSWER_WITHIN)
            line = self._process.stdout.readline() if ready else ""
        except BrokenPipeError:
            line, ready = "", [1]
        if line:
            return json.loads(line)
        self.close()
        return {
            "state": "broken",
            "text": "the process died" if ready else "no answer in time",
            "seconds": ANSWER_WITHIN,
        }

    def close(self) -> None:
        """End the process."""
        if self._process:
            self._process.kill()
            self._process.wait()
            self._process = None
