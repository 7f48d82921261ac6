"""Scenes at random: valid ones, small, and what people and programs make of them."""

from __future__ import annotations

import copy
import math
import random
import tomllib
from typing import Annotated, Literal, get_args, get_origin

from pydantic import BaseModel

from fsi.scene.file import builtin_scenes
from fsi.scene.model import Scene
from fsi.scene.toml import dumps

ODD = [
    math.nan, math.inf, -math.inf, 0, -0.0, -1, 1, 0.5, 1e300, -1e300, 1e-300, 5e-324, 1e9, -1e9, 1e-9, 2**31, 2**63, 10**30,
    10**400, True, False, "", "text", "none", "ünïcødé 漢字 \U0001f30a", "\x00\x1b[31m", "a" * 3000, "../../etc/passwd",
    "/dev/null", "/dev/zero", ".", "~", "package://", "package://bodies/models/", "package://bodies/../../x", "$HOME", "a b",
    [], [[]], {}, {"a": {}}, [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], ["a"], [math.nan, 0], [None],
]  # fmt: skip
WORDS = [
    "x",
    "min",
    "max",
    "tank",
    "walls",
    "e\u0301",
    "",
    "a.b",
    "a b",
    "\u202e",
    "0",
    "*",
    "__class__",
    "pto",
    "file",
]


def base(rng: random.Random) -> dict:
    """A small scene that is right."""
    depth, length = rng.choice([0.4, 0.5, 0.6]), rng.choice([1.0, 2.0, 3.0])
    data = {"spacing": rng.choice([0.05, 0.1]), "duration": rng.choice([0.2, 1.0, 5.0])}
    data["tank"] = {"min": [0.0, -depth], "max": [length, 0.5]}
    kind = rng.randrange(8)
    if kind == 1:
        data["waves"] = rng.choice(
            [
                {"wave_height": 0.06, "period": 1.2},
                {"kind": "irregular", "Hm0": 0.05, "peak_period": 1.2, "components": 20},
                {"kind": "solitary", "wave_height": 0.1},
                {"kind": "packet", "groups": [{"wave_height": 0.05, "period": 1.0, "waves": 2}]},
            ]
        )
        data["tank"]["max"][0] = 6.0
        data["damping"] = [{"start": 4.0, "end": 6.0}]
    if kind == 2:
        data["fluid"] = {"blocks": [{"min": [0.0, -depth], "max": [0.5, 0.0], "velocity": [0.1, 0.0]}]}
    if kind == 3:
        data["liquids"] = {"brine": {"density": 1100.0, "blocks": [{"min": [0.0, -depth], "max": [length, -0.2]}]}}
    if kind == 4:
        data |= {"dimension": 3, "spacing": 0.1, "tank": {"min": [0.0, 0.0, -depth], "max": [length, 0.6, 0.4]}}
    if kind == 5:
        data["bodies"] = {"b": {"mjcf": "package://bodies/models/surge_flap.xml", "position": [1.5, 0.0, 0.0]}}
        data |= {"spacing": 0.1, "tank": {"min": [0.0, -0.7], "max": [3.0, 0.5]}}
    if kind == 6:
        data["tank"] |= {"periodic": ["x"], "walls": ["z-"]}
        data["fluid"] = {"acceleration": [0.1, 0.0]}
    if kind == 7:
        name = rng.choice(sorted(builtin_scenes()))
        data = tomllib.loads(builtin_scenes()[name].read_text(encoding="utf-8"))
        data.pop("levels", None)
        data["spacing"] *= rng.choice([2.0, 4.0])
    if rng.random() < 0.4 and kind != 4:
        data["gauges"] = {"g": {"x": 0.5}}
        data["probes"] = {"p": {"position": [0.5, -0.2]}}
    return data


def scene(rng: random.Random) -> str:
    """The text of a scene file, right or wrong."""
    data = base(rng)
    for _ in range(rng.choice([0, 1, 1, 1, 2, 2, 3, 5])):
        rng.choice(
            [_odd, _odd, _scaled, _scaled, _removed, _added, _swapped, _moved, _chosen, _chosen, _chosen, _deep]
        )(rng, data)
    try:
        text = dumps(data)
    except (AttributeError, TypeError):
        text = dumps(base(rng))
    if rng.random() < 0.1:
        text = _smudged(rng, text)
    return text


