"""What MuJoCo warns of, for the notes of a run; by itself it would write a log file into the working directory."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

_heard: list[str] = []


@contextmanager
def listening() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings of what is done inside, each once, in one line."""
    _take_over()
    _heard.clear()
    found: list[str] = []
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        try:
            yield found
        finally:
            texts = [*_heard, *(str(one.message) for one in seen if issubclass(one.category, UserWarning))]
            found += dict.fromkeys(", ".join(text.split("\n")).strip(", ") for text in texts)
    for one in seen:
        if not issubclass(one.category, UserWarning):
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def of_run(data: mujoco.MjData) -> list[str]:
    """Notes on the warnings that MuJoCo counted while it stepped."""
    notes = []
    for kind, warning in enumerate(data.warning):
        if warning.number:
            text = mujoco.mju_warningText(kind, int(warning.lastinfo)).strip()
            notes.append(f"MuJoCo: {text} ({warning.number} times)")
    return notes


def _take_over() -> None:
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(lambda text: _heard.append(text) if len(_heard) < 100 else None)


def heard() -> list[str]:
    """What MuJoCo warned of so far, inside `listening`."""
    return list(_heard)
