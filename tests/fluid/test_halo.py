"""A second halo besides that of periodic axes: a fluid in two halves, each with a thread of its own, that know each other
through `Halo` and `Reductions` alone. It is to a fluid in one piece what ranks are to be."""

from threading import Barrier, Thread

import numpy as np
import pytest

from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import build
from fsi.scene.model import Scene

CUT, DR, STEPS = 0.5, 0.05, 12


class Exchange:
    """Two sides that give each other something at the same time."""

    def __init__(self):
        self._barrier, self._board = Barrier(2, timeout=60), [None, None]

    def __call__(self, side: int, given):
        self._board[side] = given
        self._barrier.wait()
        got = self._board[1 - side]
        self._barrier.wait()
        return got

    def abort(self):
        self._barrier.abort()


class Half:
    """The halo of one side of x = CUT."""

    room = 2.0

    def __init__(self, side, swap, width):
        self._side, self._swap, self._width = side, swap, width

    def holds(self, position):
        return (position[:, 0] < CUT) == (self._side == 0)

    def exchange(self, particles):
        self.drop(particles)
        mine = self.holds(particles.position)
        away = [getattr(particles, name)[~mine] for name in particles.NAMES]
        particles.keep(mine)
        particles.append(*self._swap(self._side, away))
        self._own = particles.count
        self._near = np.flatnonzero(np.abs(particles.position[:, 0] - CUT) < self._width)
        given = [getattr(particles, name)[self._near] for name in particles.NAMES[:3]]
        particles.append_ghosts(*self._swap(self._side, given))
        return self._own

    def locate(self, order, sort):
        row = np.empty(len(order), int)
        row[order] = np.arange(len(order))
        assert sort.inside == len(order)
        self._sources, self._ghosts = row[self._near], row[self._own :]
        return len(self._ghosts)

    def idle(self):
        return np.empty(0, bool)

    def refresh(self, rows, columns):
        rows[self._ghosts, columns] = self._swap(self._side, rows[self._sources, columns].copy())

    def sweep(self, run, near, rows, columns):
        run(near.bounds, near.groups)
        self.refresh(rows, columns)

    def expected(self, count):
        return count

    def nearby(self, placed):
        return None

    def drop(self, particles):
        own = particles.own
        particles.keep(own)
        return own


class TwoSums(Reductions):
    """Reductions over both sides, in the order of the sides."""

    def __init__(self, side, swap):
        self._side, self._swap = side, swap

    def _both(self, mine):
        other = self._swap(self._side, mine)
        return (mine, other) if self._side == 0 else (other, mine)

    def combined(self, part):
        first, second = self._both(part)
        return first + second

    def total(self, values):
        return self.combined(values.sum(0))

    def largest_of(self, part):
        return max(self._both(part))

    def loads(self, add, placed, order, position, owner, forces, wrenches):
        here = np.zeros_like(wrenches)
        super().loads(add, placed, order, position, owner, forces, here)
        wrenches += self.combined(here)

    def largest(self, values, least=0.0):
        return np.maximum(*self._both(values.max(0, initial=least)))


def layout_of(**parts):
    scene = Scene.model_validate(
        {
            "spacing": DR,
            "duration": 1.0,
            "tank": {"min": [0, 0], "max": [1, 0.6]},
            "fluid": {"still_water_level": 0.4, "kinematic_viscosity": 1e-2},
            "numerics": {"precision": "double"} | parts,
        }
    )
    layout = build(scene)
    layout.owner[:] = 1  # so that the wrench on the whole tank is asked for
    layout.velocity[:, 0] = 16 * (layout.position[:, 1] - 0.2) * layout.position[:, 0] * (1 - layout.position[:, 0])
    return scene, layout


def run(fluid):
    """Some steps; wrenches, responses and sums of each, then positions and pressures in the order of the labels."""
    still, found = np.zeros((2, 6)), []
    units = np.zeros((1, 2, 6))
    units[0, 1, 0] = 1.0
    for _ in range(STEPS):
        fluid.begin(5e-3, still[:, :3], still)
        fluid.predict()
        wrench, _, changes = fluid.respond(still, units)
        sums, impulse = fluid.correct()
        found.append(np.concatenate([a.ravel() for a in (wrench, changes, sums, impulse)]))
    return np.array(found), fluid.particles.state(), fluid.lost


@pytest.mark.parametrize("parts", [{}, {"solver": "explicit", "sweeps": 1}, {"solver": "converged"}])
def test_a_fluid_in_two_halves_moves_like_a_whole_one(parts, tolerance=1e-9):
    scene, layout = layout_of(**parts)
    whole, together, lost = run(Fluid(scene, layout, Team(1)))
    swap, halves = Exchange(), [None, None]

    def side(number):
        try:
            halo = Half(number, swap, 4.05 * scene.smoothing_length)
            fluid = Fluid(scene, layout, Team(1), halo, TwoSums(number, swap))
            fluid.particles.keep(halo.holds(fluid.position))
            halves[number] = run(fluid)
        except BaseException:
            swap.abort()
            raise

    threads = [Thread(target=side, args=(number,)) for number in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (one, left, _), (two, right, _) = halves
    assert np.array_equal(one, two)  # both know the same
    scale = np.abs(whole).reshape(STEPS, -1).max(0) + 1e-3 * np.abs(whole).max()
    assert (np.abs(one - whole) / scale).max() < tolerance
    labels = np.concatenate([left["label"], right["label"]])
    assert set(left["label"]) != set(np.flatnonzero(layout.position[:, 0] < CUT))  # some have changed sides
    assert sorted(labels) == sorted(together["label"]) and lost == 0
    for name in ("position", "velocity", "pressure"):
        both = np.concatenate([left[name], right[name]])[np.argsort(labels)]
        alone = together[name][np.argsort(together["label"])]
        assert np.abs(both - alone).max() < tolerance * np.abs(alone).max()
