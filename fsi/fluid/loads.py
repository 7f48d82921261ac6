"""Loads of the fluid on named parts of what does not move: force, torque and pressure centre."""

from __future__ import annotations

import numpy as np

from fsi.scene.model import Scene

LEAST = 1e-9  # share of the largest force, below which a load has no centre


class FixedLoads:
    """The loads of a scene; weight (loads, b, dim): share of each force that counts, see `fsi.particles.loads`.

    Impulses of the wall guard are booked by owner. For these the fixed particles have an owner of their own for every
    combination of shares, from -1 down, whose rows are the last ones, counted from the end: all that the guard asks
    of an owner is whether it is fixed (0 or less)."""

    def __init__(self, scene: Scene, weight: np.ndarray, owners: int):
        self._weight, self._owners, self._scene = weight, owners, scene
        dim = scene.dimension
        self._axes = [0, 2] if dim == 2 else [0, 1, 2]
        kinds, self._kind = np.unique(
            weight.transpose(1, 0, 2).reshape(weight.shape[1], -1), axis=0, return_inverse=True
        )
        self._kind = self._kind.reshape(-1)
        self._kinds = kinds.reshape(len(kinds), len(weight), dim)  # shares (kinds, loads, dim)
        self._about = np.zeros((len(weight), 3))
        for n, load in enumerate(scene.loads.values()):
            if load.about is not None:
                self._about[n, self._axes] = load.about
        self._stopped = np.zeros((len(kinds), 6))

    def booked(self, solids) -> tuple[np.ndarray, np.ndarray]:
        """Owner (count,) and centre (owners + kinds, dim) for the wall guard."""
        owner = solids.owner.copy()
        kind = self._kind[solids.order]
        fixed = owner[: len(kind)] == 0
        owner[: len(kind)][fixed] = -1 - kind[fixed]
        return owner, np.concatenate([solids.centre, np.zeros((len(self._kinds), solids.dim))])

    def unbooked(self, impulse: np.ndarray) -> np.ndarray:
        """Impulses (owners, 6) out of those (owners + kinds, 6) that were booked; those of the kinds are kept for `measure`."""
        self._stopped = impulse[: self._owners - 1 : -1]  # about the origin, as is that of the walls
        impulse = impulse[: self._owners].copy()
        impulse[0] += self._stopped.sum(0)
        return impulse

    def open(self, fluid) -> None:
        """Note the forces of a step: called between its pressure and the corrector."""
        solids = fluid.solids
        force = fluid.felt()
        number, position = solids.order, solids.position[: solids.count]
        held = solids.held & self._weight[:, number].any((0, 2))
        rows = fluid.reductions.together(number[held], position[held], force[:, held].swapaxes(0, 1))
        number, position, force = (values[np.argsort(rows[0])] for values in rows)
        order = fluid.grid.order(position)
        number, position, force = number[order], position[order], force[order].swapaxes(0, 1)
        weight = self._weight[:, number]
        push, drag = weight * force[0], weight * force[1]
        total = push.sum(1)
        along = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
        part = np.einsum("pbd,pd->pb", push, along)
        moment = np.einsum("pb,bd->pd", part, position)
        arm, load = (np.zeros((*push.shape[:2], 3)) for _ in range(2))
        arm[..., self._axes] = position - self._about[:, None, self._axes]
        load[..., self._axes] = push + drag
        sums = np.concatenate([load.sum(1), np.cross(arm, load).sum(1), moment, total], axis=1)
        self._sums = sums, np.abs(push).sum((1, 2))

    def measure(self, dt: float) -> dict[str, np.ndarray]:
        """`load_force`, `load_torque`, `load_centre`, each (loads, 3), of the step of dt [s] that was closed last. The torque
        is about the point of the load; the centre is that of the pressure along its resultant, nan where there is none.
        What the wall guard stopped in the step counts with it."""
        sums, size = self._sums
        dim = self._scene.dimension
        force, torque = sums[:, :3].copy(), sums[:, 3:6].copy()
        moment, total = sums[:, 6 : 6 + dim], np.linalg.norm(sums[:, 6 + dim :], axis=1)
        for share, stopped in zip(self._kinds, self._stopped / dt, strict=True):
            full = np.zeros((len(share), 3))
            full[:, self._axes] = share
            push = full * stopped[:3]
            force += push
            torque += share.mean(1)[:, None] * stopped[3:] - np.cross(self._about, push)
        centre = np.full((len(force), 3), np.nan)
        there = total > LEAST * np.maximum(size, 1e-300)
        centre[there] = 0.0
        centre[np.ix_(there, self._axes)] = moment[there] / total[there, None]
        for n, load in enumerate(self._scene.loads.values()):
            side = load.on or ""
            if there[n] and side in self._scene.tank.walls:  # behind it stand layers of particles; the face is meant
                d = self._scene.tank.axes.index(side[0])
                centre[n, self._axes[d]] = (self._scene.tank.min if side[1] == "-" else self._scene.tank.max)[d]
        return {"load_force": force, "load_torque": torque, "load_centre": centre}

    def nothing(self) -> dict[str, np.ndarray]:
        """The same before the first step, when nothing has been measured."""
        return {name: np.full((len(self._weight), 3), np.nan) for name in ("load_force", "load_torque", "load_centre")}

    @property
    def nbytes(self) -> int:
        return self._weight.nbytes + self._kind.nbytes