def places(data, path=()) -> list[tuple]:
    """Every path into nested tables and lists."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    found = [path] if path else []
    for key, value in items:
        found += places(value, (*path, key))
    return found


def _at(data, path):
    for step in path:
        data = data[step]
    return data


def _odd(rng, data) -> None:
    """A value of another kind or size."""
    path = rng.choice(places(data))
    _at(data, path[:-1])[path[-1]] = copy.deepcopy(rng.choice([odd for odd in ODD if odd != [None]]))


def _scaled(rng, data) -> None:
    """Other units, another sign."""
    numbers = [path for path in places(data) if type(_at(data, path)) in (int, float)]
    if numbers:
        path = rng.choice(numbers)
        factor = rng.choice([-1, 0.001, 1000, 0.5, 2, 1.001, 10 ** rng.uniform(-12, 12)])
        _at(data, path[:-1])[path[-1]] *= factor


def _removed(rng, data) -> None:
    path = rng.choice(places(data))
    del _at(data, path[:-1])[path[-1]]
    if not data:
        data["spacing"] = 0.1


def _added(rng, data) -> None:
    """A key that nobody knows."""
    tables = [path for path in [(), *places(data)] if isinstance(_at(data, path), dict)]
    table = _at(data, rng.choice(tables))
    known = list(table) or ["x"]
    word = rng.choice([*WORDS, rng.choice(known) + "s", rng.choice(known)[:-1]])
    table[word] = copy.deepcopy(rng.choice([odd for odd in ODD if odd != [None]]))


def _swapped(rng, data) -> None:
    """Smallest and largest the wrong way round."""
    boxes = [path for path in [(), *places(data)] if isinstance(_at(data, path), dict) and "min" in _at(data, path)]
    if boxes:
        box = _at(data, rng.choice(boxes))
        box["min"], box["max"] = box.get("max", 0), box["min"]


def _moved(rng, data) -> None:
    """A part where another belongs."""
    one, two = rng.choice(places(data)), rng.choice(places(data))
    _at(data, two[:-1])[two[-1]] = copy.deepcopy(_at(data, one))


def _deep(rng, data) -> None:
    value = 1
    for _ in range(rng.choice([5, 50, 200])):
        value = [value] if rng.random() < 0.5 else {"a": value}
    path = rng.choice(places(data))
    _at(data, path[:-1])[path[-1]] = value


def _chosen(rng, data) -> None:
    """Some key of the model with a value that its type allows: options meet that have never met."""
    part, table = Scene, data
    for _ in range(6):
        name, field = rng.choice(list(part.model_fields.items()))
        if name in ("mjcf", "function", "bathymetry", "file") and rng.random() < 0.8:
            continue
        inner = list(_parts(field.annotation))
        if not inner:
            value = _value(rng, field.annotation, field.metadata)
            if isinstance(table, dict):
                table[name] = value
            return
        part = rng.choice(inner)
        many = "dict" in str(field.annotation)[:5]
        nested = table.setdefault(name, {}) if isinstance(table, dict) else {}
        if many and isinstance(nested, dict):
            nested = nested.setdefault(rng.choice(["a", "b", "g", "p", "x"]), {})
        if isinstance(nested, list):
            if not nested:
                nested.append({})
            nested = rng.choice(nested)
        table = nested


def _parts(annotation) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [part for inner in get_args(annotation) for part in _parts(inner)]


def _value(rng, annotation, metadata):
    """A value that a type allows."""
    if get_origin(annotation) is Annotated:
        inner, *metadata = get_args(annotation)
        return _value(rng, inner, metadata)
    if get_origin(annotation) is Literal:
        return rng.choice(get_args(annotation))
    if get_origin(annotation) is tuple:
        inner = get_args(annotation)[0]
        return [_value(rng, inner, ()) for _ in range(rng.choice([0, 1, 2, 2, 2, 3]))]
    options = [inner for inner in get_args(annotation) if inner is not type(None)]
    if options:
        return _value(rng, rng.choice(options), metadata)
    if annotation is bool:
        return rng.random() < 0.5
    if annotation is int:
        return rng.choice([1, 2, 6, 10, 64, 0, 200])
    if annotation is float:
        return rng.choice([0.0, 1e-6, 1e-3, 0.01, 0.1, 0.12, 0.2, 0.5, 0.7, 0.9, 1.0, 1.5, 2.0, 10.0, 1e3, -0.1, -1.0])
    return rng.choice(["a", "b", "scene", "waves.csv", "ü"])


def _smudged(rng, text: str) -> str:
    """Text that an editor or a disk got at."""
    at = rng.randrange(len(text))
    lines = text.splitlines(keepends=True)
    return rng.choice(
        [
            text[:at],
            text[:at] + text[at + 1 :],
            text[:at] + rng.choice('"[]{}=.#\n\t\x00\ufeff,€') + text[at:],
            "".join([*lines, rng.choice(lines)]),
            "\ufeff" + text,
            text.replace("\n", "\r\n"),
            text.replace("[", "[[", 1),
        ]
    )
