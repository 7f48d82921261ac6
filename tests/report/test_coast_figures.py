"""Figures of coastal structures from signals whose answer is known."""

import math

import numpy as np
import pytest
import xarray

from cases.report.coast_figures import events, peaks, plane_width, separate_regular, separate_sea, separated
from cases.report.obstacles import obstacles
from cases.report.wave_figures import settled, window
from fsi.scene.model import Scene
from fsi.waves.linear import wavenumber

DEPTH, G = 0.5, 9.81
TIME = np.arange(0.0, 40.0, 0.02)


def waves(parts, x):
    """Elevations (gauges, n) of (height, period, phase, direction) each."""
    eta = np.zeros((len(x), len(TIME)))
    for height, period, phase, direction in parts:
        omega = 2 * math.pi / period
        k = direction * wavenumber(omega, DEPTH, G)
        eta += 0.5 * height * np.cos(omega * TIME - k * np.asarray(x)[:, None] + phase)
    return eta


@pytest.mark.parametrize("x", [(2.0, 2.5), (2.0, 2.3, 3.1), (4.0, 4.4, 5.0, 5.3)])
def test_regular_waves_are_separated_exactly(x):
    eta = waves([(0.1, 1.6, 0.4, 1), (0.03, 1.6, 2.0, -1)], x)
    assert separate_regular(TIME, eta, np.array(x), 1.6, DEPTH, G) == pytest.approx((0.1, 0.03), rel=1e-9)


def test_gauges_half_a_wave_length_apart_cannot_tell_waves_apart():
    half = math.pi / wavenumber(2 * math.pi / 1.6, DEPTH, G)
    assert (
        separate_regular(TIME, waves([(0.1, 1.6, 0, 1)], (2.0, 2.0 + half)), np.array([2.0, 2.0 + half]), 1.6, DEPTH, G)
        is None
    )


def test_a_sea_is_separated_within_a_few_percent():
    rng, x = np.random.default_rng(2), np.array([3.0, 3.35, 4.0])
    periods = 1 / np.linspace(0.4, 1.1, 60)
    phases = rng.uniform(0, 2 * math.pi, (2, 60))
    there = [(0.02, p, a, 1) for p, a in zip(periods, phases[0], strict=True)]
    back = [(0.008, p, a, -1) for p, a in zip(periods, phases[1], strict=True)]
    incident, reflected = separate_sea(TIME, waves(there + back, x), x, 1.6, DEPTH, G)
    full = 4 * math.sqrt(60 * 0.01**2 / 2)
    assert incident == pytest.approx(full, rel=0.06) and reflected == pytest.approx(0.4 * full, rel=0.1)


def test_volumes_of_overtopping_waves():
    rate = np.zeros_like(TIME)
    for start, volume in ((3.0, 0.02), (9.0, 0.05), (20.0, 0.01)):
        flows = (start <= TIME) & (start + 0.5 > TIME)
        rate[flows] = volume / (flows.sum() * 0.02)
    rate[(TIME > 9.1) & (TIME < 9.2)] = 0.0  # a break within a wave
    found = events(TIME, rate, 0.4)
    assert len(found) == 3 and found[[0, 2]] == pytest.approx([0.02, 0.01], rel=0.01)
    assert len(events(TIME, 0 * TIME, 0.4)) == 0


def test_width_of_flux_planes():
    flat = Scene.model_validate(
        {
            "spacing": 0.1,
            "duration": 1,
            "tank": {"min": (0, 0), "max": (4, 1), "width": 0.5},
            "fluxes": {"a": {"min": (1, 0), "max": (1, 1)}},
        }
    )
    assert plane_width(flat, "a") == 0.5
    planes = {"a": {"min": (1, 0.5, 0), "max": (1, 2, 1)}, "b": {"min": (0, 0, 0.5), "max": (1, 1, 0.5)}}
    tank = {"min": (0, 0, 0), "max": (4, 2, 1)}
    deep = Scene.model_validate({"dimension": 3, "spacing": 0.1, "duration": 1, "tank": tank, "fluxes": planes})
    assert plane_width(deep, "a") == 1.5 and plane_width(deep, "b") == 0.0


def test_peaks_stand_apart():
    values = np.array([0.0, 1.0, 0.5, 0.9, 0.2, 0.0, 0.0, 2.0, 2.0, 0.0])
    assert peaks(values, 2).tolist() == [1.0, 2.0]


def test_fixed_solids_stand_in_the_way_of_waves(tmp_path):
    """A sill on the floor from x = 4, a wall through the surface from x = 7: gauges behind the sill separate nothing, and
    figures wait for the waves at the wall."""
    geoms = {"sill": ("5 0 -0.5", "1 1 0.1"), "wall": ("7.2 0 0", "0.2 1 0.6")}
    wet = "".join(f'<element objtype="geom" objname="{name}"/>' for name in geoms)
    drawn = "".join(f'<geom name="{n}" type="box" pos="{p}" size="{s}"/>' for n, (p, s) in geoms.items())
    (tmp_path / "shore.xml").write_text(
        f'<mujoco><custom><tuple name="wet">{wet}</tuple></custom><worldbody>{drawn}</worldbody></mujoco>'
    )
    keys = {"spacing": 0.05, "duration": 20.0, "tank": {"min": (0.0, -0.6), "max": (9.0, 0.5)}}
    keys |= {
        "waves": {"wave_height": 0.1, "period": 1.5},
        "gauges": {"a": {"x": 2.0}, "b": {"x": 2.6}, "c": {"x": 6.0}},
    }
    scene = Scene(**keys, bodies={"shore": {"mjcf": tmp_path / "shore.xml"}})
    assert obstacles(scene) == pytest.approx((4.0, 7.0), abs=0.05)
    assert obstacles(Scene(**keys)) == (math.inf, math.inf)
    time = np.arange(0.0, 20.0, 0.05)
    omega, x = 2 * math.pi / 1.5, np.array([2.0, 2.6, 6.0])
    k = wavenumber(omega, 0.6, 9.81)
    eta = 0.05 * np.cos(omega * time[:, None] - k * x) + 0.02 * np.cos(omega * time[:, None] + k * x)
    eta[:, 2] *= 3  # it shoals
    part = xarray.Dataset({"elevation": (("time", "gauge"), eta)}, coords={"time": time, "gauge": ["a", "b", "c"]})
    assert separated(part, scene, 1.5, True, settled) == pytest.approx((0.1, 0.04), rel=1e-3)
    assert "1.5 s are needed" in separated(part.sel(time=slice(0, 6)), scene, 1.5, True, settled)
    assert window(part, scene)[0].time[0] > settled(scene, 6.9) - 1e-6
