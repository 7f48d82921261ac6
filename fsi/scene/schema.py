"""What a scene may hold, as JSON schema: for editors, and for the page of all keys.

The description of a key is the comment behind it in the source of its model: it stands once, where the key is made.
"""

from __future__ import annotations

import ast
import inspect
import io
import textwrap
import tokenize
from collections.abc import Iterator
from typing import Any

from fsi.parts import Part
from fsi.scene.model import Scene

LINK = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """JSON schema of a scene file, with the comments on its keys as descriptions. It knows the kinds of waves, couplers and
    fields of every installed package."""
    schema = Scene.model_json_schema()
    models = {(model.__name__, *model.model_fields): model for model in _models(Part)}
    for node in _objects(schema):
        if model := models.get((node["title"], *node["properties"])):
            for key, text in descriptions(model).items():
                node["properties"].get(key, {}).setdefault("description", text)
    schema["properties"]["levels"] = {
        "type": "object",
        "description": "keys and values that `--level NAME` sets, by name of the level",
        "additionalProperties": {"type": "object"},
    }
    return {"$schema": LINK, **schema}


def descriptions(model: type[Part]) -> dict[str, str]:
    """Key -> the comment behind it, for the keys of a model and of the models that it extends."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base is not Part and issubclass(base, Part):
            found |= _commented(inspect.getsource(base))
    return {key: text for key, text in found.items() if key in model.model_fields}


def _commented(source: str) -> dict[str, str]:
    """Key -> the comments on the lines of its declaration."""
    source = textwrap.dedent(source)
    comments: dict[int, str] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            comments[token.start[0]] = token.string.lstrip("# ").strip()
    body = ast.parse(source).body[0].body
    declared = [node for node in body if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)]
    said = {
        node.target.id: " ".join(comments[line] for line in range(node.lineno, node.end_lineno + 1) if line in comments)
        for node in declared
    }
    return {key: text for key, text in said.items() if text}


def _models(base: type[Part]) -> Iterator[type[Part]]:
    for model in base.__subclasses__():
        yield model
        yield from _models(model)


def _objects(node: Any) -> Iterator[dict[str, Any]]:
    """All schemas of objects within a schema."""
    if isinstance(node, list):
        for item in node:
            yield from _objects(item)
    elif isinstance(node, dict):
        if isinstance(node.get("properties"), dict) and "title" in node:
            yield node
        for value in node.values():
            yield from _objects(value)
