"""The files that an MJCF file reads besides itself: includes, meshes, height fields, textures."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

WHOLE = ("include", "model")  # elements whose file counts from the folder of the main file, whatever the compiler says
FOLDER = {"texture": "texturedir"}  # element -> the compiler's folder of its files, of the others "meshdir"


def assets(mjcf: Path) -> list[Path]:
    """Absolute paths of what the file and its includes name; those of a file that is no XML are left to MuJoCo."""
    folders: dict[str, str] = {}
    named: list[tuple[str, str]] = []
    seen, waiting = set(), [mjcf]
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        seen.add(path)
        try:
            root = ElementTree.parse(path).getroot()
        except (OSError, ElementTree.ParseError, ValueError, LookupError):
            continue
        for element in root.iter():
            if element.tag == "compiler":
                both = element.get("assetdir")
                folders |= {name: folder for name in ("meshdir", "texturedir") if (folder := element.get(name, both))}
            files = [text for key, text in element.items() if key.startswith("file") and text]
            named += [(element.tag, text) for text in files]
            waiting += [mjcf.parent / text for text in files if element.tag == "include"]
    return [
        _place(mjcf.parent, "" if tag in WHOLE else folders.get(FOLDER.get(tag, "meshdir"), ""), text)
        for tag, text in named
    ]


def _place(folder: Path, below: str, text: str) -> Path:
    return Path(folder, below, text).resolve()
