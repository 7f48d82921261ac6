"""The newcomers' pages, followed to the letter: their files, their commands and their Python."""

import io
import re
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fsi.command import app

pytest.importorskip("rerun")
DOCS = Path(__file__).parents[2] / "docs" / "tutorials"
FILES = {"first_body": ("buoy.xml", "buoy.toml"), "find_a_slam": ("box.xml", "slam.toml")}
UNTIL = {"first_body": "0.1", "find_a_slam": "0.3"}  # [s]


class Followed:
    """A page that was followed in an empty folder: what its commands and its Python printed."""

    def __init__(self, name: str, folder: Path):
        self.text = (DOCS / f"{name}.md").read_text()
        for file, block in zip(FILES[name], [*self.blocks("xml"), *self.blocks("toml")], strict=True):
            (folder / file).write_text(block)
        self.commands = [line.split()[1:] for block in self.blocks("sh") for line in block.splitlines()]
        self.said = [self._run(command, UNTIL[name]) for command in self.commands]
        out = io.StringIO()
        with redirect_stdout(out):
            for block in self.blocks("python"):
                exec(block, {})
        self.printed = out.getvalue()

    def blocks(self, language: str) -> list[str]:
        return re.findall(rf"```{language}\n(.*?)```", self.text, flags=re.S)

    def _run(self, command: list[str], until: str) -> str:
        extra = ["--until", until, "--threads", "1"] if command[0] == "run" else []
        result = CliRunner().invoke(app, [*command, *extra])
        assert result.exit_code == 0, result.output
        return result.output


@pytest.fixture
def follow(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr("fsi.command.open_window", lambda recording: opened.append(recording) or 0)

    def follow(name: str) -> Followed:
        page = Followed(name, tmp_path)
        assert [str(recording) for recording in opened] == [f"runs/{Path(FILES[name][1]).stem}/run.rrd"]
        return page

    return follow


def test_first_body(follow, tmp_path):
    page = follow("first_body")
    assert [command[0] for command in page.commands] == ["check", "run", "report", "view"]
    assert "# log: about" in page.said[0]
    assert page.printed.startswith("heave between ")
    assert (tmp_path / "runs/buoy/report.html").is_file()
    body = (tmp_path / "buoy.xml").read_text().replace("<option ", '<option density="1000" ')
    (tmp_path / "buoy.xml").write_text(body)
    [told] = page.blocks("text")
    assert told.strip() in CliRunner().invoke(app, ["check", "buoy.toml"]).output


def test_find_a_slam(follow, tmp_path):
    page = follow("find_a_slam")
    found = re.fullmatch(r"impact at (.*) s, (.*) N upwards\n", page.printed)
    assert 0.226 < float(found[1]) < 0.25  # the fall alone takes 0.2258 s
    assert float(found[2]) > 3 * 88  # the box's weight
    assert "impact on &#39;box&#39;" in (tmp_path / "runs/slam/report.html").read_text()


@pytest.mark.parametrize("name", FILES)
def test_links_lead_somewhere(name):
    for link in re.findall(r"\]\((?!http)([^)#]+)\)", (DOCS / f"{name}.md").read_text()):
        assert (DOCS / link).exists(), link
