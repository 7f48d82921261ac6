"""A scene to start from: commented files of one of the templates, in a folder of the user's."""

from __future__ import annotations

from pathlib import Path

from fsi.errors import SceneError

TEMPLATES = Path(__file__).parent / "templates"


def kinds() -> list[str]:
    """The templates, one folder each."""
    return sorted(folder.name for folder in TEMPLATES.iterdir() if folder.is_dir())


def new(kind: str, folder: Path) -> list[Path]:
    """Write the files of a template into `folder`, made if it is not there; the scene is the first of them.

    Raises SceneError for a template that is not there, and where a file would be written over."""
    if kind not in kinds():
        raise SceneError(f"no template {kind!r}", key="KIND", fix=f"choose from {', '.join(kinds())}")
    files = {folder / file.name: file for file in sorted((TEMPLATES / kind).iterdir())}
    if there := [str(path) for path in files if path.exists()]:
        raise SceneError(f"{', '.join(there)}: there already", key="--out", fix="choose another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, file in files.items():
            path.write_bytes(file.read_bytes())
    except OSError as fault:
        raise SceneError(f"{folder}: {fault.strerror}", key="--out", fix="choose another folder") from None
    return sorted(files, key=lambda path: path.suffix != ".toml")
