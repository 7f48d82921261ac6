"""The progress line: what it says, and when it is silent."""

from types import SimpleNamespace

import pytest

from fsi import progress
from fsi.progress import COMPILING, Progress, clock


@pytest.mark.parametrize(
    "seconds, text",
    [(0.4, "0 s"), (59.4, "59 s"), (59.6, "1:00 min"), (185, "3:05 min"), (7650, "2:07:30 h"), (-1, "0 s")],
)
def test_clock(seconds, text):
    assert clock(seconds) == text


@pytest.fixture
def wall(monkeypatch):
    """The wall clock, set by hand."""
    wall = SimpleNamespace(now=100.0)
    monkeypatch.setattr(progress.time, "perf_counter", lambda: wall.now)
    return wall


def test_plain_lines_are_occasional_and_leave_compiling_out(wall, capsys):
    with Progress(10.0) as line:
        for step in range(1, 91):  # the first step takes 20 s, then one a second
            wall.now = 100 + 20 + step - 1
            line(SimpleNamespace(time=0.1 * step, step_count=step))
    assert capsys.readouterr().err.splitlines() == [
        COMPILING,
        "1.100 / 10 s simulated, 30 s elapsed, 1 steps/s, 1:29 min left",
        "4.100 / 10 s simulated, 1:00 min elapsed, 1 steps/s, 59 s left",
        "7.100 / 10 s simulated, 1:30 min elapsed, 1 steps/s, 29 s left",
    ]


def test_quiet_is_silent(wall, capsys):
    with Progress(10.0, quiet=True) as line:
        wall.now = 1000.0
        line(SimpleNamespace(time=1.0, step_count=1))
    assert capsys.readouterr().err == ""
