"""What `fsi check` says a run will cost, against what it takes."""

import pytest

from fsi.compute.team import available_threads
from fsi.estimate import estimate
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

TERMS = {
    "plain": {},
    "liquids": {"liquids": {"brine": {"density": 1200.0, "blocks": [{"min": (0, -1), "max": (1, -0.5)}]}}},
    "implicit": {"fluid": {"kinematic_viscosity": 0.1}, "numerics": {"viscous_step": "implicit"}},
    "plastic": {"fluid": {"rheology": {"mu_inf": 0.01, "yield_stress": 3.0}}},
    "converged": {"numerics": {"solver": "converged"}},
    "double": {"numerics": {"precision": "double"}},
}


def tank(**parts) -> Scene:
    return Scene.model_validate({"spacing": 0.02, "duration": 1.0, "tank": {"min": (0, -1), "max": (1, 0.4)}} | parts)


@pytest.fixture(scope="module")
def costs():
    """Estimates, and the bytes of a run, by term."""
    found = {}
    for name, parts in TERMS.items():
        sim = Simulation(tank(**parts), threads=1)
        sim.step()
        found[name] = estimate(tank(**parts)), sim.memory_bytes
    return found


@pytest.mark.parametrize("term", TERMS)
def test_estimates_are_of_the_right_size(costs, term):
    """Of the time only that a term adds to it; how long steps take is `fsi bench`'s to measure."""
    said, memory = costs[term]
    assert said["memory_bytes"] == pytest.approx(memory, rel=0.3)
    work = lambda cost: (cost["seconds"] / cost["steps"] - 5e-4) * available_threads() + 5e-4  # noqa: E731
    assert term == "plain" or work(said) > 1.05 * work(costs["plain"][0])


def test_a_sea_of_many_waves_is_said_to_take_longer_than_one_of_one_wave():
    def seconds(**waves):
        tank = {"min": [-2.0, -0.5], "max": [2.0, 0.3]}
        sea = {"order": 2, "waves": waves}
        return estimate(Scene.model_validate({"spacing": 0.05, "duration": 60.0, "tank": tank, "sea": sea}))["seconds"]

    one = seconds(wave_height=0.08, period=1.2)
    many = seconds(kind="irregular", Hm0=0.08, peak_period=1.2, components=60)
    assert many > 1.3 * one
