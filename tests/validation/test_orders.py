"""Orders of convergence, at a size that takes seconds."""

import math
from dataclasses import replace

from cases.validation.engine.registry import load
from cases.validation.engine.runner import run_case


def errors(name, solver, spacings, error):
    """The error of a case at each of these spacings."""
    case = replace(load(name), spacing=dict(enumerate(spacings)))
    return [run_case(case, level, solver, threads=1)[0].error[error] for level in case.spacing]


def test_taylor_green_converges_and_the_vortices_do_not_tear_the_particles_apart():
    coarse, fine = errors("taylor_green", "chebyshev6", (1 / 30, 1 / 60), "velocity_l2")
    assert fine < 0.02  # 0.13 where gaps between the particles count as a free surface
    assert math.log2(coarse / fine) > 1
