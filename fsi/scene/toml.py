"""Nested dictionaries as TOML text. The standard library only reads TOML; this also shows what is not set."""

from __future__ import annotations

import json
import re


def dumps(table: dict) -> str:
    """TOML text of a dictionary of strings, numbers, booleans, lists and dictionaries, which `tomllib` reads back.

    TOML has no null: a key whose value is None becomes a comment.
    """
    return "\n".join(_section(table, ())).lstrip("\n") + "\n"


def _section(table: dict, path: tuple[str, ...]) -> list[str]:
    plain = {k: v for k, v in table.items() if not _is_table(v) and not _is_table_list(v)}
    lines = [f"# {_key(k)} is not set" if v is None else f"{_key(k)} = {_value(v)}" for k, v in plain.items()]
    for key, value in table.items():
        here = (*path, key)
        name = ".".join(map(_key, here))
        if _is_table(value):
            lines += ["", f"[{name}]", *_section(value, here)]
        elif _is_table_list(value):
            for item in value:
                lines += ["", f"[[{name}]]", *_section(item, here)]
    return lines


def _is_table(value) -> bool:
    return isinstance(value, dict)


def _is_table_list(value) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_table, value))


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _value(value) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, dict):  # within a list
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + "}"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)
