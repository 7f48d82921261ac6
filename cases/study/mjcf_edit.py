"""Attributes of an MJCF file, changed by the name of their element.

In the XML: MuJoCo's `MjSpec`, with which `bodies` joins files, has the attributes of the compiled model (`euler` is a
quaternion there, `damping` a polynomial), while the keys of a study are those that stand in the file."""

from __future__ import annotations

import re
from difflib import get_close_matches
from pathlib import Path
from xml.etree import ElementTree

from fsi.errors import SceneError

ASSET_FOLDERS = ("assetdir", "meshdir", "texturedir")


def read(path: Path) -> ElementTree.Element:
    """The tree of a file with its includes in place and its asset folders absolute, so that it may be written anywhere.

    Raises SceneError where it cannot be read.
    """
    root = _parse(path)
    _inline(root, path.parent)
    compilers = root.findall("compiler") or [ElementTree.SubElement(root, "compiler")]
    named = {name for compiler in compilers for name in ASSET_FOLDERS if compiler.get(name)}
    for compiler in compilers:
        for name in ASSET_FOLDERS:
            if compiler.get(name):
                compiler.set(name, str((path.parent / compiler.get(name)).absolute()))
    if "assetdir" not in named:  # files count from the folder of the model
        for name in {"meshdir", "texturedir"} - named:
            compilers[0].set(name, str(path.parent.absolute()))
    return root


def files(root: ElementTree.Element) -> list[Path]:
    """The asset files that a tree of `read` refers to."""
    folders = {name: c.get(name) for c in root.findall("compiler") for name in ASSET_FOLDERS if c.get(name)}
    found = []
    for element in root.iter():
        if element.get("file") and element.tag != "include":
            folder = folders.get("texturedir" if element.tag == "texture" else "meshdir") or folders.get("assetdir")
            found.append(Path(folder or ".", element.get("file")))
    return found


def change(root: ElementTree.Element, key: str, value: object, file: object) -> None:
    """Set `NAME.attribute`, `KIND.NAME.attribute` or with an index `...attribute[2]` to a value.

    Raises SceneError where no or more than one element has the name, or the attribute is no list long enough.
    """
    match = re.fullmatch(r"(?:(?P<kind>\w+)\.)?(?P<name>[^.\[\]]+)\.(?P<attribute>\w+)(?:\[(?P<index>\d+)\])?", key)
    if match is None:
        raise SceneError(
            f"{key!r} names no attribute", file=file, fix="write e.g. joint.hinge.damping or geom.hull.size[2]"
        )
    kind, name, attribute, index = match.groups()
    element = _find(root, kind, name, file)
    if index is None:
        text = " ".join(map(str, value)) if isinstance(value, list | tuple) else _text(value)
    else:
        parts = element.get(attribute, "").split()
        if int(index) >= len(parts):
            fault = f"{element.tag} {name!r} has {len(parts)} numbers in {attribute!r}, none of index {index}"
            raise SceneError(fault, file=file, fix="write the attribute out in the file")
        parts[int(index)] = _text(value)
        text = " ".join(parts)
    element.set(attribute, text)


def _find(root: ElementTree.Element, kind: str | None, name: str, file: object) -> ElementTree.Element:
    named = [e for e in root.iter() if e.get("name") and e.tag != "mujoco"]
    hits = [e for e in named if e.get("name") == name and kind in (None, e.tag)]
    if len(hits) == 1:
        return hits[0]
    if hits:
        kinds = " and a ".join(e.tag for e in hits)
        raise SceneError(f"{name!r} is a {kinds}", file=file, fix=f"say which: {hits[0].tag}.{name}.ATTRIBUTE")
    known = sorted({f"{e.tag}.{e.get('name')}" for e in named})
    wanted = f"{kind}.{name}" if kind else name
    close = get_close_matches(wanted, known, n=1)
    fix = f"did you mean {close[0]}?" if close else f"named are {', '.join(known) or 'none'}"
    raise SceneError(f"no element {wanted!r}", file=file, fix=fix)


def _text(value: object) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)


def _parse(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=path, fix="correct the MJCF") from None


def _inline(parent: ElementTree.Element, folder: Path) -> None:
    """Put the children of included files where they are included; every path counts from the main file's folder."""
    for place, child in reversed(list(enumerate(parent))):
        if child.tag == "include":
            inner = _parse(folder / child.get("file", ""))
            _inline(inner, folder)
            parent.remove(child)
            for offset, element in enumerate(list(inner)):
                parent.insert(place + offset, element)
        else:
            _inline(child, folder)
