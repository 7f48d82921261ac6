"""Water that is let come to rest before the run, so that it starts from the rest of its particles, not from a lattice.

A lattice that a slope cuts has particles too near to the boundary, too far from it, and at a shore line a step of up to a
spacing. Let go, they would fall into place with a speed of up to sqrt(g spacing). Here they fall into place before t = 0, by
dynamic relaxation with kinetic damping (Cundall 1976; Barnes 1999): whenever the kinetic energy has passed a peak, all
velocities are set to zero.
"""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.owners import FIRST_BODY
from fsi.protocols import BodySet
from fsi.sph.columns import corrector_sums

MOST = 200  # steps
STILL = 0.005  # largest speed at a peak of the energy, over sqrt(g depth), from which on the water is at rest


def settle(fluid: Fluid, bodies: BodySet | None, dt: float) -> tuple[int, float]:
    """Let the fluid come to rest in steps of dt [s] while all that moves is held where it is. Returns the steps taken, and the
    largest speed [m/s] at the last peak of the kinetic energy."""
    still = STILL * math.sqrt(fluid.scene.gravity * fluid.depth)
    place = corrector_sums(fluid.dim)
    hold, centre = np.zeros((fluid.owners, 6)), np.zeros((fluid.owners, 3))
    if bodies:
        centre[FIRST_BODY:] = bodies.motion().position
    moving = fluid.boundary_velocity.copy()
    fluid.boundary_velocity[:] = 0.0
    energy, fastest, speed, count = 0.0, 0.0, math.inf, 0
    while count < MOST and speed >= still:
        count += 1
        fluid.begin(dt, centre, hold)
        fluid.predict()
        fluid.pressure(hold)
        sums, _ = fluid.correct()
        if (now := fluid.sums()[0]) > energy:  # the same in any number of ranks
            energy, fastest = now, math.sqrt(sums[place.speed2])
        else:
            energy, speed, fluid.velocity[:] = 0.0, fastest, 0.0
    fluid.velocity[:] = 0.0
    fluid.boundary_velocity[:] = moving
    return count, min(speed, fastest)
