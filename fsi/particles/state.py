"""What is known of the particles from one step to the next: of those of the fluid, and of those of the boundary.

No two of these arrays share memory.
"""

from __future__ import annotations

import numpy as np

from fsi.compute.team import Team
from fsi.particles.cells import whole
from fsi.particles.layout import Layout
from fsi.particles.rows import gather

GHOST = -1  # label of a particle that stands for one elsewhere, see `fsi.protocols.Halo`


class ParticleState:
    """The fluid particles. Owns position, velocity (n, dim) [m, m/s] in double precision, pressure (n,) [Pa] in that of the
    sweeps, and label (n,) int32, the number of each at t = 0 or GHOST. They are in the order of cells, once they have been
    sorted."""

    NAMES = ("position", "velocity", "pressure", "label")

    def __init__(self, layout: Layout, dtype, team: Team):
        self._team = team
        self.position, self.velocity = layout.position.copy(), layout.velocity.astype(float)
        self.pressure = layout.pressure.astype(dtype)
        self.label = np.arange(len(layout.position), dtype=np.int32)

    @property
    def count(self) -> int:
        """Particles, ghosts included while there are any."""
        return len(self.position)

    @property
    def own(self) -> np.ndarray:
        """True (n,) of those that are no ghosts."""
        return self.label >= 0

    def reorder(self, order: np.ndarray, count: int, scratch: np.ndarray | None = None) -> None:
        """Keep the first `count` particles in this order (n,), the number of the particle at each new place. scratch: memory
        that may be written, in which the largest array finds room; taken for the moment if not given."""
        if scratch is None:
            scratch = np.empty(self.count * self.position.itemsize * self.position.shape[1], np.uint8)
        scratch = scratch.reshape(-1).view(np.uint8)
        alike: dict[tuple, list[str]] = {}
        for name in self.NAMES:
            values = getattr(self, name)
            alike.setdefault((values.itemsize, values.shape[1:]), []).append(name)
        for names in alike.values():
            self._rotate(names, order, count, scratch)

    def _rotate(self, names: list[str], order: np.ndarray, count: int, scratch: np.ndarray) -> None:
        """Put arrays of one kind in order: the first into `scratch`, each other one into the memory of the one before it, and
        the first back into that of the last."""
        kinds = [getattr(self, name).dtype for name in names]
        bits = [(values := getattr(self, name)).view(f"u{values.itemsize}") for name in names]
        size, shape = bits[0].itemsize, (count, *bits[0].shape[1:])
        first = scratch[: size * int(np.prod(shape))].view(bits[0].dtype).reshape(shape)
        for old, new in zip(bits, [first, *bits], strict=False):
            if count:
                self._team.run(gather, whole(count), order, old.reshape(len(old), -1), new[:count].reshape(count, -1))
        bits[-1][:count] = first
        for name, values, kind in zip(names, [bits[-1], *bits], kinds, strict=False):
            setattr(self, name, values[:count].view(kind))

    def append(self, position: np.ndarray, velocity: np.ndarray, pressure: np.ndarray, label: np.ndarray) -> None:
        """Append particles, behind all others."""
        for name, more in zip(self.NAMES, (position, velocity, pressure, label), strict=True):
            setattr(self, name, np.concatenate([getattr(self, name), more]))

    def append_ghosts(self, position: np.ndarray, velocity: np.ndarray, pressure: np.ndarray) -> None:
        self.append(position, velocity, pressure, np.full(len(position), GHOST, self.label.dtype))

    def keep(self, chosen: np.ndarray) -> None:
        """Keep the chosen particles, True in (n,), and drop the others."""
        for name in self.NAMES:
            setattr(self, name, getattr(self, name)[chosen])

    def state(self) -> dict[str, np.ndarray]:
        """Copies of all arrays, for `restore`."""
        return {name: getattr(self, name).copy() for name in self.NAMES}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from `state`, bit for bit."""
        for name in self.NAMES:
            setattr(self, name, np.array(state[name], getattr(self, name).dtype))

    @property
    def nbytes(self) -> int:
        """Memory of the particles [B]."""
        return sum(_whole_size(getattr(self, name)) for name in self.NAMES)


class BoundaryState:
    """The boundary particles as they were placed last. Owns position, velocity (b, dim), owner (b,) in ascending order, normal
    (m, dim), outward, of those of bodies, which are the last m, and `skin` (b, dim), the velocity that viscosity feels, None
    where that is `velocity` (`BodyMotion.smooth`), and `acceleration` (b, dim) besides that of the owners, None without
    the flexible walls of a sea, which set it anew in each step. All are in the order of the layout, for the whole run, and so
    is `facing` (b - m, dim), which never changes: the normals of the others, as in `Layout`."""

    NAMES = ("position", "velocity", "owner", "normal", "skin")

    def __init__(self, layout: Layout):
        self.position, self.owner = layout.boundary.copy(), layout.owner.copy()
        self.velocity = np.zeros_like(self.position)
        self.normal = self.position[:0].copy() if layout.normal is None else layout.normal.copy()
        self.facing = np.zeros((0, self.position.shape[1]), np.int8) if layout.facing is None else layout.facing.copy()
        self.skin: np.ndarray | None = None
        self.acceleration: np.ndarray | None = None

    @property
    def felt(self) -> np.ndarray:
        """Velocity (b, dim) that viscosity feels."""
        return self.velocity if self.skin is None else self.skin

    def of_owner(self, owner: int) -> slice:
        """Boundary particles of an owner."""
        return slice(*np.searchsorted(self.owner, [owner, owner + 1]))

    def normal_of(self, owner: int) -> np.ndarray:
        """Normals (b, dim) of the boundary particles of a body, to be read and written."""
        chosen, fixed = self.of_owner(owner), len(self.owner) - len(self.normal)
        return self.normal[chosen.start - fixed : chosen.stop - fixed]

    def place(
        self, owner: int, position: np.ndarray, velocity: np.ndarray, skin: np.ndarray | None = None,
        normal: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Move the boundary particles of an owner: position and velocity (b, dim), `skin` where viscosity feels another
        velocity, and their normals where they turn."""
        chosen = self.of_owner(owner)
        self.position[chosen], self.velocity[chosen] = position, velocity
        if normal is not None:
            self.normal_of(owner)[:] = normal
        if skin is not None and self.skin is None:
            self.skin = self.velocity.copy()
        if self.skin is not None:
            self.skin[chosen] = velocity if skin is None else skin

    def state(self) -> dict[str, np.ndarray]:
        """Copies of all arrays that there are, for `restore`."""
        return {name: a.copy() for name in self.NAMES if (a := getattr(self, name)) is not None}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from `state`, bit for bit."""
        normal = self.normal
        for name in self.NAMES:
            setattr(self, name, np.array(state[name]) if name in state else None)
        if len(normal):  # those of all boundary particles, in states of long ago
            normal[:] = self.normal[-len(normal) :]
        self.normal = normal

    @property
    def nbytes(self) -> int:
        return sum(a.nbytes for name in self.NAMES if (a := getattr(self, name)) is not None)


def _whole_size(array: np.ndarray) -> int:
    """Size [B] of the memory that an array is part of."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array.nbytes
