"""Walls without gaps, corners once, solids cut out of the fluid, and the time step's limits."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.errors import SceneError
from fsi.fluid.timestep import TimeStep, to_reach
from fsi.owners import PISTON, WALL
from fsi.particles.layout import build


@pytest.mark.parametrize("dimension", [2, 3])
def test_fluid_and_walls_fill_a_lattice_without_gaps_or_doubles(dimension):
    scene = still_tank(dimension, 0.1, depth=0.5, length=0.6)
    layout = build(scene)
    everything = np.concatenate([layout.position, layout.boundary])
    cells = np.round(everything / 0.1 - 0.5).astype(int)
    assert np.abs(cells + 0.5 - everything / 0.1).max() < 1e-9
    assert len(np.unique(cells, axis=0)) == len(cells)
    under = cells[cells[:, -1] < 0]  # up to the still water level the box with its walls is full
    assert len(under) == (6 + 2 * scene.layers) ** (dimension - 1) * (5 + scene.layers)
    assert len(layout.position) == 6 ** (dimension - 1) * 5


@pytest.mark.parametrize("length", [0.63, 0.65, 0.67])
def test_a_tank_off_the_lattice_has_whole_cells_and_closed_edges(length):
    """At 6.5 spacings a particle once started on the far wall and was counted beyond it."""
    layout = build(still_tank(2, 0.1, depth=0.5, length=length))
    assert layout.position[:, 0].max() == pytest.approx(0.55)
    wall = layout.boundary
    gaps = np.sort(((wall[:, None] - wall[None]) ** 2).sum(-1), 1)[:, 1]
    assert np.sqrt(gaps.min()) / 0.1 > 0.9 and np.sqrt(gaps.max()) / 0.1 < 1.1
    assert (np.abs(wall[:, 0] - (length + 0.05)) < 1e-9).any()


def test_the_bed_reaches_under_a_retreating_piston():
    scene = still_tank(spacing=0.02, length=3.0, waves={"wave_height": 0.1, "period": 1.5})
    layout = build(scene)
    paddle, walls = layout.boundary[layout.owner == PISTON], layout.boundary[layout.owner == WALL]
    reach = layout.domain_min[0] + (scene.layers + 0.01) * 0.02
    assert paddle[:, 1].min() > -0.5 and paddle[:, 0].max() < 0
    bed = walls[walls[:, 1] < -0.5]
    assert bed[:, 0].min() < reach - 2 * 0.02


class Ball:
    """A disc of radius 0.2 at (0.5, -0.25)."""

    def boundary(self, spacing, layers):
        return np.array([[0.5, -0.25]])

    def clearance(self, points):
        return np.sqrt(((points - [0.5, -0.25]) ** 2).sum(1)) - 0.2


def test_a_solid_displaces_fluid():
    scene = still_tank(spacing=0.01)
    layout = build(scene, ground=Ball())
    missing = (100 * 50 - len(layout.position)) * 0.01**2
    assert missing == pytest.approx(np.pi * 0.2**2, rel=0.01)
    assert Ball().clearance(layout.position).min() > 0


def test_a_scene_without_fluid_is_refused():
    with pytest.raises(SceneError, match="no fluid particle"):
        build(still_tank(fluid={"blocks": [{"min": [0.001, -0.4], "max": [0.002, -0.3]}]}))


def test_each_limit_of_the_time_step_binds():
    numerics = {"solver": "explicit", "sweeps": 4}
    scene = still_tank(spacing=0.01, fluid={"kinematic_viscosity": 0.01}, numerics=numerics)
    limits = TimeStep(scene, depth=0.5)
    at_rest = limits.limits(0.0, 0.0)
    assert at_rest["sound"] == pytest.approx(0.378 * 0.02 * 2 * 0.2 / np.sqrt(9.81 * 0.5), rel=1e-3)
    assert at_rest["viscosity"] == pytest.approx(0.125 * 0.02**2 / 0.01)
    assert at_rest["speed"] == np.inf
    assert limits.choose(10.0, 0.0) == pytest.approx(0.2 * 0.02 / 10)
    assert limits.choose(0.0, 0.0) == pytest.approx(1.05 * 0.2 * 0.02 / 10)  # grows gently afterwards


def test_the_last_steps_reach_the_end_without_a_sliver():
    time, steps = 0.0, []
    while time < 1.0 - 1e-12:
        steps.append(to_reach(1.0, time, 0.3))
        time += steps[-1]
    assert time == pytest.approx(1.0, abs=1e-12) and min(steps) > 0.1
