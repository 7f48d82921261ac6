"""The torture of runs itself: it loses nothing, and it would notice."""

import random
import subprocess
import sys

import pytest

from cases.torture.mishaps import _damaged
from cases.torture.trial import Score


def test_scores_add_up_and_damage_is_damage():
    score, other = Score("kills"), Score("kills", slowest_end=0.5)
    score.book("here", [])
    other.book("there", ["series x", "series y"])
    other.counts["resumes"] += 2
    score.add(other)
    assert (score.tries, score.survived, score.remark) == (2, 1, "the slowest ended within 0.50 s, 2 resumes")
    assert score.lost == ["kills, there: series x", "kills, there: series y"]
    data, dice = bytes(range(1, 200)), random.Random(1)
    assert len(_damaged(data, "cut", 50, dice)) == 50
    for kind in ("flipped bit", "zeros"):
        assert _damaged(data, kind, 50, dice) != data and len(_damaged(data, kind, 198, dice)) == len(data)


@pytest.mark.slow
def test_nothing_is_lost():
    command = [sys.executable, "-m", "cases.torture", "channel", "--kills", "4", "--others", "2", "--damages", "40"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_memory_stays_flat():
    command = [sys.executable, "-m", "cases.torture", "--long", "20000"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
