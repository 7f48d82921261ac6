"""Every example runs, checks its own result, and stays short."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
UNTIL = {"flap": "1.0", "floating_box": "0.5", "dam_break": "0.6"}
RECORDED = [example for example in EXAMPLES if example.stem in UNTIL]
CONTROLLED = [example for example in EXAMPLES if example.stem not in UNTIL]  # which run to their ends, and log nothing


@pytest.mark.parametrize("example", RECORDED, ids=lambda path: path.stem)
def test_example_runs(example, tmp_path):
    command = [sys.executable, str(example), UNTIL[example.stem]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("runs/*/run.mcap"))


@pytest.mark.slow
@pytest.mark.parametrize("example", CONTROLLED, ids=lambda path: path.stem)
def test_a_controlled_body_does_better(example, tmp_path):
    pytest.importorskip("gymnasium")
    done = subprocess.run([sys.executable, str(example)], cwd=tmp_path, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_under_forty_lines(example):
    assert len(example.read_text().splitlines()) < 40
