"""Past the water line the pressure of fixed walls goes on as it does in the fluid."""

import numpy as np
import pytest
from tanks import still_tank

from fsi.simulation.loop import Simulation
from fsi.sph import columns

WEIGHT = 9810.0  # of water [N/m3]


def walls_under(factor: float, dimension: int = 2, **parts):
    """Places (b, dim) of the boundary particles of a tank and their pressures (b,), where that of the water falls upwards by
    `factor` times its weight, as in water that accelerates, and what they were lifted by along the walls (b,)."""
    scene = still_tank(dimension, spacing=0.05, depth=0.4, length=0.6, **parts)
    fluid = Simulation(scene, threads=1).fluid
    fluid.particles.pressure[:] = -factor * WEIGHT * fluid.position[:, -1]
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    fluid.predict()
    solids = fluid.solids
    solids.accelerate(np.zeros((fluid.owners, 6)), fluid.force.uniform)
    solids.extrapolate(fluid.work.trial)
    found = fluid.work.trial[solids.first : solids.first + solids.count, columns.trial(dimension).p]
    return solids.position[: solids.count], found, solids._steeper[: solids.count]


def beside(place: np.ndarray) -> np.ndarray:
    """Those of the first layer of one side wall, up to a spacing and a half over the water, away from other walls."""
    high = (place[:, -1] > 0) & (place[:, -1] < 0.075) & (np.abs(place[:, 0] + 0.025) < 1e-6)
    return high & (np.abs(place[:, 1:-1] - 0.3) < 0.05).all(1)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("factor", [0.6, 1.0, 1.4])
def test_pressure_goes_on_past_the_water_line_as_in_the_fluid(dimension, factor):
    place, pressure, _ = walls_under(factor, dimension)
    high = beside(place)
    assert high.any()
    np.testing.assert_allclose(pressure[high], -factor * WEIGHT * place[high, -1], atol=1e-3 * WEIGHT * 0.05)


def test_what_goes_on_is_at_most_twice_the_weight():
    place, _, steeper = walls_under(5.0)
    _, _, most = walls_under(2.0)
    high = beside(place)
    np.testing.assert_allclose(steeper[high], most[high], rtol=1e-4)


def test_there_is_no_water_line_under_water():
    place, _, steeper = walls_under(1.4)
    deep = place[:, -1] < -0.15  # a support from the surface, corners among them
    assert deep.any() and (steeper != 0).any()
    assert (steeper[deep] == 0).all()


CLOSED = {"min": [0, -0.4], "max": [0.6, 0.0], "walls": ["x-", "x+", "z-", "z+"]}


WEIGHTLESS = {"acceleration": [0.0, 9.81]}  # against a gravity of 9.81 m/s2


@pytest.mark.parametrize("parts", [{"gravity": 0.0}, {"tank": CLOSED}, {"fluid": WEIGHTLESS}])
def test_nothing_is_looked_for_without_weight_or_a_surface(parts):
    scene = still_tank(spacing=0.05, depth=0.4, length=0.6)
    fluid = Simulation(scene.model_validate(scene.model_dump(exclude_unset=True) | parts), threads=1).fluid
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    fluid.predict()
    fluid.solids.accelerate(np.zeros((fluid.owners, 6)), fluid.force.uniform)
    assert fluid.solids._steeper.size == 0
