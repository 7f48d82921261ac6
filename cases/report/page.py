"""Builds one self-contained HTML page: sections of text, facts, tables, lists and figures as embedded PNG.

    page = Page("flap", "a hinged flap in regular waves")
    section = page.section("Motion")
    section.text("Pitch over the last ten periods.")
    section.facts({"amplitude": "0.21 rad"})
    section.table(["period [s]", "RAO [rad/m]"], [[1.8, "4.1"]], caption="Response")
    section.figure(figure, "Pitch of the flap", name="pitch")
    page.write("report.html")

All text is escaped. The page loads nothing: no scripts, no fonts, no files beside it.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from io import BytesIO
from pathlib import Path

from fsi.errors import SceneError
from fsi.record.files import new_file, write_text

MADE_BY = '<meta name="generator" content="Spindrift">'
DPI = 144  # of the PNGs, one and a half times what a page 1200 px wide shows

STYLE = """
:root { color-scheme: light; }
body { margin: 0; background: #f4f6f8; color: #1c2733; font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1152px; margin: 0 auto; padding: 24px; background: #fff; }
h1 { margin: 0; font-size: 30px; line-height: 1.25; }
h2 { margin: 40px 0 12px; padding-top: 12px; font-size: 21px; border-top: 1px solid #d5dce3; }
.subtitle { margin: 4px 0 12px; color: #51606f; font-size: 17px; }
nav { margin: 12px 0; } nav a { margin-right: 18px; white-space: nowrap; }
a { color: #0b5cad; }
p { max-width: 80ch; margin: 8px 0; }
table { border-collapse: collapse; margin: 12px 0; font-size: 15px; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: #51606f; padding-bottom: 6px; }
th, td { padding: 5px 18px 5px 0; border-bottom: 1px solid #e3e8ed; text-align: left; vertical-align: top; }
thead th { border-bottom: 2px solid #aab6c2; white-space: nowrap; } tbody th { font-weight: 500; color: #36454f; }
td.number { text-align: right; }
.scroll { overflow-x: auto; }
figure { margin: 18px 0; } figure img { display: block; width: 100%; max-width: 1152px; height: auto; }
figcaption { color: #51606f; font-size: 15px; }
ul { padding-left: 22px; } li.warning { color: #8a4b00; } li.error { color: #a31515; }
pre { overflow-x: auto; padding: 12px; background: #f4f6f8; font-size: 14px; line-height: 1.4; }
"""


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
        links = "".join(f'<a href="#{s.anchor}">{escape(s.title)}</a>' for s in self.sections)
        parts = [
            f"<h1>{escape(self.title)}</h1>",
            f'<p class="subtitle">{escape(self.subtitle)}</p>' if self.subtitle else "",
            f"<nav>{links}</nav>" if len(self.sections) > 1 else "",
            *(section.html() for section in self.sections),
        ]
        body = "\n".join(filter(None, parts))
        head = f'<meta charset="utf-8">{MADE_BY}<meta name="viewport" content="width=device-width, initial-scale=1">'
        return (
            f'<!DOCTYPE html>\n<html lang="en"><head>{head}<title>{escape(self.title)}</title>'
            f"<style>{STYLE}</style></head>\n<body><main>\n{body}\n</main></body></html>\n"
        )

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
    """Part of a page under a heading; what is added stands in the order in which it came."""

    def __init__(self, title: str):
        self.title = title
        self.anchor = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
        self.images: dict[str, bytes] = {}
        self._parts: list[str] = []

    def text(self, paragraph: str) -> None:
        """A paragraph."""
        self._parts.append(f"<p>{escape(paragraph)}</p>")

    def code(self, text: str) -> None:
        """Text as it is, in a fixed-width font."""
        self._parts.append(f"<pre>{escape(text)}</pre>")

    def items(self, lines: Iterable[str | tuple[str, str]]) -> None:
        """A list; a line may come as (level, text) with the level `info`, `warning` or `error`."""
        pairs = [("info", line) if isinstance(line, str) else line for line in lines]
        rows = "".join(f'<li class="{escape(level)}">{escape(text)}</li>' for level, text in pairs)
        self._parts.append(f"<ul>{rows}</ul>")

    def facts(self, facts: Mapping[str, object]) -> None:
        """Names and values, one a line."""
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{_shown(value)}</td></tr>" for name, value in facts.items())
        self._parts.append(f'<div class="scroll"><table><tbody>{rows}</tbody></table></div>')

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> None:
        """A table; units belong into the heads. Numbers are written with four digits and set to the right."""
        above = f"<caption>{escape(caption)}</caption>" if caption else ""
        head = "".join(f"<th>{escape(h)}</th>" for h in heads)
        body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
        table = f"<table>{above}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        self._parts.append(f'<div class="scroll">{table}</div>')

    def figure(self, figure, caption: str, *, name: str = "") -> None:
        """A matplotlib figure (`cases.report.charts`) or the bytes of a PNG; `name` is that of its file, see
        `Page.write`."""
        png = figure if isinstance(figure, bytes) else _png(figure)
        if name:
            self.images[name] = png
        source = b64encode(png).decode()
        self._parts.append(
            f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{source}">'
            f"<figcaption>{escape(caption)}</figcaption></figure>"
        )

    def html(self) -> str:
        return (
            f'<section id="{self.anchor}">\n<h2>{escape(self.title)}</h2>\n' + "\n".join(self._parts) + "\n</section>"
        )


def _png(figure) -> bytes:
    data = BytesIO()
    figure.savefig(data, format="png", dpi=DPI)
    return data.getvalue()


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else escape(str(value))


def _cell(value: object) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f'<td class="number">{_shown(value)}</td>' if number else f"<td>{_shown(value)}</td>"
