"""The open sea around a box of fluid: walls that move as the water of the incident waves does, and zones along the sides of
the box in which the water is drawn to these waves, so that what bodies send out leaves.

In a zone du/dt = rate s^2 (u_waves - u), with s from 0 at its inner edge to 1 at the wall (forcing zones: Peric &
Abdel-Maksoud 2018; in SPH: Altomare et al. 2018). It acts on the velocities before the pressure is solved, which then
keeps the water incompressible; the surface follows.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.compute.jit import exact
from fsi.compute.lanes import claim
from fsi.compute.reduce import Reductions
from fsi.compute.team import Team, chunk_bounds
from fsi.owners import PISTON
from fsi.particles.state import BoundaryState, ParticleState
from fsi.scene.geometry import incident_waves, sea_sides, sea_zone
from fsi.scene.model import Scene
from fsi.sph import columns
from fsi.waves.incident import Paddle, Table

NODES = 12  # of the table over the length of the shortest wave that counts
COUNTS = 0.01  # velocity from which on a component does, over the largest
COUNTED = (
    2.0**40
)  # parts of 1 m/s and of 1 m2/s2 in which gains are counted: millions of particles have room for several
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
        self._along = self.waves.along(dim)
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
        place = np.clip(self._home[:, :-1], low, high) @ self._along
        height = np.minimum(self._home[:, -1] - self._level, self._top)
        s, self._column = np.unique(np.round(place, 9), return_inverse=True)
        z, self._row = np.unique(np.round(height, 9), return_inverse=True)
        self._paddle = Paddle(self.waves, s, z)

    def _make_table(self, low: np.ndarray, high: np.ndarray) -> None:
        """The water's velocity on nodes over the whole box, and one more all around for cubics."""
        waves = self.waves
        speed = np.abs(waves.k * waves.potential * waves.omega)
        self._step = 2 * math.pi / float(waves.k[speed > COUNTS * speed.max()].max()) / NODES
        far = waves.excursion + np.maximum(low * self._along, high * self._along).sum()
        near = -waves.excursion + np.minimum(low * self._along, high * self._along).sum()
        self._first = np.array([near, -waves.depth]) - self._step
        counts = [math.ceil(span / self._step) + 3 for span in (far - near, waves.depth + self._top)]
        nodes = [x + self._step * np.arange(n) for x, n in zip(self._first, counts, strict=True)]
        self._table = Table(waves, *nodes)

    def place(self, placed: BoundaryState, time: float) -> None:
        """Put the moving walls where they are at `time` [s], and the waves of the zones."""
        shift, speed, acceleration, up, rising = (x[self._column, self._row] for x in self._paddle.at(time))
        position = self._home.copy()
        position[:, :-1] += np.outer(shift, self._along)
        velocity, water, bent = (np.zeros_like(position) for _ in range(3))
        velocity[:, :-1], bent[:, :-1] = np.outer(speed, self._along), np.outer(acceleration, self._along)
        water[:, :-1], water[:, -1], bent[:, -1] = velocity[:, :-1], up, rising
        placed.place(PISTON, position, velocity, water)
        if placed.acceleration is None:
            placed.acceleration = np.zeros_like(placed.position)
        placed.acceleration[placed.of_owner(PISTON)] = bent
        self._velocities = np.ascontiguousarray(self._table.at(time, 1))
        self._flow = self.waves.mean_flow(time)

    def draw(self, particles: ParticleState, dt: float, team: Team, reductions: Reductions) -> None:
        """Draw the fluid in the zones to the waves over a step of dt [s]."""
        bounds = chunk_bounds(particles.count)
        sums = np.zeros((len(bounds) - 1, particles.position.shape[1] + 1), np.int64)
        team.run(
            relax, bounds, particles.position, particles.velocity, particles.label, self._low, self._high, self._width,
            self._rate * dt, self._along, self._first, self._step, self._level, self._velocities, self._flow, sums,
        )  # fmt: skip
        total = self._mass * reductions.total(sums) / COUNTED
        self.impulse, self.given = total[:-1], float(total[-1])

    def work(self, fluid) -> None:
        """Find the power of the walls under the final pressure of a step."""
        solids, field = fluid.solids, fluid.work.field
        force = solids.felt(field, columns.field(fluid.dim).p, fluid.work.flow).sum(0)
        moving = solids.owner[: solids.count] == PISTON
        speed = solids.velocity[: solids.count][moving] + 0.5 * fluid.dt * solids.bent[moving]
        speed[:, -1] = 0.0  # they stay at their height
        mine = solids.held[moving]
        power = (force[moving] * speed).sum(1)[mine], solids.order[moving][mine]
        power, number = fluid.reductions.together(*power)
        self.power = -float(power[np.argsort(number)].sum())


@exact
def relax(
    counter, bounds, position, velocity, label, low, high, width, strength, along, first, step, level, table, flow, sums
):
    """Draw velocities (n, dim) to those of `table` (2, m, l), along the heading and upward, on nodes from `first` (2,) on, plus
    `flow` along the heading; into `sums` (chunks, dim + 1) velocity and velocity^2 / 2 that own particles gained, as integers,
    whose sum does not depend on the order, COUNTED to a unit. `strength`: rate times time step."""
    axes = along.size
    weight, node = np.empty((2, 4)), np.empty(2, np.int64)
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            into = 0.0
            for d in range(axes):
                into = max(into, 1 - (position[i, d] - low[d]) / width, 1 - (high[d] - position[i, d]) / width)
            if into <= 0.0:
                continue
            s = 0.0
            for d in range(axes):
                s += position[i, d] * along[d]
            for e in range(2):
                x = ((s if e == 0 else position[i, axes] - level) - first[e]) / step
                node[e] = min(max(int(x), 1), table.shape[1 + e] - 3)
                f = min(max(x - node[e], 0.0), 1.0)  # cubic of Catmull & Rom (1974)
                weight[e, 0] = f * (-0.5 + f * (1 - 0.5 * f))
                weight[e, 1] = 1 + f * f * (1.5 * f - 2.5)
                weight[e, 2] = f * (0.5 + f * (2 - 1.5 * f))
                weight[e, 3] = f * f * (0.5 * f - 0.5)
            ahead, up = flow, 0.0
            for a in range(4):
                for b in range(4):
                    w = weight[0, a] * weight[1, b]
                    ahead += w * table[0, node[0] - 1 + a, node[1] - 1 + b]
                    up += w * table[1, node[0] - 1 + a, node[1] - 1 + b]
            share = 1 - math.exp(-strength * min(into, 1.0) ** 2)
            gained = 0.0
            for d in range(axes + 1):
                wanted = up if d == axes else ahead * along[d]
                change = share * (wanted - velocity[i, d])
                gained += change * (velocity[i, d] + 0.5 * change)
                velocity[i, d] += change
                if label[i] >= 0:
                    sums[c, d] += np.int64(np.rint(COUNTED * change))
            if label[i] >= 0:
                sums[c, axes + 1] += np.int64(np.rint(COUNTED * gained))
