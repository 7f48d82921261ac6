"""Builds one self-contained HTML page: sections of text, facts, tables, lists and figures as embedded PNG.

    page = Page("flap", "a hinged flap in regular waves")
    section = page.section("Motion")
    section.text("Pitch over the last ten periods.")
    section.facts({"amplitude": "0.21 rad"})
    section.table(["period [s]", "RAO [rad/m]"], [[1.8, "4.1"]], caption="Response")
    section.figure(figure, "Pitch of the flap", name="pitch")
    page.write("report.html")

The template is `page.html` beside this file. All text is escaped. The page loads nothing: no scripts, no fonts, no files beside
it.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from pathlib import Path

from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.files import new_file, write_text

TEMPLATE = Path(__file__).with_name("page.html")
MADE_BY = '<meta name="generator" content="Spindrift">'
DPI = 144  # of the PNGs, one and a half times what a page 1200 px wide shows


class Page:
    """A page of sections; `title` is its heading, `subtitle` the line under it."""

    def __init__(self, title: str, subtitle: str = ""):
        self.title, self.subtitle = title, subtitle
        self.sections: list[Section] = []

    def section(self, title: str) -> Section:
        """A new section at the end of the page."""
        self.sections.append(Section(title))
        return self.sections[-1]

    def html(self) -> str:
        """The page."""
        jinja2 = require("jinja2", "report", "a report")
        made = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
        made.filters |= {"shown": _shown, "base64": lambda png: b64encode(png).decode()}
        return made.from_string(TEMPLATE.read_text(encoding="utf-8")).render(page=self, made_by=MADE_BY)

    def images(self) -> dict[str, bytes]:
        """File name -> PNG of every figure that has a name."""
        return {f"{name}.png": png for section in self.sections for name, png in section.images.items()}

    def write(self, file: str | Path, images: str | Path | None = None) -> Path:
        """Write the page, and the PNGs of its named figures into the folder `images` if one is given; returns the file.
        Raises SceneError where it cannot be written."""
        file = Path(file)
        try:
            write_text(file, self.html())
            if images is not None:
                Path(images).mkdir(parents=True, exist_ok=True)
                for name, png in self.images().items():
                    with new_file(Path(images, name)) as new:
                        new.write_bytes(png)
        except OSError as fault:
            raise SceneError(
                f"{fault.filename} cannot be written: {fault.strerror}", fix="choose another folder"
            ) from None
        return file


class Section:
    """Part of a page under a heading; what is added stands in the order in which it came, in `parts`."""

    def __init__(self, title: str):
        self.title = title
        self.anchor = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
        self.images: dict[str, bytes] = {}
        self.parts: list[tuple[str, object]] = []

    def text(self, paragraph: str) -> None:
        """A paragraph."""
        self.parts.append(("text", paragraph))

    def code(self, text: str) -> None:
        """Text as it is, in a fixed-width font."""
        self.parts.append(("code", text))

    def items(self, lines: Iterable[str | tuple[str, str]]) -> None:
        """A list; a line may come as (level, text) with the level `info`, `warning` or `error`."""
        self.parts.append(("items", [("info", line) if isinstance(line, str) else line for line in lines]))

    def facts(self, facts: Mapping[str, object]) -> None:
        """Names and values, one a line."""
        self.parts.append(("facts", list(facts.items())))

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> None:
        """A table; units belong into the heads. Numbers are written with four digits and set to the right."""
        self.parts.append(("table", {"heads": heads, "rows": list(rows), "caption": caption}))

    def figure(self, figure, caption: str, *, name: str = "") -> None:
        """A matplotlib figure (`cases.report.charts`) or the bytes of a PNG; `name` is that of its file, see
        `Page.write`."""
        png = figure if isinstance(figure, bytes) else _png(figure)
        if name:
            self.images[name] = png
        self.parts.append(("figure", {"png": png, "caption": caption}))


def _png(figure) -> bytes:
    data = BytesIO()
    figure.savefig(data, format="png", dpi=DPI)
    return data.getvalue()


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
