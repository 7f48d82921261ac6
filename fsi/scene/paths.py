"""Where the files of a scene lie: what leads outside its folder is said, for a scene may come from someone else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from fsi import plugins
from fsi.scene.model import Scene


def outside_notes(scene: Scene, folder: Path, others: Iterable[Path] = ()) -> list[str]:
    """A note for each file that the scene names, or that its body files read (`others`), outside the folder of the scene file
    and outside the installed packages that bring scenes."""
    inside = [folder.resolve(), *map(Path.resolve, plugins.packages())]
    named = [*scene_files(scene), *(("bodies", path) for path in others)]
    far = {
        path: key for key, path in reversed(named) if not any(path.resolve().is_relative_to(place) for place in inside)
    }
    return [f"{key}: {path} lies outside the scene's folder, {folder}" for path, key in reversed(far.items())]


def scene_files(scene: Scene) -> list[tuple[str, Path]]:
    """Key and path of every file that a scene names."""
    return list(_paths("", scene.model_dump(mode="python")))


def _paths(key: str, value: object) -> Iterator[tuple[str, Path]]:
    if isinstance(value, Path):
        yield key, value
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from _paths(f"{key}.{name}" if key else str(name), part)
    elif isinstance(value, list | tuple):
        for n, part in enumerate(value):
            yield from _paths(f"{key}[{n}]", part)
