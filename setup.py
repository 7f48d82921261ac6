"""The description on a package index: the README with its pictures and links by absolute address.

The address is `tool.spindrift.address` of pyproject.toml; without one pictures are left out and links are plain text."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
ADDRESS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["spindrift"]["address"]


def absolute(link: re.Match) -> str:
    """A link of Markdown as it leads somewhere outside the repository."""
    picture, text, target = link.groups()
    if "://" in target or target.startswith("#"):
        return link[0]
    return f"{picture}[{text}]({ADDRESS}/{target})" if ADDRESS else "" if picture else text


README = (ROOT / "README.md").read_text(encoding="utf-8")
setup(
    long_description=re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", absolute, README),
    long_description_content_type="text/markdown",
)
