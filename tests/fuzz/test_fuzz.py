"""Whatever a scene or an MJCF file holds, `fsi check` accepts or refuses it in words: no traceback, no hang, no gigabytes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def fuzz(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "tests.fuzz", *arguments]
    return subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True)


def test_some_inputs():
    done = fuzz("--scenes", "80", "--mjcfs", "40", "--runs", "0", "--slow", "inf")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_all_inputs_and_the_first_steps_of_those_accepted():
    done = fuzz("--slow", "inf")
    assert done.returncode == 0, done.stdout + done.stderr
