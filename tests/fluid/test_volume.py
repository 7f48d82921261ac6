"""Integral action on the volume of a sea without bodies."""

import numpy as np
import pytest

from fsi.compute.reduce import SERIAL, Reductions
from fsi.fluid.volume import Volume

GAIN = 0.002


def test_it_draws_until_the_volume_is_that_of_the_start():
    """Particles that take 1e-5 more room in each step, and give back the gain times what is too much and what is drawn."""
    volume, excess, rest = Volume(SERIAL), 0.0, 3e-4
    seen = []
    for _ in range(20000):
        room = rest + excess
        volume.update(np.full(4, room / (1 + room)), GAIN)
        excess += 1e-5 - GAIN * (excess + volume.draw)
        seen.append(excess)
    assert max(seen) < 1e-5 / GAIN  # what proportional action alone would leave
    assert abs(seen[-1]) < 1e-9 and volume.draw == pytest.approx(1e-5 / GAIN)


def test_the_order_of_the_particles_and_the_processes_do_not_count():
    class Shared(Reductions):
        def combined(self, part):
            return part + others.pop(0)

    deficit = np.random.default_rng(1).normal(0, 1e-3, 1001).astype(np.float32)
    one, other, two = Volume(SERIAL), Volume(SERIAL), Volume(Shared())
    others = [int(np.rint(2.0**40 * (1 / (1 - deficit[:300].astype(float)) - 1)).astype(np.int64).sum()), 300] * 2
    for part in (np.zeros(1001, np.float32), deficit):
        one.update(part, GAIN)
        other.update(part[::-1], GAIN)
    others[:2] = [0, 300]
    for part in (np.zeros(701, np.float32), deficit[300:]):
        two.update(part, GAIN)
    assert one.state() == other.state() == two.state()
