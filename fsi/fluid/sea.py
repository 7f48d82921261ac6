"""The open sea around a box of fluid: walls that move as the water of the incident waves does, and zones along the sides of
the box in which the water is drawn to these waves, so that what bodies send out leaves.

In a zone du/dt = rate s (u_waves - u), with s from 0 at its inner edge to 1 at the wall (forcing zones: Peric &
Abdel-Maksoud 2018; in SPH: Altomare et al. 2018; the rate: docs/guide/waves.md). It acts on the velocities
before the pressure is solved, which then keeps the water incompressible; the surface follows.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.compute.jit import exact, helper
from fsi.compute.lanes import claim
from fsi.compute.reduce import Reductions
from fsi.compute.team import Team, chunk_bounds
from fsi.owners import PISTON
from fsi.particles.state import BoundaryState, ParticleState
from fsi.scene.geometry import incident_waves, sea_sides, sea_zone
from fsi.scene.model import Scene
from fsi.waves.incident import XI, ZETA, Paddle, Table

NODES = 12  # of the table over the length of the shortest wave that counts, of one direction
SPREAD_NODES = 8  # the same of many
COUNTS = 0.01  # velocity from which on a component does, over the largest
COUNTED = 2.0**40  # parts of 1 m/s and 1 m2/s2 in which gains are counted: millions of particles have room for several
ABOVE = 1.3  # crests up to which the theory is asked [crest]; higher up it goes on as it is there


class Sea:
    """The walls and the zones of a scene's sea at one instant after the other. Pure functions of time: it remembers nothing.

    Of the last step: `impulse` (dim,) [N s] and `given` [J], what the zones gave the fluid; `power` [W], what the walls did."""

    def __init__(self, scene: Scene, placed: BoundaryState, mass: float):
        self.waves, self._level, self._mass, dim = (
            incident_waves(scene),
            scene.fluid.still_water_level,
            mass,
            scene.dimension,
        )
        self._width, self._rate = sea_zone(scene)
        low, high = np.array(scene.tank.min)[:-1], np.array(scene.tank.max)[:-1]
        self._frame = self.waves.frame(dim)
        self._top = ABOVE * self.waves.crest
        sides = sea_sides(scene)
        self._low = np.array([x if f"{a}-" in sides else -math.inf for a, x in zip("xy", low, strict=False)])
        self._high = np.array([x if f"{a}+" in sides else math.inf for a, x in zip("xy", high, strict=False)])
        self._make_walls(placed, low, high)
        self._make_table(low, high)
        self.impulse, self.given, self.power = np.zeros(dim), 0.0, 0.0

    def _make_walls(self, placed: BoundaryState, low: np.ndarray, high: np.ndarray) -> None:
        """A paddle through the face of each moving wall; the layers behind it move as one."""
        self._home = placed.position[placed.of_owner(PISTON)].copy()
        placed.facing[placed.of_owner(PISTON)] = 0  # their acceleration along themselves is the waves', see `place`
        place = np.clip(self._home[:, :-1], low, high) @ self._frame.T
        height = np.minimum(self._home[:, -1] - self._level, self._top)
        s, column = np.unique(np.round(place, 9), axis=0, return_inverse=True)
        z, self._row = np.unique(np.round(height, 9), return_inverse=True)
        kind = Paddle
        if self.waves.free:
            from fsi.waves.second_order import GroupPaddle as kind
        self._column, self._paddle = column.ravel(), kind(self.waves, self._frame, s, z)

    def _make_table(self, low: np.ndarray, high: np.ndarray) -> None:
        """The water's velocity on nodes over the whole box, and one more all around for cubics."""
        waves, frame = self.waves, self._frame
        speed, most = np.abs(waves.k * waves.potential * waves.omega), waves.excursion
        nodes = NODES if len(frame) == 1 else SPREAD_NODES
        self._step = step = 2 * math.pi / float(waves.k[speed > COUNTS * speed.max()].max()) / nodes
        near = [np.minimum(low * way, high * way).sum() - most for way in frame] + [-waves.depth]
        far = [np.maximum(low * way, high * way).sum() + most for way in frame] + [self._top]
        self._first = np.array(near) - step
        *places, z = (
            x + step * np.arange(math.ceil((b - a) / step) + 3) for x, a, b in zip(self._first, near, far, strict=True)
        )
        self._nodes = (len(places[0]), len(places[1]) if len(places) > 1 else 1, len(z))
        places = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(frame))
        self._table = Table(waves, frame, places, z, [*map(XI, range(len(frame))), ZETA])

    def place(self, placed: BoundaryState, time: float, dt: float) -> None:
        """Put the moving walls where they are at `time` [s], before a step of dt [s], and the waves of the zones. There it is
        half a step earlier: positions move by the velocities after a step, so that those before it are of the middle of
        the last."""
        shift, speed, bend, up, rising = (x[..., self._column, self._row] for x in self._paddle.at(time))
        position = self._home.copy()
        position[:, :-1] += shift.T @ self._frame
        velocity, water, bent = (np.zeros_like(position) for _ in range(3))
        velocity[:, :-1], bent[:, :-1] = speed.T @ self._frame, bend.T @ self._frame
        water[:, :-1], water[:, -1], bent[:, -1] = velocity[:, :-1], up, rising
        placed.place(PISTON, position, velocity, water)
        if placed.acceleration is None:
            placed.acceleration = np.zeros_like(placed.position)
        placed.acceleration[placed.of_owner(PISTON)] = bent
        found = self._table.at(time - 0.5 * dt, 1)
        self._velocities = np.ascontiguousarray(found).reshape(len(found), *self._nodes)
        self._flow = self.waves.flow(time - 0.5 * dt, len(self.impulse))

    @property
    def products(self) -> int:
        """Multiplications of a step, for the waves at the walls and in the zones."""
        return self._table.products + self._paddle.products

    def draw(self, particles: ParticleState, dt: float, team: Team, reductions: Reductions) -> None:
        """Draw the fluid in the zones to the waves over a step of dt [s]."""
        bounds = chunk_bounds(particles.count)
        sums = np.zeros((len(bounds) - 1, particles.position.shape[1] + 1), np.int64)
        team.run(
            relax, bounds, particles.position, particles.velocity, particles.label, self._low, self._high, self._width,
            self._rate * dt, self._frame, self._first, self._step, self._level, self._velocities, self._flow, sums,
        )  # fmt: skip
        total = self._mass * reductions.total(sums) / COUNTED
        self.impulse, self.given = total[:-1], float(total[-1])

    def work(self, fluid) -> None:
        """Find the power of the walls under the final pressure of a step."""
        solids = fluid.solids
        force = fluid.felt().sum(0)
        moving = solids.owner[: solids.count] == PISTON
        speed = solids.velocity[: solids.count][moving] + 0.5 * fluid.dt * solids.bent[moving]
        speed[:, -1] = 0.0  # they stay at their height
        mine = solids.held[moving]
        power = (force[moving] * speed).sum(1)[mine], solids.order[moving][mine]
        power, number = fluid.reductions.together(*power)
        self.power = -float(power[np.argsort(number)].sum())


