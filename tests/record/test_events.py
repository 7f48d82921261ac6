"""Events: what counts as an impact, a cut, the beginning of a condition, and when it is told."""

import numpy as np
import pytest

from fsi.protocols import Moment
from fsi.simulation.events import Beginnings, Impacts, StepCuts

DT, PERIOD, WEIGHT = 0.002, 0.05, 100.0


def impacts(force) -> list[tuple[Moment, str]]:
    """Of a vertical force t -> N on a body of 100 N over two seconds."""
    watch = Impacts(("box",), np.array([WEIGHT]), PERIOD)
    moments = [Moment(DT * n, n, 0.0) for n in range(1000)]
    found = [told for now in moments for told in watch(now, DT, np.array([[0.0, 0.0, force(now.time)]]))]
    return found + watch.finish(moments[-1])


def test_slam_is_told_once_with_time_and_size_of_its_peak():
    def slam(t):
        return 200.0 + 900.0 * np.exp(-(((t - 1.0) / 0.01) ** 2))

    [(moment, text)] = impacts(slam)
    assert moment.time == pytest.approx(1.0, abs=DT)
    assert moment.step == pytest.approx(500, abs=1)
    assert text.startswith("impact on 'box': 1100 N at its peak, 11 times the body's weight, over ")
    assert 15 < float(text.split()[-2]) < 50


def test_waves_and_noise_are_no_impacts():
    noise = np.random.default_rng(1)
    assert impacts(lambda t: 200 + 180 * np.sin(2 * np.pi * t / 1.8) + 10 * noise.normal()) == []
    assert impacts(lambda t: 60 * np.sin(2 * np.pi * t / 1.8)) == []


def test_impact_that_is_on_at_the_end_is_told():
    [(moment, _)] = impacts(lambda t: 1000.0 * (t > 1.99))
    assert moment.time == pytest.approx(1.99, abs=2 * DT)


def test_step_cuts():
    cuts = StepCuts()
    slow = [cuts(0.002 * 0.995**n, "speed") for n in range(300)]
    assert set(slow) == {None}  # a third of the start, but little by little
    cuts = StepCuts()
    assert [cuts(0.002, "sound") for _ in range(10)] == [None] * 10
    assert cuts(0.0009, "speed") == "time step cut from 2 to 0.9 ms by speed"
    assert cuts(0.0008, "speed") is None


def test_beginnings_are_told_again_after_a_pause_only():
    begin = Beginnings(quiet=0.5)
    assert begin(0.0, ["contact"]) == ["contact"]
    assert begin(0.4, ["contact", "limit"]) == ["limit"]
    assert begin(0.8, ["contact"]) == []  # 0.4 s after it was last seen
    assert begin(1.4, ["contact"]) == ["contact"]
