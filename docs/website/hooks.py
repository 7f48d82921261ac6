"""What the site adds to the pages in `docs/`: the documents at the top of the repository, and pages made from the code."""

from __future__ import annotations

import os
import re
from pathlib import Path

from mkdocs.structure.files import File

import fsi
from fsi.scene.schema import scene_schema

ROOT = Path(__file__).parents[2]
PAGES = {  # page of the site -> document of the repository
    "index.md": "README.md",
    "VALIDATION.md": "VALIDATION.md",
    "BENCHMARK.md": "BENCHMARK.md",
    "ARCHITECTURE.md": "ARCHITECTURE.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "cases/README.md": "cases/README.md",
}
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


def on_config(config):
    """Fill the sections that name a folder with the pages in it."""
    for item in config.nav:
        for title, value in item.items():
            if isinstance(value, str) and value.endswith("/"):
                item[title] = [f"{value}{page.name}" for page in sorted((ROOT / "docs" / value).glob("*.md"))]
    return config


def on_files(files, config):
    """Add the documents of the repository and the pages made from the code."""
    for page, document in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / document).read_text()))
    files.append(File.generated(config, "reference/scene.md", content=scene_page()))
    files.append(File.generated(config, "reference/python.md", content=python_page()))
    return files


def on_page_markdown(markdown, page, config, files):
    """Links as the repository has them become links of the site; a file that is not a page is named by its path."""
    here = page.file.src_uri
    document = PAGES.get(here, f"docs/{here}")
    pages = {name: uri for uri, name in PAGES.items()}

    def replaced(match: re.Match) -> str:
        picture, text, target, anchor = match.groups()
        if "://" in target:
            return match[0]
        path = os.path.normpath(os.path.join(os.path.dirname(document), target))
        uri = pages.get(path, path.removeprefix("docs/"))
        if files.get_file_from_path(uri) is None:
            return text
        return f"{picture}[{text}]({os.path.relpath(uri, os.path.dirname(here) or '.')}{anchor or ''})"

    return LINK.sub(replaced, markdown)


def python_page() -> str:
    """The public names of `fsi`, for the plugin that reads docstrings."""
    homes = [f"::: {fsi._HOMES[name]}.{name}" for name in fsi.__all__ if name in fsi._HOMES]
    return "# Python\n\nAll of these are names of `fsi`.\n\n" + "\n\n".join(homes) + "\n"


def scene_page() -> str:
    """All keys of a scene: type, default and meaning, a table for each part."""
    schema = scene_schema()
    parts = [_part("A scene", schema)]
    seen = {key: node for key, node in schema["properties"].items() if key != "levels"}
    for key, node in seen.items():
        for model in _models(node, schema["$defs"]):
            parts.append(_part(f"`[{key}]` {_choice(model)}".rstrip(), model))
    return (
        "# All keys of a scene\n\n`fsi schema` prints the same as JSON schema.\n\n"
        + "\n\n".join(dict.fromkeys(parts))
        + "\n"
    )


def _models(node: dict, known: dict) -> list[dict]:
    """Schemas of the objects that a key may hold, and of those within them."""
    if "$ref" in node:
        node = known[node["$ref"].rsplit("/", 1)[-1]]
    found = [node] if "properties" in node else []
    inner = [*node.get("anyOf", ()), *node.get("oneOf", ()), *node.get("properties", {}).values()]
    inner += [node[key] for key in ("items", "additionalProperties") if isinstance(node.get(key), dict)]
    return found + [model for part in inner for model in _models(part, known)]


def _choice(model: dict) -> str:
    """`kind = "regular"` for a model that is chosen by a key."""
    chosen = [f'{key} = "{node["const"]}"' for key, node in model["properties"].items() if "const" in node]
    return f"with `{chosen[0]}`" if chosen else f"{model['title'].lower()}" if "title" in model else ""


def _part(title: str, model: dict) -> str:
    rows = [
        f"| `{key}` | {_type(node)} | {_default(key, node, model)} | {_cell(node.get('description', ''))} |"
        for key, node in model["properties"].items()
    ]
    text = " ".join(model.get("description", "").split())
    return "\n".join([f"## {title}", "", text, "", "| key | type | default | |", "|---|---|---|---|", *rows])


def _type(node: dict) -> str:
    if "$ref" in node:
        return "table"
    if "const" in node:
        return f'`"{node["const"]}"`'
    if "enum" in node:
        return " or ".join(f"`{value}`" for value in node["enum"])
    if "anyOf" in node or "oneOf" in node:
        kinds = [_type(part) for part in node.get("anyOf", node.get("oneOf")) if part.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if node.get("type") == "array":
        return "list"
    return {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "text"}.get(
        node.get("type"), "table"
    )


def _default(key: str, node: dict, model: dict) -> str:
    if key in model.get("required", ()):
        return "needed"
    value = node.get("default")
    return (
        ""
        if value is None or isinstance(value, dict)
        else f"`{str(value).lower() if value in (True, False) else value}`"
    )


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