@exact
def relax(
    counter, bounds, position, velocity, label, low, high, width, strength, frame, first, step, level, table, flow, sums
):
    """Draw velocities (n, dim) to those of `table` (axes + 1, m, n, l), along the frame (axes, dim - 1) and upward, on nodes
    from `first` (axes + 1,) on, plus `flow` (dim - 1,); into `sums` (chunks, dim + 1) velocity and velocity^2 / 2 that own
    particles gained, as integers, whose sum does not depend on the order, COUNTED to a unit. `strength`: rate times time
    step. Waves of one direction have one node (n) across."""
    sides, axes = flow.size, frame.shape[0]
    across = 4 if axes > 1 else 1
    weight, node = np.ones((3, 4)), np.empty(3, np.int64)
    node[1] = 1
    wanted = np.empty(sides + 1)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            into = 0.0
            for d in range(sides):
                into = max(into, 1 - (position[i, d] - low[d]) / width, 1 - (high[d] - position[i, d]) / width)
            if into <= 0.0:
                continue
            for e in range(axes + 1):
                x = position[i, sides] - level
                if e < axes:
                    x = 0.0
                    for d in range(sides):
                        x += position[i, d] * frame[e, d]
                cubic(x, first[e], step, table.shape[3 if e == axes else 1 + e], weight, node, 2 if e == axes else e)
            for d in range(sides):
                wanted[d] = flow[d]
            wanted[sides] = 0.0
            for a in range(4):
                for b in range(across):
                    for z in range(4):
                        w = weight[0, a] * weight[1, b] * weight[2, z]
                        for e in range(axes + 1):
                            u = w * table[e, node[0] - 1 + a, node[1] - 1 + b, node[2] - 1 + z]
                            if e == axes:
                                wanted[sides] += u
                            else:
                                for d in range(sides):
                                    wanted[d] += u * frame[e, d]
            depth = min(into, 1.0)
            share = 1 - math.exp(-strength * depth)
            gained = 0.0
            for d in range(sides + 1):
                change = share * (wanted[d] - velocity[i, d])
                gained += change * (velocity[i, d] + 0.5 * change)
                velocity[i, d] += change
                if label[i] >= 0:
                    sums[c, d] += np.int64(np.rint(COUNTED * change))
            if label[i] >= 0:
                sums[c, sides + 1] += np.int64(np.rint(COUNTED * gained))


@helper()
def cubic(x, first, step, count, weight, node, row):
    """Node below x and weights of the four around it, of the cubic of Catmull & Rom (1974), into a row of `node`, `weight`."""
    x = (x - first) / step
    n = min(max(int(x), 1), count - 3)
    f = min(max(x - n, 0.0), 1.0)
    node[row] = n
    weight[row, 0] = f * (-0.5 + f * (1 - 0.5 * f))
    weight[row, 1] = 1 + f * f * (1.5 * f - 2.5)
    weight[row, 2] = f * (0.5 + f * (2 - 1.5 * f))
    weight[row, 3] = f * f * (0.5 * f - 0.5)
