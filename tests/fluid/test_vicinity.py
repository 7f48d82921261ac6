"""Dry walls take no part in a step, and nothing depends on that."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fsi.compute.team import Team
from fsi.particles.vicinity import Vicinity
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("most", [1e6, 500])
def test_it_holds_all_places_within_reach_and_none_far_off(dimension, most):
    rng, reach = np.random.default_rng(dimension), 0.1
    low, high = np.zeros(dimension), np.array([1.0, 0.8, 0.6])[:dimension]
    fluid = rng.random((40, dimension)) * 0.3 + 0.2
    fluid[0], fluid[1] = np.nan, 7.0  # lost ones
    places = rng.random((20_000, dimension)) * 1.6 - 0.3
    near = Vicinity(low, high, reach, most, Team(2))
    holds, (distance, _) = near.holds(fluid, places), cKDTree(fluid[2:]).query(places)
    assert holds[distance <= reach].all()
    if most == 1e6:
        assert not holds[distance > 1.5 * reach * dimension**0.5].any()
    away = fluid + 0.3
    assert (near.holds(away, places) != holds).any()
    assert (near.holds(fluid, places) == holds).all()


def column(dimension: int) -> Scene:
    """A column of water that collapses in a long tank with high walls, and a gauge where it is dry at first."""
    low, high, end = ([0.0, 0.0, 0.0], [2.0, 0.4, 1.2], [0.4, 0.4, 0.4])
    if dimension == 2:
        low, high, end = ((box[0], box[2]) for box in (low, high, end))
    gauge = {"x": 0.55} | ({} if dimension == 2 else {"y": 0.2})
    return Scene.model_validate(
        {
            "dimension": dimension, "spacing": 0.05 if dimension == 3 else 0.02, "duration": 0.4,
            "tank": {"min": low, "max": high},
            "fluid": {"blocks": [{"min": low, "max": end}]}, "gauges": {"near": gauge},
        }
    )  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_run_has_the_bits_of_one_with_all_walls(dimension, monkeypatch):
    def run() -> tuple:
        sim, read, walls = Simulation(column(dimension), threads=1), [], []
        for _ in range(30):
            sim.step()
            walls.append(sim.fluid.solids.count)
            read.append(sim.instruments._surface(np.resize([0.55, 0.2], dimension - 1)))
        return sim.fluid.position, sim.fluid.pressure_values, read, walls, sim.fluid.nbytes, len(sim.fluid.owner)

    position, pressure, read, walls, memory, every = run()
    assert walls[0] < 0.6 * every and walls[-1] > walls[0]  # more and more get wet
    monkeypatch.setattr(Vicinity, "holds", lambda self, fluid, places: np.ones(len(places), bool))
    whole_position, whole_pressure, whole_read, whole_walls, whole_memory, _ = run()
    assert set(whole_walls) == {every} and whole_memory > memory
    assert (position == whole_position).all() and (pressure == whole_pressure).all()
    np.testing.assert_array_equal(read, whole_read)
