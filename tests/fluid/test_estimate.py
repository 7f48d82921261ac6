"""What `fsi check` says a run will cost, against what it takes."""

import time

import pytest

from fsi.compute.team import available_threads
from fsi.estimate import estimate
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

TERMS = {
    "plain": {},
    "liquids": {"liquids": {"brine": {"density": 1200.0, "blocks": [{"min": (0, -1), "max": (1, -0.5)}]}}},
    "implicit": {"fluid": {"kinematic_viscosity": 0.1}, "numerics": {"viscous_step": "implicit"}},
    "converged": {"numerics": {"solver": "converged"}},
    "double": {"numerics": {"precision": "double"}},
}


def tank(**parts) -> Scene:
    return Scene.model_validate({"spacing": 0.02, "duration": 1.0, "tank": {"min": (0, -1), "max": (1, 0.4)}} | parts)


@pytest.fixture(scope="module")
def costs():
    """Estimates, and the processor time [s] of a step on one thread and the bytes, by term."""
    found = {}
    for name, parts in TERMS.items():
        sim, taken = Simulation(tank(**parts), threads=1), []
        for _ in range(6):
            start = time.process_time()
            sim.step()
            taken.append(time.process_time() - start)
        found[name] = estimate(tank(**parts)), min(taken), sim.memory_bytes
    return found


@pytest.mark.parametrize("term", TERMS)
def test_estimates_are_of_the_right_size(costs, term):
    said, seconds, memory = costs[term]
    assert said["memory_bytes"] == pytest.approx(memory, rel=0.3)
    # On other processors steps take other times: what a term adds is compared with the plain scene. Water at rest needs fewer
    # sweeps to convergence than water that moves, for which they are estimated.
    plain, plain_seconds, _ = costs["plain"]
    work = lambda cost: (cost["seconds"] / cost["steps"] - 5e-4) * available_threads() + 5e-4  # noqa: E731
    assert work(said) / work(plain) == pytest.approx(seconds / plain_seconds, rel=4.0 if term == "converged" else 0.6)
    assert term == "plain" or work(said) > 1.05 * work(plain)
