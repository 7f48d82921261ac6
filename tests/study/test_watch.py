"""What a study shows while it goes on."""

from rich.console import Console

from cases.study.results import Row
from cases.study.watch import Watch
from cases.study.worker import Outcome

FIGURES = {"mean_power": ("mean_power", 12.345, "W", "mean absorbed power", "", "")}


def rows():
    yield Row({"damping": 30.0}, "a" * 16, Outcome("done", figures=FIGURES, wall_seconds=60.0))
    yield Row({"damping": 75.0}, "b" * 16, Outcome("done", figures=FIGURES, wall_seconds=20.0, reused=True))
    yield Row({"damping": 150.0}, "c" * 16, Outcome("failed", "unstable at t = 1 s\nmore", {}, 20.0))


def test_a_line_a_run_with_the_time_left(capsys):
    with Watch(8, 2) as watch:
        for row in rows():
            watch.add(row)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "1/8 runs, 3:30 min left: damping = 30: 12.35 W",  # 7 runs of 60 s on 2 workers
        "2/8 runs, 3:00 min left: damping = 75: 12.35 W (reused)",  # which took no time
        "3/8 runs, 1 failed, 1:40 min left: damping = 150: failed: unstable at t = 1 s",
    ]


def test_the_table_of_finished_runs():
    watch = Watch(8, 2, quiet=True)
    for row in rows():
        watch.add(row)
    console = Console(width=100, record=True)
    console.print(watch.table())
    text = console.export_text()
    assert "3/8 runs, 1 failed, 1:40 min left" in text and "elapsed" in text
    assert [line.split()[0] for line in text.splitlines()[-4:] if line.strip()] == ["30", "75", "150"]
    assert "12.35 W" in text and "reused" in text and "failed: unstable at t = 1 s" in text


def test_quiet_says_nothing(capsys):
    with Watch(3, 1, quiet=True) as watch:
        for row in rows():
            watch.add(row)
    assert capsys.readouterr().err == ""
