"""The parts of a fluid: what they own, what is remembered from step to step, halos."""

import itertools

import numpy as np
import pytest

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.fluid.workspace import Arena
from fsi.particles.layout import build
from fsi.scene.model import Scene

LOWER = {"density": 2000.0, "kinematic_viscosity": 2e-2}
BOTTOM = {"min": [0.0, 0.0], "max": [1.0, 0.3]}
CHANNEL = {"tank": {"min": [0, 0], "max": [1, 0.6], "walls": ["z-", "z+"], "periodic": ["x"]}, "gravity": 0.0}
KINDS = {
    "plain": {},
    "no viscosity, one sweep": {"numerics": {"viscosity": "none", "artificial_viscosity": 0.0, "sweeps": 1}},
    "converged": {"numerics": {"solver": "converged", "precision": "double"}},
    "eddies": {"numerics": {"turbulence": "smagorinsky"}},
    "implicit": {"numerics": {"viscous_step": "implicit"}, "liquids": {"lower": LOWER | {"blocks": [BOTTOM]}}},
    "periodic": CHANNEL | {"numerics": {"turbulence": "smagorinsky"}},
    "periodic liquids": CHANNEL | {"liquids": {"lower": LOWER | {"blocks": [BOTTOM]}}},
}


def fluid_of(kind, **parts) -> Fluid:
    scene = {
        "spacing": 0.05,
        "duration": 1.0,
        "tank": {"min": [0, 0], "max": [1, 0.8]},
        "fluid": {"still_water_level": 0.6, "kinematic_viscosity": 1e-2, "acceleration": [0.5, 0.0]},
    }
    scene = Scene.model_validate(scene | KINDS[kind])
    fluid = Fluid(scene, build(scene), Team(1), **parts)
    fluid.velocity[:] = 0.1 * np.sin(7 * fluid.position[:, ::-1])
    return fluid


def begin(fluid, number):
    still = np.zeros((fluid.owners, 6))
    wall = fluid.of_owner(0)
    skin = np.full_like(fluid.boundary, 0.01 * number)  # a wall that seems to slide, more and more
    fluid.placed.place(0, fluid.boundary[wall], 0 * fluid.boundary[wall], skin[wall])
    fluid.begin(1e-3 * (1 + 0.1 * (number % 3)), still[:, :3], still)
    return still


def step(fluid, number):
    still = begin(fluid, number)
    fluid.predict()
    wrench = fluid.pressure(still)
    return wrench, *fluid.correct(), fluid.residual(), *fluid.fields.values()


def same(one, two):
    """Nested dictionaries and lists, bit for bit."""
    if isinstance(one, dict):
        return one.keys() == two.keys() and all(same(one[key], two[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(two) and all(map(same, one, two))
    return np.array_equal(one, two) and np.asarray(one).dtype == np.asarray(two).dtype


@pytest.mark.parametrize("kind", KINDS)
def test_a_restored_fluid_goes_on_bit_for_bit(kind):
    first, second = fluid_of(kind), fluid_of(kind)
    for number in range(3):
        step(first, number)
    state, fields = first.state(), first.fields
    second.restore(state)
    assert same(second.state(), state) and same(second.fields, fields) and second.residual() == first.residual()
    found = [step(first, number) for number in range(3, 6)]
    assert same(second.state(), state)  # which shares no memory with the first
    assert same([step(second, number) for number in range(3, 6)], found)
    assert same(second.state(), first.state())


def test_a_state_of_another_fluid_is_refused():
    state = fluid_of("plain").state()
    for other in ("periodic", "implicit"):
        with pytest.raises(ValueError, match="the state is one of"):
            fluid_of(other).restore(state)


@pytest.mark.parametrize("kind", KINDS)
def test_no_two_arrays_of_the_state_share_memory(kind):
    fluid = fluid_of(kind)
    for number in range(2):
        step(fluid, number)
    arrays = [
        array
        for part in (fluid.particles, fluid.placed)
        for array in vars(part).values()
        if isinstance(array, np.ndarray)
    ]
    assert len(arrays) >= 7
    assert not any(np.shares_memory(a, b) for a, b in itertools.combinations(arrays, 2))


def test_only_one_array_of_an_arena_stands_at_a_time():
    arena = Arena(small=((3,), np.int32), large=((5, 2), np.float64))
    arena.begin("small")[:] = 1
    assert arena["small"].shape == (3,) and arena.nbytes == 80
    arena.begin("large")
    with pytest.raises(RuntimeError, match="'small' does not stand"):
        arena["small"]


def test_coefficients_stand_from_the_search_to_the_next_sort():
    fluid = fluid_of("plain")
    step(fluid, 0)
    assert len(fluid.work.coefficients) == fluid.count
    fluid.work.arena.begin("orders")
    with pytest.raises(RuntimeError, match="'coefficients' does not stand"):
        fluid.work.coefficients  # noqa: B018


def test_ghosts_have_the_viscosity_of_what_they_stand_for():
    """Of two liquids one above the other in a channel, also beyond its ends."""
    fluid = fluid_of("periodic liquids")
    begin(fluid, 0)
    fluid.predict()
    ghost, lower = fluid.label < 0, fluid.position[:, 1] < 0.3
    assert (ghost & lower).sum() > 20 and (ghost & ~lower).sum() > 20
    viscosity = fluid.work.flow[: fluid.count, 4]
    assert np.allclose(viscosity, np.where(lower, 2000 * 2e-2, 1000 * 1e-2))


@pytest.mark.parametrize("kind", ["plain", "converged"])  # single and double precision
@pytest.mark.parametrize("given", [True, False])
def test_particles_are_put_in_order(kind, given):
    particles, rng = fluid_of(kind).particles, np.random.default_rng(3)
    particles.pressure[:] = rng.random(particles.count)
    scratch = np.empty((particles.count, 3)) if given else None
    for left in (particles.count, particles.count - 7, particles.count - 7):  # particles may be lost
        expected, order = particles.state(), rng.permutation(particles.count).astype(np.int32)
        particles.reorder(order, left, scratch)
        for name, values in particles.state().items():
            assert np.array_equal(values, expected[name][order[:left]]) and values.dtype == expected[name].dtype
