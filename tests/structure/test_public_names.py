"""The public names of `fsi`: what `dir` shows, what a type checker sees, and the version."""

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner

import fsi
from fsi.command import app

USES = Path(__file__).parent / "public_names.py"


def test_dir_shows_the_public_names():
    assert dir(fsi) == sorted(fsi.__all__)
    assert all(getattr(fsi, name) for name in fsi.__all__)
    with pytest.raises(AttributeError, match="module 'fsi' has no attribute 'nothing'"):
        fsi.nothing  # noqa: B018


def test_the_version_is_that_of_the_package():
    assert fsi.__version__ == version("spindrift")
    assert CliRunner().invoke(app, ["--version"]).output == f"spindrift {version('spindrift')}\n"


def test_public_names_have_types(tmp_path):
    """Elsewhere than beside the sources: a user's type checker sees `fsi` as installed."""
    pytest.importorskip("mypy")
    used = set(re.findall(r"fsi\.(\w+)", USES.read_text()))
    assert set(fsi.__all__) <= used
    command = [sys.executable, "-m", "mypy", "--strict", str(USES)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
