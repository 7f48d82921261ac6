"""The boxes of the ranks: a Cartesian arrangement of whole slices of cells, and their balance.

Along each direction the ranks of the same index form a department; all departments of a direction hold about the same work.
Work is counted in slices of cells across the direction, one count for a slice of the whole tank, so that a balance moves as
many whole slices as it needs at once (after the load balance of departments and chairs for SPH with domains of boxes, JOEME
2017, doi 10.1007/s40722-016-0070-6). Directions are balanced one by one: what is not a product of three distributions stays
unbalanced.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from fsi.errors import SceneError

WEIGHTS = {
    "fluid": 1.0,
    "wet": 0.45,
    "dry": 0.04,
}  # measured time of a particle: boundary ones near fluid, and far from it
Count = Callable[[int, np.ndarray], np.ndarray]  # (axis, planes) -> work between the planes, of all ranks


@dataclass(frozen=True)
class Decomposition:
    """The boxes of a run: shape (dim,) ranks along each axis; cuts: for each axis the planes [m] between them, ascending.
    Ranks are counted with the last axis fastest. The outer boxes reach to infinity."""

    shape: tuple[int, ...]
    cuts: tuple[np.ndarray, ...]

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    def box(self, rank: int) -> tuple[np.ndarray, np.ndarray]:
        """Corners (dim,) of the box of a rank; it holds what is at low <= x < high."""
        index = np.unravel_index(rank, self.shape)
        ends = [np.concatenate([[-np.inf], cut, [np.inf]]) for cut in self.cuts]
        return np.array([e[i] for e, i in zip(ends, index, strict=True)]), np.array(
            [e[i + 1] for e, i in zip(ends, index, strict=True)]
        )

    def rank_of(self, position: np.ndarray) -> np.ndarray:
        """Rank (n,) of the places (n, dim)."""
        index = [np.searchsorted(cut, position[:, d], side="right") for d, cut in enumerate(self.cuts)]
        return np.ravel_multi_index(index, self.shape)

    @classmethod
    def geometric(cls, shape: tuple[int, ...], low: np.ndarray, high: np.ndarray, cell: np.ndarray) -> Decomposition:
        """Boxes of equal numbers of slices, `cell` (dim,) [m] thick, from the corner `low` of the tank (dim,) to `high`."""
        planes = slices(low, high, cell)
        return cls(shape, tuple(_equal(p, n) for p, n in zip(planes, shape, strict=True)))

    def balanced(self, planes: list[np.ndarray], count: Count) -> Decomposition:
        """The same arrangement with as much work in each department of each direction as whole slices allow."""
        return Decomposition(
            self.shape,
            tuple(
                _cut(p, count(d, p), n) if n > 1 else np.empty(0)
                for d, (p, n) in enumerate(zip(planes, self.shape, strict=True))
            ),
        )


def slices(low: np.ndarray, high: np.ndarray, cell: np.ndarray) -> list[np.ndarray]:
    """The planes between slices of cells along each axis."""
    return [
        a + c * np.arange(1, max(1, math.ceil((b - a) / c - 1e-9))) for a, b, c in zip(low, high, cell, strict=True)
    ]


def _equal(planes: np.ndarray, parts: int) -> np.ndarray:
    """Planes that leave the same number of slices in each part."""
    at = (np.arange(1, parts) * (len(planes) + 1)) // parts - 1
    _enough(planes, parts)
    return planes[at]


def _cut(planes: np.ndarray, work: np.ndarray, parts: int) -> np.ndarray:
    """The planes whose largest part is the smallest; work (planes + 1,) of the slices between them. Each part has a slice."""
    _enough(planes, parts)
    total = np.concatenate([[0.0], np.cumsum(work)])
    least, most = max(total[-1] / parts, work.max()), total[-1]
    for _ in range(60):  # the smallest bound that so many parts can keep
        middle = 0.5 * (least + most)
        least, most = (least, middle) if _parts(total, middle, parts) is not None else (middle, most)
    at = _parts(total, most * (1 + 1e-12), parts)
    return planes[_even(total, at, parts) - 1]


def _parts(total: np.ndarray, bound: float, parts: int) -> np.ndarray | None:
    """Numbers of slices before each cut, with at most `bound` in each part; None where that takes more parts."""
    at, found = 0, []
    for left in range(parts - 1, 0, -1):
        far = int(np.searchsorted(total, total[at] + bound, side="right")) - 1
        at = min(max(far, at + 1), len(total) - 1 - left)
        found.append(at)
    return np.array(found) if total[-1] - total[at] <= bound else None


def _even(total: np.ndarray, at: np.ndarray, parts: int) -> np.ndarray:
    """The same bound with the last parts no emptier than needed: each cut at the nearest to its share where that keeps it."""
    bound = np.diff(total[np.concatenate([[0], at, [len(total) - 1]])]).max()
    wanted = np.searchsorted(total, total[-1] * np.arange(1, parts) / parts)
    for step in (0, -1):
        near = np.clip(wanted + step, np.arange(1, parts), len(total) - 1 - np.arange(parts - 1, 0, -1))
        if (np.diff(near) > 0).all():
            parts_of = np.diff(total[np.concatenate([[0], near, [len(total) - 1]])])
            if parts_of.max() <= bound * (1 + 1e-9):
                return near
    return at


def _enough(planes: np.ndarray, parts: int) -> None:
    if len(planes) + 1 < parts:
        raise SceneError(
            f"{parts} ranks along an axis that has {len(planes) + 1} slices of cells", key="--ranks",
            fix="take fewer ranks along it, or a finer spacing",
        )  # fmt: skip


def chosen_shape(size: int, sides: np.ndarray, text: str | None = None, upright: bool = False) -> tuple[int, ...]:
    """Ranks along each axis: those of `text`, such as 4x1x1, or those with the least area between `size` boxes of a tank with
    these sides (dim,) [m]; `upright`: one rank for the whole height. Raises SceneError where the text says something else
    than so many ranks, or than that."""
    dim = len(sides)
    if text is not None:
        shape = _read(text, size, dim)
        if upright and shape[-1] > 1:
            fault = f"{text} cuts granular liquids across: the weight above a particle would cross the border"
            whole = f"{size}x1x1" if dim == 3 else f"{size}x1"
            raise SceneError(fault, key="--ranks", fix=f"take one rank for the whole height, such as {whole}")
        return shape
    best: tuple[float, tuple[int, ...]] = (math.inf, (size, *(1,) * (dim - 1)))
    divisors = [n for n in range(1, size + 1) if size % n == 0]
    for shape in product(divisors, repeat=dim):
        if math.prod(shape) == size and not (upright and shape[-1] > 1):
            area = sum((n - 1) * np.prod(sides) / side for n, side in zip(shape, sides, strict=True))
            best = min(best, (float(area), shape))
    return best[1]


def arranged(text: str) -> tuple[int, ...]:
    """The numbers of an arrangement such as 4x1x1. Raises SceneError where it is none."""
    if not re.fullmatch(r"\d+(x\d+)*", text):
        raise SceneError(f"{text!r} is no arrangement of ranks", key="--ranks", fix="write it as 4x1x1")
    return tuple(map(int, text.split("x")))


def _read(text: str, size: int, dim: int) -> tuple[int, ...]:
    shape = arranged(text)
    if dim == 2 and len(shape) == 3 and shape[1] == 1:  # of a tank in x and z
        shape = shape[0], shape[2]
    if len(shape) != dim or 0 in shape:
        example = "4x1x1" if dim == 3 else "4x1"
        raise SceneError(f"{text} is no arrangement in {dim} dimensions", key="--ranks", fix=f"write it as {example}")
    if math.prod(shape) != size:
        raise SceneError(
            f"{text} takes {math.prod(shape)} processes, and {size} run", key="--ranks",
            fix=f"start it with mpiexec -n {math.prod(shape)}, or choose another arrangement",
        )  # fmt: skip
    return shape


def imbalance(work: np.ndarray) -> float:
    """The largest over the mean of the work of each rank."""
    return float(work.max() / work.mean()) if work.sum() > 0 else 1.0
