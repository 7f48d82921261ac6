"""Parameter studies: a base scene, parameters, and many runs of it on worker processes or a Dask cluster.

`cases.study.sweep` is the whole of it; names are resolved on first use.
"""

from importlib import import_module

_HOMES = {
    "Study": "plan",
    "Parameter": "plan",
    "load_study": "study_file",
    "sweep": "engine",
    "load_results": "results",
}

__all__ = list(_HOMES)


def __getattr__(name: str):
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
