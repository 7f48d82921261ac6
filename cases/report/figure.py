"""One figure of a run, and how often a level is exceeded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Figure:
    """One figure; `dim` and `label` say of which joint, body, gauge or probe, where there is one."""

    name: str
    value: float
    units: str
    long_name: str
    dim: str = ""
    label: str = ""

    @property
    def key(self) -> str:
        """`name`, or `name.label`: what an objective or a constraint calls it."""
        return f"{self.name}.{self.label}" if self.label else self.name


def exceeded(values: np.ndarray, share: float = 0.01) -> float:
    """The level that the values lie above for this share of the time."""
    return float(np.quantile(values, 1 - share))


def static_part(load: np.ndarray) -> np.ndarray:
    """What of a load (n, 3) does not change: the mean of the middle half of the values of each component, which a wave that
    passes, or a blow, leaves as it is (Huber & Ronchetti 2009, section 3.3)."""
    quarter = len(load) // 4
    return np.sort(load, axis=0)[quarter : len(load) - quarter].mean(axis=0)


def load_figures(load: np.ndarray, kind: str, units: str, words: str, dim: str, name: str) -> Iterator[Figure]:
    """Figures of a load (n, 3), a force or a torque: as a whole, what of it is static, and what is dynamic, the rest. The
    static part of a body in water is its buoyancy, which hides the waves in the whole."""
    load = load[np.isfinite(load).all(axis=1)]
    if not len(load):
        return
    static = static_part(load)
    yield Figure(f"{kind}_static", float(np.linalg.norm(static)), units, f"static {words}", dim, name)
    for suffix, part, which in (("", load, ""), ("_dynamic", load - static, "dynamic ")):
        size = np.linalg.norm(part, axis=1)
        yield Figure(f"{kind}{suffix}_max", float(size.max()), units, f"largest {which}{words}", dim, name)
        level, text = exceeded(size), f"{which}{words} exceeded 1 % of the time"
        yield Figure(f"{kind}{suffix}_1pct", level, units, text, dim, name)
