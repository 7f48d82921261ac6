"""The page builder: everything is in the one file, escaped, and the figures are PNGs."""

import re
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np
import pytest

from cases.report.charts import canvas, lines
from cases.report.page import Page
from fsi.errors import SceneError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
OPEN = {"meta", "img", "br"}  # elements without an end


class Balance(HTMLParser):
    """Fails where an element is closed that is not open."""

    def __init__(self):
        super().__init__()
        self.stack, self.text, self.links = [], [], []

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag not in OPEN:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture
def page():
    page = Page("flap & float", "in <waves>")
    motion = page.section("Motion, at 1.8 s")
    motion.text("pitch < 60 degrees")
    motion.items(["calm", ("warning", "a step was cut")])
    motion.facts({"amplitude": 0.123456, "status": "done"})
    motion.table(["period [s]", "what"], [[1.8, "a"], [2, "b"]], caption="Response")
    figure, [panel] = canvas()
    t = np.linspace(0, 1)
    lines(panel, t, [t, t**2], ["a", "b"], xlabel="time [s]", ylabel="pitch [rad]")
    motion.figure(figure, "Pitch", name="pitch")
    page.section("End").code("spacing = 0.02")
    return page


def test_page_is_whole_and_self_contained(page):
    reader = Balance()
    reader.feed(page.html())
    assert reader.stack == []
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in reader.links)
    text = " ".join(reader.text)
    for words in ("flap & float", "in <waves>", "pitch < 60 degrees", "0.1235", "a step was cut", "spacing = 0.02"):
        assert words in text
    assert {f'id="{link[1:]}"' in page.html() for link in reader.links if link[0] == "#"} == {True}


def test_figures_are_embedded_and_written(page, tmp_path):
    file = page.write(tmp_path / "report.html", images=tmp_path / "images")
    [embedded] = re.findall(r"base64,([^\"]+)", file.read_text())
    png = b64decode(embedded)
    assert png.startswith(SIGNATURE)
    assert (tmp_path / "images/pitch.png").read_bytes() == png
    assert int.from_bytes(png[16:20], "big") == 1656  # pixels across: sharp on a page 1152 px wide


def test_folder_that_is_not_there(page, tmp_path):
    with pytest.raises(SceneError, match="cannot be written"):
        page.write(tmp_path / "nowhere/report.html")
