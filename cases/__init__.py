"""Named scenes, validation, benchmarks, studies and reports; names are resolved on first use."""

from importlib import import_module

_HOMES = {"sweep": "cases.study.engine", "Study": "cases.study.plan", "Parameter": "cases.study.plan"}

__all__ = list(_HOMES)


def __getattr__(name: str):
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'cases' has no attribute {name!r}")
