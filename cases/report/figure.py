"""One figure of a run, and how often a level is exceeded."""

from __future__ import annotations

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
