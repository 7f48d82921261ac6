"""The page on the best damping, followed to the letter in a tank small enough for a test."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fsi.command import app

ROOT = Path(__file__).parents[2]
SMALLER = (  # the page's study -> the test's
    ("values = [30.0, 75.0, 150.0, 300.0, 600.0, 1200.0]", "values = [30.0, 300.0, 3000.0]"),
    ("values = [1.5, 2.0]", "values = [0.6]"),
)
TANK = {"spacing": "0.1", "duration": "1.3", "wave_height": "0.03"}


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page, flags=re.S)


@pytest.fixture
def page(tmp_path, monkeypatch) -> str:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/tutorials/best_damping.md").read_text()
    (study,) = blocks(page, "toml")
    for large, small in SMALLER:
        assert large in study
        study = study.replace(large, small)
    (tmp_path / "damping.toml").write_text(study + "\n[measure]\nstart = 0.6\n")
    tank = (ROOT / "examples/studies/flap_tank.toml").read_text()
    for key, value in TANK.items():
        tank = re.sub(rf"^{key} = .*$", f"{key} = {value}", tank, flags=re.M)
    (tmp_path / "flap_tank.toml").write_text(tank)
    return page


def test_the_commands_of_the_page_find_the_best_damping(page, tmp_path):
    commands = [line.split()[1:] for block in blocks(page, "sh") for line in block.splitlines()]
    assert [command[0] for command in commands] == ["sweep", "report"]
    for command in commands:
        extra = ["--workers", "0"] if command[0] == "sweep" else []
        result = CliRunner().invoke(app, [*command, *extra])
        assert result.exit_code == 0, result.output
    (python,) = blocks(page, "python")
    space: dict = {}
    exec(python.replace("period=1.5", "period=0.6"), space)
    assert space["data"].best_damping.dims == ("period",) and space["data"].mean_power.attrs["units"] == "W"
    assert (tmp_path / "studies/damping/study.csv").read_text().startswith("damping [N m s/rad],period [s],")
    assert "Best damping" in (tmp_path / "studies/damping/report.html").read_text()


def test_the_page_shows_the_example(page):
    (study,) = blocks((ROOT / "docs/tutorials/best_damping.md").read_text(), "toml")
    example = (ROOT / "examples/studies/damping.toml").read_text()
    assert study in example.replace(next(line for line in example.splitlines() if "description" in line) + "\n", "")


def test_the_links_of_the_pages_lead_somewhere():
    for name in ("tutorials/best_damping.md", "guide/studies.md"):
        page = ROOT / "docs" / name
        for link in re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text()):
            assert (page.parent / link).exists(), link
