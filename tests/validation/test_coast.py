"""The measures of the cases at a coast, on waves that are known."""

import math

import numpy as np
import pytest

from cases.validation.waves import island, solitary_wave, tsunami_plant
from fsi.waves.kinds.solitary import SolitaryPiston


def test_the_solitary_wave_of_the_island_passes_the_first_gauge_by_the_clock_of_the_experiment():
    piston = SolitaryPiston(island.HEIGHT, island.DEPTH, island.G)
    passed = 0.5 * piston.time + (island.GAUGES[0, 0] - 0.5 * piston.stroke) / piston.speed
    assert passed - island.LATE == pytest.approx(island.TIMES[0], abs=0.03)


def test_a_gauge_over_a_film_that_reads_the_bed_at_rest_does_not_raise_its_crest():
    """All gauges read the experiment's crests; those on the shelf the bed, and one 5 cm too high, before the wave is there."""
    time, passage = np.arange(0, 10, 0.02), object.__new__(island.Passage)
    rest = np.array([0.0, 0.05, -0.07, 0.0, 0.0, -0.07, -0.07, -0.07, -0.07])
    there = np.abs(time[:, None] - island.TIMES) < 0.5
    passage.time, passage.level = list(time), np.where(there, island.CRESTS, rest)
    passage.speed = np.tile([largest for _, largest in island.PROBES.values()], (len(time), 1))
    errors = passage.errors()
    assert errors["crests"] == pytest.approx(0, abs=1e-9)
    assert errors["island_reached_s"] == pytest.approx(island.TIMES[1] - 0.5 - island.ARRIVALS[1], abs=0.03)


def test_what_the_coast_sends_back_is_read_from_the_elevations():
    """A crest of 24 m runs in at 25 m/s, and 8 m of water run back out at 20 m/s from the sea wall, where there is no surface
    before the wave."""
    measure = object.__new__(tsunami_plant.RunIn)
    measure._x, measure.rows = np.arange(tsunami_plant.OFFSHORE, 1200.0, 50.0), []
    x = measure._x
    for t in np.arange(0.0, 80.5, 0.5):
        front = 25.0 * (t - 15.0)
        level = 24 / np.cosh((x - front) / 60) ** 2 + 8.0 * (x > 856 - 20.0 * (t - 50.0))
        level = np.where((x > 800) & (front < x), math.nan, level)
        measure.rows.append({"time": t, "along": [level, level], "front": front, "depth": {}, "force": {}})
    reached, speed = measure.run_in()
    assert (reached, speed) == pytest.approx((15 + 852 / 25, 25.0), rel=1e-3)
    out, back, rise = measure.reflection()
    assert back == pytest.approx(20.0, rel=0.03) and rise == pytest.approx(8.0, rel=0.05)
    assert out == pytest.approx(800 - (856 - 20.0 * 30), abs=50)


def test_a_series_carries_the_flux_of_its_wave(tmp_path):
    """Volume that flows over the line: the integral of q is that of eta times the speed, 4 d sqrt(H (d + H) / 3)."""
    depth, height = 0.2, 0.06
    solitary_wave.write_series(tmp_path / "line.csv", height, depth, passed=3.0, last=6.0)
    t, eta, flux = np.loadtxt(tmp_path / "line.csv", delimiter=",", skiprows=1).T
    assert eta.max() == pytest.approx(height, rel=1e-3) and t[eta.argmax()] == pytest.approx(3.0, abs=0.011)
    assert np.trapezoid(flux, t) == pytest.approx(4 * depth * math.sqrt(height * (depth + height) / 3), rel=0.01)
