"""The balance of the ranks: planned from the layout before a run, and renewed where the fluid has moved on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsi.particles.layout import Layout
from fsi.ranks.comm import Ranks
from fsi.ranks.decomposition import WEIGHTS, Decomposition, chosen_shape, imbalance, slices
from fsi.ranks.halo import RankHalo
from fsi.scene.model import Scene
from fsi.scene.rheology import Granular

EVERY = 50  # steps from one look at the balance to the next
DRIFT = 0.05  # share of a rank's mean work by which one may have changed since the last balance, at first
PATIENT, EAGER = 1.5, 0.8  # factors of that share after a balance that did not pay, and after one that did
LEAST, MOST = 0.02, 0.5  # bounds of that share
SERIAL = 5e-3  # of a step on a rank that has hardly any particles [s]: Python and messages
HOLD = 0.03  # how firmly measured weights are held to `WEIGHTS`: what counts against an error of a rank's time by that share


def planes_of(scene: Scene) -> list[np.ndarray]:
    """The planes between slices, one spacing thick, of the scene's tank."""
    tank = scene.tank
    return slices(np.array(tank.min, float), np.array(tank.max, float), np.full(scene.dimension, scene.spacing))


def planned(
    scene: Scene, layout: Layout, size: int, shape: str | None, *, balance: bool = True, weighed: bool = True
) -> Decomposition:
    """The boxes of so many ranks at the start; equal ones without `balance`, and by numbers alone without `weighed`."""
    tank = scene.tank
    low, high = np.array(tank.min, float), np.array(tank.max, float)
    sides = high - low
    sides[-1] = min(sides[-1], layout.depth)  # where fluid comes to rest
    upright = any(isinstance(liquid.rheology, Granular) for liquid in scene.all_liquids)
    chosen = chosen_shape(size, sides, shape, upright)
    equal = Decomposition.geometric(chosen, low, high, np.full(scene.dimension, scene.spacing))
    if not balance:
        return equal
    position = np.concatenate([layout.position, layout.boundary])
    weight = work_of(layout, 2 * scene.smoothing_length) if weighed else np.ones(len(position))
    return equal.balanced(planes_of(scene), lambda axis, planes: _counts(position[:, axis], weight, planes))


def _counts(x: np.ndarray, weight: np.ndarray | None, planes: np.ndarray) -> np.ndarray:
    return np.bincount(np.searchsorted(planes, x, side="right"), weight, len(planes) + 1).astype(float)


def near_fluid(layout: Layout, support: float) -> np.ndarray:
    """Which boundary particles (b,) have fluid within a support or so [m] at the start: the others cost little."""
    return near(layout.position, layout.boundary, support)


def near(fluid: np.ndarray, boundary: np.ndarray, support: float) -> np.ndarray:
    """The same for fluid (n, dim) and boundary (b, dim) at these places."""
    low = np.minimum(fluid.min(0, initial=np.inf), boundary.min(0, initial=np.inf)) - support
    cells = [((p - low) / support).astype(np.int64) for p in (fluid, boundary)]
    shape = tuple(np.maximum(*(c.max(0, initial=0) for c in cells)) + 2)
    wet = np.zeros(shape, bool)
    wet[tuple(cells[0].T)] = True
    for axis in range(len(shape)):  # and the cells beside
        wet |= np.roll(wet, 1, axis) | np.roll(wet, -1, axis)
    return wet[tuple(cells[1].T)]


def work_of(layout: Layout, support: float) -> np.ndarray:
    """Work (n + b,) of the fluid and boundary particles, that of a fluid particle 1."""
    boundary = np.where(near_fluid(layout, support), WEIGHTS["wet"], WEIGHTS["dry"])
    return np.concatenate([np.full(len(layout.position), WEIGHTS["fluid"]), boundary])


def shared_work(boxes: Decomposition, fluid: np.ndarray, boundary: np.ndarray, each: np.ndarray) -> np.ndarray:
    """Work (ranks,) in the boxes of fluid (n, dim), 1 a particle, and of boundary particles (b, dim) that take `each` (b,)."""
    work = np.zeros(boxes.size)  # `bincount` gives integers where there is nothing to count, whatever its weights
    work += np.bincount(boxes.rank_of(fluid), minlength=boxes.size)
    return work + np.bincount(boxes.rank_of(boundary), each, boxes.size)


@dataclass(frozen=True)
class Share:
    """What one rank holds: fluid and boundary particles, the ghosts around, and its work."""

    fluid: int
    boundary: int
    ghosts: int
    work: float


def shares(scene: Scene, layout: Layout, decomposition: Decomposition, ghosts: bool = True) -> list[Share]:
    """What the ranks hold at the start; the ghosts are left out, and 0, where they are not wanted."""
    work = work_of(layout, 2 * scene.smoothing_length)
    width = 4.05 * scene.smoothing_length
    of, walls = decomposition.rank_of(layout.position), decomposition.rank_of(layout.boundary)
    ranks = np.concatenate([of, walls])
    totals = np.bincount(ranks, work, decomposition.size)
    counts, bounds = (np.bincount(kind, minlength=decomposition.size) for kind in (of, walls))
    around = counts.copy()
    for rank in range(decomposition.size) if ghosts else ():
        low, high = decomposition.box(rank)
        around[rank] = ((layout.position >= low - width) & (layout.position <= high + width)).all(1).sum()
    found = zip(counts, bounds, around - counts, totals, strict=True)
    return [Share(int(fluid), int(wall), int(ghost), float(total)) for fluid, wall, ghost, total in found]


