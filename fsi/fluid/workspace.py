"""The memory of a step: packed rows and scratch, of which nothing is remembered for the next one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsi.scene.model import Scene
from fsi.sph import columns

PADDING = 16  # rows behind the last one, for vectors that are loaded whole
MORE_BOUNDARY = 1.1  # room for boundary particles over those that are near the fluid, which will be more


class Arena:
    """One piece of memory for arrays of which one stands at a time: `begin` ends the one before. Each is given by its shape
    and type; asking for one that does not stand is an error of the program (RuntimeError)."""

    def __init__(self, **arrays: tuple[tuple[int, ...], type]):
        sizes = {name: int(np.prod(shape)) * np.dtype(kind).itemsize for name, (shape, kind) in arrays.items()}
        self._memory = np.zeros(max(sizes.values()), np.uint8)
        self._arrays = {
            name: self._memory[: sizes[name]].view(kind).reshape(shape) for name, (shape, kind) in arrays.items()
        }
        self._standing = ""

    def begin(self, name: str) -> np.ndarray:
        """The named array; what it holds is undefined."""
        self._standing = name
        return self._arrays[name]

    def __getitem__(self, name: str) -> np.ndarray:
        if name != self._standing:
            raise RuntimeError(f"the array {name!r} does not stand, {self._standing!r} does")
        return self._arrays[name]

    @property
    def nbytes(self) -> int:
        return self._memory.nbytes


class Workspace:
    """Owns the packed rows of fluid and boundary (`fsi.sph.columns`) and what a step needs besides:

    | array | holds | stands from | to |
    |---|---|---|---|
    | orders | order of cells, int32 | sort | pack |
    | xs (dim, rows) | positions relative to the grid, single precision | pack | neighbours |
    | coefficients (n, .) | of the pressure equation | neighbours | corrector |
    | flow, trial, field (rows, .) | see `fsi.sph.columns` | pack | next pack |
    | twin (rows, .) | the pressures before those in `field` | pack | next pack |
    | strains (n, .) | strain rates of the fluid | predictor | its end |
    | responses 2 x (rows, m) | pressures of linear responses | asked for | next pack |

    The first three stand one after another and share an `Arena`. Where nothing is viscous, only the positions of `flow` are
    read, and `trial`, which holds them too, is given out for it. Where a step has one sweep, nothing reads the pressures
    before, and `field` is given out for `twin`.
    """

    def __init__(
        self, scene: Scene, boundary: int, dtype, orders: Callable[[int, int], int], *, viscous: bool, varies: bool,
        dense: bool, two_fields: bool, spare: float, artificial: str = "none",
    ):  # fmt: skip
        """boundary: its particles, at most; orders: numbers that sorting so many of fluid and boundary takes; viscous, varies:
        whether there is viscosity of the liquids, and of several values; artificial: viscosity, as `fsi.sph.predictor` has it;
        dense: unequal densities; two_fields: more than one sweep; spare: room to keep for more fluid particles, as a factor."""
        dim = self._dim = scene.dimension
        shifts = scene.shifting > 0
        self._widths = {
            "trial": columns.trial(dim).width("filled" if shifts and not scene.closed else "r" if dense else "u"),
            "flow": columns.flow(dim).width("r" if dense else "mu" if varies else "u"),
            "field": columns.field(dim).width("r" if dense else "p"),
            "strains": columns.strain(dim).width("tensor") * (artificial == "linear"),
            "coefficients": columns.COEFFICIENTS.width("support" if shifts else "inner" if scene.closed else "counts"),
        }
        self._most, self._dtype, self._orders, self._spare = boundary, dtype, orders, spare
        self._viscous, self._two_fields = viscous or artificial != "none", two_fields
        self._capacity, self._boundary = -1, 0
        self._responses: tuple[np.ndarray, ...] = ()

    def reserve(self, count: int, boundary: int = 0) -> None:
        """Make room for so many particles of the fluid, ghosts included, and of the boundary; what stood is lost where there
        was not enough."""
        if count <= self._capacity and boundary <= self._boundary:
            return
        if count > self._capacity:
            self._capacity = int(self._spare * count)
        if boundary > self._boundary:
            self._boundary = min(self._most, int(MORE_BOUNDARY * boundary))
        n, b = self._capacity, self._boundary
        rows = n + b + PADDING
        self.arena = None  # before new memory is taken
        self.trial = self.field = self._flow = self._twin = self.strains = None
        self._responses = ()
        self.arena = Arena(
            orders=((self._orders(n, b),), np.int32),
            xs=((self._dim, rows), np.float32),
            coefficients=((n, self._widths["coefficients"]), self._dtype),
        )
        self.trial = self._rows("trial", rows)
        self._flow = self._rows("flow", rows) if self._viscous else None
        self.field = self._rows("field", rows)
        self._twin = self._rows("field", rows) if self._two_fields else None
        self.strains = self._rows("strains", n + PADDING)

    def _rows(self, name: str, rows: int) -> np.ndarray:
        return np.zeros((rows, self._widths[name]), self._dtype)

    @property
    def coefficients(self) -> np.ndarray:
        return self.arena["coefficients"]

    @property
    def flow(self) -> np.ndarray:
        return self.trial if self._flow is None else self._flow

    @flow.setter
    def flow(self, rows: np.ndarray) -> None:
        self._flow = rows

    @property
    def twin(self) -> np.ndarray:
        return self.field if self._twin is None else self._twin

    @property
    def packed(self) -> tuple[np.ndarray, ...]:
        """flow, trial, field, twin: all that hold positions."""
        return self.flow, self.trial, self.field, self.twin

    def swap(self) -> None:
        """After a sweep from `field` into `twin`: its result becomes `field`."""
        self.field, self._twin = self.twin, self.field

    def part(self) -> None:
        """Let `twin` be what `field` is now, in memory of its own, for a step of more sweeps than usual (`join` ends it)."""
        if self._twin is None:
            self._twin = self.field.copy()
        else:
            self._twin[:] = self.field

    def join(self) -> None:
        if not self._two_fields:
            self._twin = None

    def responses(self, columns: int) -> tuple[np.ndarray, ...]:
        """Two arrays (rows, columns) for linear responses, the same ones for the same number of columns."""
        if not self._responses or self._responses[0].shape[1] != columns:
            self._responses = ()
            self._responses = tuple(np.zeros((len(self.field), columns), self._dtype) for _ in range(2))
        return self._responses

    @property
    def nbytes(self) -> dict[str, int]:
        """Memory [B] of the packed rows, the arena and the responses."""
        rows = (self.trial, self._flow, self.field, self._twin, self.strains)
        return {
            "rows": sum(a.nbytes for a in rows if a is not None),
            "arena": self.arena.nbytes,
            "responses": sum(a.nbytes for a in self._responses),
        }
