"""JSON that every reader takes: numbers that are none are the strings "NaN", "Infinity" and "-Infinity", as in Protocol
Buffers' mapping to JSON (protobuf.dev/programming-guides/json)."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

NUMBERS = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}
TEXTS = {"scene", "name", "host", "text", "reason", "status", "label"}  # keys whose values are never numbers


def dumps(value: Any, **options: Any) -> str:
    """The value as JSON; numbers and arrays of NumPy as such, and what JSON has nothing for as its `str`."""
    return json.dumps(_plain(value), allow_nan=False, **options)


def loads(text: str) -> Any:
    """What `dumps` was given, also from JSON that has a bare NaN. Raises ValueError where it is no JSON."""
    return _restored(json.loads(text))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "Infinity" if value > 0 else "-Infinity"
    return value if value is None or isinstance(value, str | int | float) else str(value)


def _restored(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: item if key in TEXTS else _restored(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_restored(item) for item in value]
    return NUMBERS.get(value, value) if isinstance(value, str) else value
