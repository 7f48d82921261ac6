"""One point of a study as a scene: parameters set, files made, and the hash that names its run."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from cases.report.wave_figures import energy_period_ratio
from cases.study import mjcf_edit
from cases.study.carriage import carried
from cases.study.plan import Study, Value
from cases.study.radiation import forced
from fsi.errors import SceneError
from fsi.scene.file import load_scene
from fsi.scene.model import Scene
from fsi.scene.toml import dumps
from fsi.trust import may_run

DEFAULTS = {"output.timeline": False}  # a study keeps the log of every run; timelines on request
MJCF = re.compile(r"bodies\.(?P<body>[^.]+)\.mjcf\.(?P<attribute>.+)")
SCRIPT = "script."
ENERGY_PERIOD, PEAK_PERIOD = "waves.Te", "waves.peak_period"


@dataclass(frozen=True)
class Design:
    """A point of a study: its values, its scene, and the folder of its run, which the hash of the scene names."""

    values: dict[str, Value]
    scene: Scene
    folder: Path

    @property
    def hash(self) -> str:
        return self.folder.name


def design(study: Study, values: Mapping[str, Value], runs: Path) -> Design:
    """The scene at these values (parameter name -> value), its own files in `runs/HASH/inputs`.

    Raises SceneError where the scene cannot be.
    """
    keys = {study.parameters[name].key: value for name, value in values.items()}
    given = {**DEFAULTS, **study.settings, **keys}
    free = False
    if study.routine == "radiation":
        base = _load(study, {})
        given, free = forced(given, base), bool(carried(base))
    scene_keys, mjcf_keys, arguments = _sorted(given)
    if not mjcf_keys and not arguments and study.script is None and not free:
        scene = _scene(study, scene_keys)
        return Design(dict(values), scene, runs / digest(scene))
    runs.mkdir(parents=True, exist_ok=True)
    staging = Path(tempfile.mkdtemp(prefix=".staging-", dir=runs))
    try:
        if study.script is not None:
            scene_keys |= _build(study.script, staging, arguments)
        scene = _scene(study, scene_keys)
        scene_keys |= _edited(scene, mjcf_keys, staging)
        if study.routine == "radiation":
            scene_keys |= _written(
                {name: root for name, (root, _) in carried(_scene(study, scene_keys)).items()}, staging
            )
        name = digest(_scene(study, scene_keys))
        inputs = runs / name / "inputs"
        if not inputs.is_dir():
            inputs.parent.mkdir(exist_ok=True)
            staging.rename(inputs)
        return Design(dict(values), _scene(study, _moved(scene_keys, staging, inputs)), runs / name)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def digest(scene: Scene) -> str:
    """The hash of a scene: of every value that a run depends on, with the contents of its files in place of paths."""
    values = scene.model_dump(mode="python", exclude={"name", "description"})
    text = json.dumps(values, sort_keys=True, default=lambda value: _content(value))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _content(value: object) -> str:
    if not isinstance(value, Path):
        return str(value)
    if value.suffix == ".xml":
        root = mjcf_edit.read(value)
        assets = [_content(file) for file in mjcf_edit.files(root) if file.is_file()]
        for compiler in root.findall("compiler"):
            for name in mjcf_edit.ASSET_FOLDERS:
                compiler.attrib.pop(name, None)  # where the assets lie does not matter, what is in them does
        text = ElementTree.canonicalize(ElementTree.tostring(root, encoding="unicode"), strip_text=True)
        return "".join([hashlib.sha256(text.encode()).hexdigest(), *assets])
    if not value.is_file() and ":" in value.name:  # FILE.py:NAME
        name = value.name.rpartition(":")[0]
        return _content(value.with_name(name)) + value.name
    return hashlib.sha256(value.read_bytes()).hexdigest() if value.is_file() else str(value)


def _sorted(keys: Mapping[str, object]) -> tuple[dict, dict, dict]:
    """Keys of the scene; of MJCF files; of the script."""
    mjcf = {key: value for key, value in keys.items() if MJCF.fullmatch(key)}
    script = {key.removeprefix(SCRIPT): value for key, value in keys.items() if key.startswith(SCRIPT)}
    scene = {key: value for key, value in keys.items() if key not in mjcf and not key.startswith(SCRIPT)}
    return scene, mjcf, script


def _scene(study: Study, keys: Mapping[str, object]) -> Scene:
    """The scene with keys set. The energy period of irregular waves is no key of a scene: it becomes a peak period."""
    keys = dict(keys)
    energy_period = keys.pop(ENERGY_PERIOD, None)
    if energy_period is not None:
        scene = _load(study, keys | {PEAK_PERIOD: energy_period})
        keys[PEAK_PERIOD] = energy_period / energy_period_ratio(scene.waves)
    return _load(study, keys)


def base_scene(study: Study) -> Scene:
    """The scene of a study with what `set` says of it, before any parameter and script."""
    return _load(study, _sorted(study.settings)[0])


def _load(study: Study, keys: Mapping[str, object]) -> Scene:
    return load_scene(study.scene, [f"{key}={_toml(value)}" for key, value in keys.items()])


def _toml(value: object) -> str:
    """A value as an override has it, on one line; an empty text restores the default."""
    return "" if value == "" else _inline(value)


def _inline(value: object) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return dumps({"v": value}).removeprefix("v = ").strip()


def _build(script: Path, folder: Path, arguments: Mapping[str, object]) -> dict:
    """Run the study's script: keys of the scene -> values, paths made absolute. Raises SceneError where it may not run."""
    may_run(script, "script", script.parent.name)
    space: dict = {"__name__": script.stem, "__file__": str(script)}
    try:
        exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), space)
        if "build" not in space:
            raise SceneError("has no function build", file=script, fix="define build(folder, **arguments)")
        made = space["build"](folder, **arguments)
    except SceneError:
        raise
    except Exception as fault:
        raise SceneError(
            f"build failed: {type(fault).__name__}: {fault}", file=script, fix="correct the script"
        ) from fault
    if not isinstance(made, Mapping):
        fix = 'return e.g. {"bodies.flap.mjcf": folder / "flap.xml"}'
        raise SceneError(f"build returned {made!r}, no table of keys of the scene", file=script, fix=fix)
    return {key: str(value) if isinstance(value, Path) else value for key, value in made.items()}


def _edited(scene: Scene, keys: Mapping[str, object], folder: Path) -> dict[str, str]:
    """Write the body files with the keys set: `bodies.NAME.mjcf` -> path."""
    trees: dict[str, ElementTree.Element] = {}
    for key, value in keys.items():
        body, attribute = MJCF.fullmatch(key).groups()
        if body not in scene.bodies:
            known = ", ".join(scene.bodies) or "none"
            raise SceneError(f"the scene has no body file {body!r}", key=key, fix=f"it has {known}")
        file = scene.bodies[body].mjcf
        if body not in trees:
            trees[body] = mjcf_edit.read(file)
        mjcf_edit.change(trees[body], attribute, value, file.name)
    return _written(trees, folder)


def _written(trees: Mapping[str, ElementTree.Element], folder: Path) -> dict[str, str]:
    """Write body files: `bodies.NAME.mjcf` -> path."""
    made = {}
    for body, root in trees.items():
        path = folder / f"{body}.xml"
        ElementTree.ElementTree(root).write(path, encoding="unicode")
        made[f"bodies.{body}.mjcf"] = str(path)
    return made


def _moved(keys: Mapping[str, object], old: Path, new: Path) -> dict:
    """Keys with the folder `old` in their values replaced by `new`."""
    return {k: v.replace(str(old), str(new)) if isinstance(v, str) else v for k, v in keys.items()}
