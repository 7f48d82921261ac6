"""Nested dictionaries as TOML text, by tomlkit. The standard library only reads TOML; this also shows what is not set."""

from __future__ import annotations


def dumps(table: dict) -> str:
    """TOML text of a dictionary of strings, numbers, booleans, lists and dictionaries, which `tomllib` reads back.

    TOML has no null: a key whose value is None becomes a comment.
    """
    import tomlkit  # takes 50 ms, and few commands write TOML

    return tomlkit.dumps(_filled(tomlkit, tomlkit.document(), table)).lstrip("\n")


def _filled(tomlkit, container, table: dict):
    """A document or table of tomlkit with these keys, values before tables, as TOML wants it."""
    for key, value in table.items():
        if value is None:
            container.add(tomlkit.comment(f"{tomlkit.key(key).as_string()} is not set"))
        elif not _is_table(value):
            container.append(key, _without_none(value))
    for key, value in table.items():
        if isinstance(value, dict):
            container.add(tomlkit.nl())
            container.append(key, _filled(tomlkit, tomlkit.table(is_super_table=False), value))
        elif _is_table(value):
            container.add(tomlkit.nl())
            container.append(key, tables := tomlkit.aot())
            for item in value:
                tables.append(_filled(tomlkit, tomlkit.table(), item))
    return container


def _is_table(value) -> bool:
    """A dictionary, or a list of them."""
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and all(map(_is_table, value)))


def _without_none(value):
    """A value for one line, in which nothing can be a comment."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, list) else value
