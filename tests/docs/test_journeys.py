"""The long tutorials, followed with their example files at a small size: their commands and their Python."""

import io
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fsi.command import app

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "tutorials"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Makes a folder with the files of an example, and goes there."""

    def made(name: str) -> Path:
        place = Path(shutil.copytree(ROOT / "examples" / name, tmp_path / name))
        monkeypatch.chdir(place)
        return place

    return made


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (PAGES / f"{page}.md").read_text(), flags=re.S)


def follow(page: str, **more: list[str]) -> list[str]:
    """Run the commands of a page, each with more arguments by its name; what they printed."""
    said = []
    for line in "".join(blocks(page, "sh")).splitlines():
        name = line.split()[1]
        result = CliRunner().invoke(app, [*line.split()[1:], *more.get(name, [])])
        assert result.exit_code == 0, result.output
        said.append(result.output)
    return said


@pytest.mark.parametrize("page", ["float_and_plate", "breakwater"])
def test_scenes_are_those_of_the_page(page):
    [scene] = [file.read_text() for file in (ROOT / "examples" / page).glob("*.toml") if "[tank]" in file.read_text()]
    kept = [line.partition("#")[0].strip() for line in scene.splitlines()]
    for block in blocks(page, "toml"):
        assert all(line.partition("#")[0].strip() in kept for line in block.splitlines())
    for link in re.findall(r"\]\((?!http)([^)#]+)\)", (PAGES / f"{page}.md").read_text()):
        assert (PAGES / link).exists(), link


@pytest.mark.slow
def test_float_and_plate(folder):
    pytest.importorskip("capytaine")
    place = folder("float_and_plate")
    (place / "bem.py").write_text((place / "bem.py").read_text().replace("2.6, 9)", "2.6, 3)"))
    subprocess.run([sys.executable, "bem.py"], cwd=place, check=True, timeout=600)
    study = (place / "power.toml").read_text()
    study = study.replace("[0.06, 0.12]", "[0.12]").replace("[1.3, 1.7, 2.1]", "[1.8]")
    (place / "power.toml").write_text(
        study.replace("[parameters.wave_height]", "[set]\nduration = 9.0\n\n[parameters.wave_height]")
    )
    said = follow("float_and_plate", sweep=["--workers", "0", "--quiet"])
    assert "body 'float' as drawn: mass 108 kg, displaces 108 kg" in said[0] and "natural period, slide" in said[0]
    from cases.study import load_results

    data = load_results("studies/power")
    assert 0.3 < float(data.power_matrix_ratio.squeeze()) < 2.0
    assert "linear potential theory" in Path("studies/power/report.html").read_text()


@pytest.mark.slow
def test_breakwater(folder):
    for package in ("rasterio", "pyvista", "imageio"):
        pytest.importorskip(package)
    place = folder("breakwater")
    subprocess.run([sys.executable, "bed.py"], cwd=place, check=True, timeout=100)
    follow("breakwater", run=["--threads", "1", "--until", "12"], render=["--every", "4"])
    for file in ("report.html", "vtk/particles.vtkhdf", "vtk/walls.vtkhdf"):
        assert Path("runs/breakwater", file).stat().st_size > 1000
    page = Path("runs/breakwater/report.html").read_text()
    assert "Loads on fixed structures" in page and "Discharge" in page
    with redirect_stdout(io.StringIO()):
        for block in blocks("breakwater", "python"):
            exec(block, {})
    assert Path("paraview.png").stat().st_size > 10_000
