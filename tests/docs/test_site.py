"""The documentation site builds without a broken link, and its notebooks run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


def test_the_site_builds(tmp_path):
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocs_jupyter")
    pytest.importorskip("mkdocstrings")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", DOCS / "website/mkdocs.yml", "-d", tmp_path]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env=os.environ | {"EXECUTE_NOTEBOOKS": "false"}
    )
    assert done.returncode == 0, done.stderr
    scene = (tmp_path / "reference/scene.html").read_text()
    assert "[waves]" in scene and "crest to trough [m]" in scene and "particle spacing dr [m]" in scene
    assert "Open a scene, a scene file or a built-in scene" in (tmp_path / "reference/python.html").read_text()


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(notebook):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    assert all(not cell["outputs"] for cell in cells), "notebooks are kept without their outputs"
    names: dict = {}
    for cell in cells:
        exec("".join(cell["source"]), names)
    pyplot.close("all")
