"""Fixed points x = H(x) of maps that are costly to call and have no derivative at hand."""

from __future__ import annotations

import numpy as np

FIRST = 0.1  # share of the first residual that a start without experience goes


class QuasiNewton:
    """Interface quasi-Newton iteration with an inverse Jacobian from least squares (IQN-ILS; Degroote, Bathe & Vierendeels
    2009, Comput. Struct. 87, 793-801).

    From the calls so far, the changes V of the residual r = H(x) - x and W of H, the next x is H(x) + W c with the c
    that brings |V c + r| to its minimum. For an affine map of n unknowns the residual vanishes after n + 1 calls,
    whatever the slope of the map. The last `memory` problems lend their V and W to the next one, which is similar.
    """

    def __init__(self, memory: int = 4):
        self._memory = memory
        self._past: list[tuple[np.ndarray, np.ndarray]] = []
        self.begin()

    def begin(self) -> None:
        """Start on a new problem."""
        if getattr(self, "_calls", None) and len(self._calls) > 1:
            self._past = [self._changes(), *self._past][: self._memory]
        self._calls: list[tuple[np.ndarray, np.ndarray]] = []

    def next(self, x: np.ndarray, image: np.ndarray, scale: np.ndarray, floor: float = 0.0) -> np.ndarray:
        """The x (n,) to try after H(x) = image (n,); residuals are compared after multiplication with `scale` (n,), and
        changes of them up to `floor` left out, which are mostly rounding."""
        self._calls.append((image - x, image))
        parts = ([self._changes()] if len(self._calls) > 1 else []) + self._past
        if not parts:
            return x + FIRST * (image - x)
        V, W = (np.concatenate(arrays, axis=1) for arrays in zip(*parts, strict=True))
        keep = _independent(scale[:, None] * V, floor)
        if not keep:
            return x + FIRST * (image - x)
        V, W = V[:, keep], W[:, keep]
        c = np.linalg.lstsq(scale[:, None] * V, scale * (x - image), rcond=None)[0]
        return image + W @ c

    def state(self) -> dict:
        """The changes V and W of the last problems, and the calls of the present one."""
        return {
            "past": [[array.copy() for array in pair] for pair in self._past],
            "calls": [[array.copy() for array in pair] for pair in self._calls],
        }

    def restore(self, state: dict) -> None:
        self._past, self._calls = ([tuple(pair) for pair in state[name]] for name in ("past", "calls"))

    def _changes(self) -> tuple[np.ndarray, np.ndarray]:
        """Changes from call to call of residual and image, each (n, m), the latest first."""
        residual, image = (np.array(values)[::-1] for values in zip(*self._calls, strict=True))
        return -np.diff(residual, axis=0).T, -np.diff(image, axis=0).T


def _independent(columns: np.ndarray, floor: float, share: float = 1e-3) -> list[int]:
    """Which columns to use, the first ones first: each must be longer than `floor` and keep a good share of its length at
    right angles to those before it; else it would repeat their news with more noise."""
    basis = np.zeros((len(columns), 0))
    keep = []
    for i, column in enumerate(columns.T):
        rest = column - basis @ (basis.T @ column)
        rest -= basis @ (basis.T @ rest)
        length = np.linalg.norm(rest)
        if length > max(floor, share * np.linalg.norm(column)) and len(keep) < len(columns):
            basis = np.column_stack([basis, rest / length])
            keep.append(i)
    return keep
