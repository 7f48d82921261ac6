"""The wall guard: nothing passes a wall, whatever the arrangement of its particles, and nothing sticks to it."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import Layout
from fsi.sph.columns import SUPPORT
from fsi.sph.wall_guard import REACH, level

DR, STEP = 0.1, 1e-3


def beside(wall, place, velocity, shifting=0.0, owner=None) -> Fluid:
    """A fluid of particles at `place` (n, dim) beside wall particles (m, dim), with no other force."""
    dim = place.shape[1]
    numerics = {"precision": "double", "shifting": shifting, "viscosity": "none", "artificial_viscosity": 0.0}
    layout = Layout(
        place, velocity, np.zeros(len(place)), wall,
        np.ones(len(wall), np.int32) if owner is None else owner.astype(np.int32),
        np.full(dim, -1.5), np.full(dim, 1.5), 0.5, DR**dim, (),
    )  # fmt: skip
    return Fluid(still_tank(dim, spacing=DR, gravity=0.0, numerics=numerics), layout, Team(1))


def step(fluid: Fluid, wall_speed=0.0) -> None:
    """One step with the guard alone; what the fluid loses, the wall takes."""
    fluid.boundary_velocity[:, -1] = wall_speed
    fluid.begin(STEP, np.zeros((2, 3)), np.zeros((2, 6)))
    if fluid.scene.numerics.shifting:
        fluid.work.coefficients[:, SUPPORT] = 1.0  # as inside the fluid
    before = fluid.velocity.sum(0)
    _, impulse = fluid.correct()
    given = impulse[1, [0, 2]] if fluid.position.shape[1] == 2 else impulse[1, :3]
    change = float(fluid.k.mass) * (fluid.velocity.sum(0) - before)
    assert change == pytest.approx(-given, rel=1e-10, abs=1e-15)


def crowding(points, wall) -> np.ndarray:
    r2 = ((points[:, None] - wall) ** 2).sum(-1) / (REACH * DR) ** 2
    return (np.maximum(0.0, 1.0 - r2) ** 2).sum(1)


def wall_of(dim: int) -> np.ndarray:
    """One layer with the widest holes of sampled walls: 1.25 spacings between particles along a line, 0.83 spacings from
    the middle of a hole to the particles around it on a surface."""
    if dim == 2:
        return np.column_stack([1.25 * DR * np.arange(-8, 9), np.zeros(17)])
    i, j = (x.ravel() for x in np.meshgrid(np.arange(-8, 9), np.arange(-8, 9)))
    return 0.83 * DR * np.column_stack([np.sqrt(3) * (i + 0.5 * (j % 2)), 1.5 * j, np.zeros(i.size)])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("speed", [1.0, 35.0])
def test_nothing_passes_the_holes_of_a_sampled_wall(dim, speed):
    """However often and fast a particle is thrown at it."""
    rng = np.random.default_rng(1)
    place = np.column_stack([rng.uniform(-0.3, 0.3, (200, dim - 1)), rng.uniform(1.0, 1.5, 200) * DR])
    wall = wall_of(dim)
    fluid = beside(wall, place, np.zeros_like(place))
    for _ in range(20):
        fluid.velocity[:] = rng.uniform(-0.3, 0.3, place.shape) * speed
        fluid.velocity[:, -1] = -speed
        step(fluid)
    near = np.abs(fluid.position[:, :-1]).max(1) < 0.7
    assert near.sum() > 50
    assert fluid.position[near, -1].min() > 0.2 * DR
    assert crowding(fluid.position[near], wall).max() < 1.05 * level(fluid.scene.numerics.wall_guard)


def test_a_shift_does_not_carry_a_particle_through():
    wall = wall_of(2)[7:9]
    wall = wall - wall.mean(0)
    place = np.array([[0.0, 0.5 * DR], [0.01 * DR, DR]])
    fluid = beside(wall, place, np.array([[0.1, -1.0], [0.0, 0.0]]), shifting=0.5)
    start = crowding(place, wall).max()
    step(fluid)
    assert crowding(fluid.position, wall).max() < 1.01 * max(start, level(fluid.scene.numerics.wall_guard))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_particle_that_is_pressed_to_a_flat_wall_slides_along_it(dim):
    """The waviness of the surface that it may not pass rubs no more than a coefficient of friction of 0.15."""
    line = DR * np.arange(-12, 13)
    wall = np.column_stack([x.ravel() for x in np.meshgrid(*[line] * (dim - 1))] + [np.zeros(25 ** (dim - 1))])
    place, along = np.zeros((1, dim)), np.zeros(dim)
    place[0, 0], place[0, -1] = -0.95, 0.75 * DR
    along[0] = 2.0
    fluid = beside(wall, place, along[None].copy())
    steps = 400
    for _ in range(steps):
        fluid.velocity[0, -1] -= 9.81 * STEP
        step(fluid)
    assert fluid.position[0, -1] < 0.8 * DR
    assert 2.0 - fluid.velocity[0, 0] < 0.15 * steps * 9.81 * STEP


def test_thousands_of_short_steps_do_not_press_a_particle_into_a_wall():
    """What a correction leaves over in a step must not add up: a way of 0.4 and 2 spacings in steps of 1e-4 and 5e-3."""
    wall = wall_of(2)
    middle = np.array([[0.0625, 0.75], [-0.0625, 0.75], [0.1875, 0.8]]) * [1.0, DR]  # between two wall particles each
    for pace, steps in (0.01, 4000), (0.5, 400):
        fluid = beside(wall, middle, np.zeros_like(middle))
        for _ in range(steps):
            fluid.velocity[:] = [0.0, -pace]
            step(fluid)
        assert len(fluid.position) == 3
        assert crowding(fluid.position, wall).max() < 1.01 * level(fluid.scene.numerics.wall_guard)


def test_a_wall_that_moves_takes_particles_along():
    place = np.array([[0.03, 0.05], [-0.2, 0.06]])
    fluid = beside(wall_of(2), place, np.zeros_like(place))
    step(fluid, wall_speed=2.0)
    assert fluid.velocity[:, 1] == pytest.approx([2.0, 2.0], rel=0.05)


def test_particles_that_a_body_squeezes_stay_in_the_tank():
    """A body comes down on them at 3 m/s while they are pressed down; they may end inside the body, not beyond the bed."""
    line = np.column_stack([DR * np.arange(-8, 9), np.zeros(17)])
    body_layers = [line + np.array([0.03, (2.2 + n) * DR]) for n in range(3)]
    place = np.column_stack([np.linspace(-0.5, 0.5, 11), np.full(11, 1.0 * DR)])
    fluid = beside(np.vstack([line, *body_layers]), place, np.zeros_like(place), owner=np.repeat([0, 1, 1, 1], 17))
    for _ in range(60):
        body = fluid.owner == 1
        fluid.boundary_velocity[body, 1] = -3.0
        fluid.velocity[:] = [0.5, -3.0]
        fluid.begin(STEP, np.zeros((2, 3)), np.zeros((2, 6)))
        fluid.correct()
        fluid.boundary[body, 1] -= 3.0 * STEP
    assert fluid.position[:, 1].min() > 0.4 * DR