def measured_weights(table: np.ndarray) -> np.ndarray:
    """Weights (kinds,) of a fluid particle, 1, and of boundary particles near fluid and far from it, from the numbers of them
    on each rank and the processor time of a step that it took, table (ranks, kinds + 1): least squares, held to `WEIGHTS` as
    far as the ranks do not tell otherwise, which are alike or few. A step takes SERIAL [s] of its own."""
    numbers, busy = table[:, :-1], table[:, -1] - SERIAL
    known = np.array(list(WEIGHTS.values()))
    total = (numbers @ known).sum()
    if total <= 0 or busy.min() <= SERIAL:  # the particles cost less than the rest
        return known
    known = known * busy.sum() / total  # [s]
    mean = busy.mean()
    rows = np.concatenate([numbers * known / mean, HOLD * np.eye(len(known))])
    share = np.linalg.lstsq(rows, np.concatenate([busy / mean, np.full(len(known), HOLD)]), rcond=None)[0]
    found = known * np.clip(share, 0.25, 4.0)
    return found / found[0]


class Balancer:
    """Looks at the balance of a run every EVERY steps, and moves the boxes where the work of a rank has drifted since the last
    time by more than a share of the mean. That share falls after a move that paid and rises after one that did not, by the
    time that the slowest rank took for a step before and after. What a particle of each kind weighs is measured.

    history: of each move the step, the share, the imbalances of work before it and planned, the weights, and the times [s] of a
    step on the slowest rank before and after it.
    """

    def __init__(self, scene: Scene, ranks: Ranks, halo: RankHalo):
        self._ranks, self.halo, self._planes = ranks, halo, planes_of(scene)
        self._support, self._drift = 2 * scene.smoothing_length, DRIFT
        self._last: np.ndarray | None = None  # work of each rank after the last move
        self._steps, self._busy, self._unknown = 0, 0.0, False
        self.history: list[dict] = []

    @property
    def moves(self) -> int:
        return len(self.history)

    def __call__(self, sim, busy: float) -> None:
        """After a step that took this rank so many seconds of processor time."""
        self._steps, self._busy = self._steps + 1, self._busy + busy
        if self._steps % EVERY or self._ranks.size == 1:
            return
        fluid, halo = sim.fluid, self.halo
        boundary = fluid.boundary[halo.holds(fluid.boundary)]
        wet = near(fluid.position, boundary, self._support)
        table = np.zeros((self._ranks.size, len(WEIGHTS) + 1))
        table[self._ranks.rank] = fluid.count, wet.sum(), (~wet).sum(), self._busy / EVERY
        table = self._ranks.reduce(table)
        self._busy, weights, slowest = 0.0, measured_weights(table), float(table[:, -1].max())
        work = table[:, :-1] @ weights
        if self._unknown:
            self._learn(slowest)
        self._last = work if self._last is None else self._last
        drift = np.abs(work - self._last).max() / work.mean()
        if drift > self._drift or imbalance(work) > 1 + 2 * self._drift:
            each = np.where(wet, weights[1], weights[2])
            self._move(fluid.position, boundary, each, imbalance(work), weights, slowest)

    def _learn(self, slowest: float) -> None:
        """Whether the last move paid."""
        move, self._unknown = self.history[-1], False
        move["after"] = slowest
        factor = EAGER if slowest < move["before"] else PATIENT
        self._drift = min(MOST, max(LEAST, self._drift * factor))

    def _move(self, position, boundary, each, before: float, weights: np.ndarray, slowest: float) -> None:
        """Move the boxes to where the work is the same in all departments; each (b,): that of the boundary particles."""

        def count(axis: int, planes: np.ndarray) -> np.ndarray:
            mine = _counts(position[:, axis], None, planes) + _counts(boundary[:, axis], each, planes)
            return self._ranks.reduce(mine)

        new = self.halo.decomposition.balanced(self._planes, count)
        self._last = None
        if all(np.array_equal(a, b) for a, b in zip(new.cuts, self.halo.decomposition.cuts, strict=True)):
            return
        after = imbalance(self._ranks.reduce(shared_work(new, position, boundary, each)))
        pays = after <= before - 0.5 * self._drift  # else whole slices bring no more
        if not self._ranks.broadcast(pays):  # all ranks have the same boxes, whatever each has computed
            return
        self.halo.decide(new)
        self._unknown = True
        self.history.append({
            "step": self._steps, "drift": self._drift, "imbalance": before, "planned": after,
            "weights": weights.tolist(), "before": slowest,
        })  # fmt: skip
