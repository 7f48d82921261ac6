"""Walls without gaps, corners once, solids cut out of the fluid, and the time step's limits."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.errors import SceneError
from fsi.fluid.gauges import elevation
from fsi.fluid.timestep import TimeStep, to_reach
from fsi.owners import PISTON, WALL
from fsi.particles.layout import build
from fsi.scene.binding import bind
from fsi.scene.geometry import cell
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


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
def test_a_tank_off_the_lattice_is_full_and_has_closed_edges(length):
    """At 6.5 spacings a particle once started on the far wall and was counted beyond it, then half a spacing stayed empty."""
    layout = build(still_tank(2, 0.1, depth=0.5, length=length))
    half = 0.5 * length / round(length / 0.1)
    assert layout.position[:, 0].max() == pytest.approx(length - half)
    wall = layout.boundary
    gaps = np.sort(((wall[:, None] - wall[None]) ** 2).sum(-1), 1)[:, 1]
    assert np.sqrt(gaps.min()) / 0.1 > 0.9 and np.sqrt(gaps.max()) / 0.1 < 1.1
    assert (np.abs(wall[:, 0] - (length + half)) < 1e-9).any()


REFINED = np.linspace(0.011, 0.0197, 20)  # m; 15.2 to 27.3 spacings of depth


@pytest.mark.parametrize("dim", [2, 3])
def test_level_and_volume_are_right_at_any_spacing(dim):
    """At 30.53 spacings a gauge once read half a spacing too much, and the volume was 1.5 % too large."""
    depth, length = 0.3, 0.2 if dim == 3 else 0.5
    for spacing in REFINED:
        scene = still_tank(dim, spacing, depth, length)
        layout = build(scene)
        side = cell(scene)
        assert len(layout.position) * np.prod(side) == pytest.approx(depth * length ** (dim - 1), rel=1e-3)
        assert layout.position[:, -1].max() + 0.5 * side[-1] == pytest.approx(0.0, abs=0.02 * spacing)
        assert layout.pressure.min() == pytest.approx(9810 * 0.5 * side[-1], rel=0.05)
        surface = elevation(
            layout.position, (0.5 * length,) * (dim - 1), layout.volume ** (1 / dim), scene.smoothing_length
        )
        assert surface == pytest.approx(0.0, abs=0.02 * spacing)
        assert not layout.notes


@pytest.mark.parametrize("dim, spacing, sides", [(2, 0.02, 25), (3, 0.05, 4)])
def test_whole_numbers_of_spacings_leave_the_lattice_as_it_is(dim, spacing, sides):
    scene = still_tank(dim, spacing, 10 * spacing, sides * spacing + 1e-9)
    assert cell(scene) == (spacing,) * dim and build(scene).volume == spacing**dim


def test_a_block_ends_where_the_scene_says_and_others_are_told_of():
    blocks = [{"min": [0.0, -0.5], "max": [0.31, 0.13]}, {"min": [0.31, -0.5], "max": [1.0, -0.287]}]
    scene = still_tank(spacing=0.02, fluid={"blocks": blocks})
    layout = build(scene)
    assert layout.position[:, 1].max() + 0.5 * cell(scene)[1] == pytest.approx(0.13)
    assert [note.split(":")[0] for note in layout.notes] == ["fluid.blocks[0]", "fluid.blocks[1]", "fluid.blocks[1]"]


@pytest.mark.slow
@pytest.mark.parametrize("spacing", REFINED)
def test_the_level_stays_right_at_rest(spacing):
    sim = Simulation(still_tank(2, spacing, 0.3, 0.5, duration=1.0, gauges={"middle": {"x": 0.25}}))
    levels = []
    sim.run(on_step=lambda sim: levels.append(sim.balance.series()["elevation"][0]))
    assert np.mean(levels[len(levels) // 2 :]) == pytest.approx(0.0, abs=0.06 * spacing)
    middle = 2 * (sim.fluid.position[:, 1].mean() + 0.3) - 0.3  # twice the height of the centre is the level
    assert middle == pytest.approx(0.0, abs=0.03 * spacing)


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
    assert time == pytest.approx(1.0, abs=1e-12) and np.ptp(steps) < 1e-12 and len(steps) == 4


@pytest.mark.parametrize("until", [1.0, 0.2, 0.0415])
def test_no_step_is_cut_short_at_the_end(until):
    """The numerical sound speed goes as one over the step: half a step at the end jolts water at rest."""
    time, steps = 0.0, []
    while time < until * (1 - 1e-12):
        steps.append(to_reach(until, time, 0.004))
        time += steps[-1]
    assert time == pytest.approx(until, rel=1e-12) and min(steps) > 0.004 * 10 / 11


def test_ground_fills_the_edge_under_walls_that_end_with_the_tank(tmp_path):
    """Without a wall below, the ground beyond the side walls has no wall particles above it: fluid in the edge would lack a
    part of its support, and particles would pile up there."""
    from cases.validation.fluid.still_shapes import planes_scene

    scene = Scene.model_validate({"name": "planes", "spacing": 0.02} | planes_scene(0.02, tmp_path))
    _, _, ground = bind(scene, "planes")
    points = Simulation(scene, ground=ground).fluid.boundary
    under = (points[:, :2] < 0).all(1) & (points[:, 2] < -0.5)
    assert under.sum() > 50 and points[under, 2].max() > -0.511


class HalfSunk:
    """A solid in the middle of a tank 1 m long, half under water."""

    def boundary(self, spacing, layers):
        return np.array([[0.5, 0.0]])

    def clearance(self, points):
        return np.hypot(points[:, 0] - 0.5, points[:, 1]) - 0.15


@pytest.mark.parametrize("rows", [15, 16.3, 17.7, 21.1, 25.9])
def test_particles_stand_for_the_water_that_solids_leave(rows):
    spacing = 0.5 / rows
    layout = build(still_tank(spacing=spacing), ground=HalfSunk())
    water = 1.0 * 0.5 - 0.5 * np.pi * 0.15**2
    assert len(layout.position) * layout.volume == pytest.approx(water, abs=0.02 * spacing * 1.0)
