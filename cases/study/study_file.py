"""Studies from TOML files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydantic import ValidationError

from cases.study.plan import Study, resolve_path
from fsi.errors import SceneError
from fsi.scene.faults import fault_lines
from fsi.scene.file import read_toml
from fsi.scene.model import Scene


def load_study(source: str | Path | Study) -> Study:
    """The study of a TOML file, or a given one, with `set` flattened to dotted keys and an absolute scene path.

    Raises SceneError, one line per fault, all at once.
    """
    if isinstance(source, Study):
        return _settled(source, Path())
    try:
        path = Path(source).expanduser()
    except RuntimeError as fault:  # a home that is not there
        raise SceneError(f"cannot be read: {fault}", file=source, fix="check the path") from None
    if not path.exists():
        raise SceneError("no such file", file=path, fix="give the path of a study file")
    data = read_toml(path)
    data.setdefault("name", re.sub(r"[^\w.-]", "_", path.stem))
    if "scene" not in data:
        raise SceneError("missing", key="scene", file=path.name, fix="add scene = 'FILE.toml' or a name of `fsi cases`")
    try:
        study = Study.model_validate(data, context={"folder": path.absolute().parent})
    except ValidationError as errors:
        raise SceneError("\n".join(fault_lines(errors, data, path.name, Study))) from None
    for key, file in (("script", study.script), ("bem.file", study.bem and study.bem.file)):
        if file and not file.is_file():
            raise SceneError(f"no such file: {file}", key=key, file=path.name, fix="it is relative to the study file")
    return _settled(study, path.absolute().parent)


def _settled(study: Study, folder: Path) -> Study:
    scene = resolve_path(study, folder)
    if not isinstance(scene, Scene) and Path(scene).is_file():
        scene = str(Path(scene).absolute())
    return study.model_copy(update={"scene": scene, "settings": dict(flat(study.settings))})


def flat(table: Mapping, parents: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    """Dotted key -> value of nested tables: {"waves": {"period": 2.0}} gives "waves.period", 2.0."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from flat(value, (*parents, key))
        else:
            yield ".".join((*parents, key)), value
