"""Analyses on signals whose answer is known."""

import math

import numpy as np
import pytest
import xarray
from scipy.integrate import solve_ivp

from cases.report import wave_figures
from cases.study.decay import identify
from cases.study.extremes import gumbel_fit, largest_of, storm_extreme
from cases.study.routines import extreme, peak, power_matrix
from fsi.errors import SceneError
from fsi.waves import wavenumber


def decay(period, b1, b2, offset=0.0, duration=20.0, start=0.4):
    """The solution of the decay's equation by another integrator, at 0.02 s."""
    w2 = (2 * math.pi / period) ** 2
    times = np.arange(0, duration, 0.02)
    done = solve_ivp(
        lambda t, y: (y[1], -b1 * y[1] - b2 * abs(y[1]) * y[1] - w2 * (y[0] - offset)),
        (0, duration), (start + offset, 0.0), t_eval=times, rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    return times, done.y[0]


@pytest.mark.parametrize(
    "period, b1, b2, offset", [(2.3, 0.12, 0.0, 0.0), (1.7, 0.05, 0.6, 0.02), (3.0, 0.4, 1.5, -0.1)]
)
def test_free_decay_is_identified(period, b1, b2, offset):
    found = identify(*decay(period, b1, b2, offset))
    assert found.period == pytest.approx(period, rel=1e-5)
    assert found.linear == pytest.approx(b1, abs=2e-5)
    assert found.quadratic == pytest.approx(b2, abs=2e-4)
    assert found.offset == pytest.approx(offset, abs=1e-6)
    assert found.residual < 1e-6
    assert found.damping_ratio == pytest.approx(b1 * period / (4 * math.pi), abs=1e-5)


def test_free_decay_under_noise_and_of_too_short_a_series():
    times, values = decay(2.0, 0.1, 0.5)
    found = identify(times, values + np.random.default_rng(1).normal(0, 0.004, len(times)))
    assert found.period == pytest.approx(2.0, rel=2e-3)
    assert found.linear == pytest.approx(0.1, abs=0.02) and found.quadratic == pytest.approx(0.5, abs=0.15)
    with pytest.raises(SceneError, match="three half cycles"):
        identify(times[:50], values[:50])


def test_harmonic_is_exact_over_any_window():
    t = np.linspace(0.3, 4.1, 200)
    x = 0.7 + 2.0 * np.cos(3.0 * t + 0.4)
    found = wave_figures.harmonic(t, x, 3.0)
    assert abs(found) == pytest.approx(2.0) and np.angle(found) == pytest.approx(0.4)


def test_confidence_interval_holds_the_mean_in_95_of_100_cases():
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(2000):
        mean, error = wave_figures.mean_and_error(rng.normal(1.0, 1.0, 80), 8)
        hits += abs(mean - 1.0) <= error
    assert hits / 2000 == pytest.approx(0.95, abs=0.015)


def test_wave_power_in_deep_and_shallow_water():
    rho, g, height = 1000.0, 9.81, 2.0
    deep = rho * g**2 * height**2 * 8.0 / (32 * math.pi)
    assert wave_figures.wave_power(height, 8.0, 500.0, rho, g) == pytest.approx(deep, rel=1e-6)
    shallow = rho * g * height**2 / 8 * math.sqrt(g * 1.0)
    assert wave_figures.wave_power(height, 200.0, 1.0, rho, g) == pytest.approx(shallow, rel=1e-3)


def flap_run(scene, motion=0.3, lead=0.5, power=12.0):
    """The dataset of a run whose every figure is known: pitch = motion cos(wt - kx + lead)."""
    t = np.arange(0, 12.0, 0.01)
    w = 2 * math.pi / scene.waves.period
    kx = wavenumber(w, 0.7, 9.81) * 1.8
    pitch = motion * np.cos(w * t - kx + lead)
    eta = scene.waves.wave_height / 2 * np.cos(w * t)
    force = np.zeros((len(t), 1, 3))
    force[:, 0, 0] = 100 * np.cos(w * t)
    force[t < 6.0] = 1e6  # before the waves have settled: counts for nothing
    return xarray.Dataset(
        {
            "joint_position": (("time", "joint"), pitch[:, None]),
            "joint_force": (("time", "joint"), 40 * pitch[:, None]),
            "pto_power": (("time", "joint"), (2 * power * np.cos(w * t) ** 2)[:, None]),
            "body_position": (("time", "body", "axis"), np.tile([1.8, 0.0, -0.3], (len(t), 1, 1))),
            "body_force": (("time", "body", "axis"), force),
            "body_torque": (("time", "body", "axis"), 0.1 * force),
            "elevation": (("time", "gauge"), eta[:, None]),
            "lost_particles": ("time", np.zeros(len(t))),
        },
        coords={"time": t, "joint": ["hinge"], "joint_kind": ("joint", ["hinge"]), "body": ["flap"],
                "axis": ["x", "y", "z"], "gauge": ["front"]},
    )  # fmt: skip


def test_figures_of_a_run_in_regular_waves(flap_scene):
    found = {f.key: f for f in wave_figures.figures(flap_run(flap_scene), flap_scene, start=6.0)}
    assert found["rao.hinge"].value == pytest.approx(0.3 / 0.07) and found["rao.hinge"].units == "rad/m"
    assert found["rao_phase.hinge"].value == pytest.approx(0.5)
    assert found["mean_power"].value == pytest.approx(12.0, rel=5e-3)
    flux = wave_figures.wave_power(0.14, 1.5, 0.7, 1000.0, 9.81)
    assert found["capture_width_ratio"].value == pytest.approx(12.0 / flux, rel=5e-3)
    assert found["force_max.flap"].value == pytest.approx(100.0, rel=1e-3)
    assert found["gauge_height.front"].value == pytest.approx(0.14, rel=1e-6)
    assert found["joint_force_max.hinge"].units == "N m"
    with pytest.raises(SceneError, match=r"duration: the run ends at .* make the run longer"):
        wave_figures.figures(flap_run(flap_scene), flap_scene, start=11.0)


def test_a_body_that_drifts_meets_the_waves_later_and_its_amplitudes_are_found(flap_scene):
    data = flap_run(flap_scene)
    t, omega = data.time.values, 2 * math.pi / 1.5
    k = wavenumber(omega, 0.7, 9.81)
    met, drift = omega - k * 0.03, 0.03
    place, turn = data.body_position.values * 0.0, np.zeros((len(t), 1, 4))
    place[:, 0, 0] = 1.0 + drift * t + 0.05 * np.cos(met * t)
    place[:, 0, 2] = 0.06 * np.cos(met * t + 0.4)
    half = 0.5 * 0.1 * np.sin(met * t)
    turn[:, 0, 0], turn[:, 0, 2] = np.cos(half), np.sin(half)
    data["body_position"] = ("time", "body", "axis"), place
    data["body_quaternion"] = ("time", "body", "wxyz"), turn
    found = {f.key: f.value for f in wave_figures.figures(data, flap_scene, start=6.0)}
    amplitude = 0.07
    assert found["drift.flap"] == pytest.approx(drift, rel=1e-3)
    assert found["encounter_period.flap"] == pytest.approx(2 * math.pi / met, rel=1e-4)
    assert found["surge_rao.flap"] == pytest.approx(0.05 / amplitude, rel=1e-3)
    assert found["heave_rao.flap"] == pytest.approx(0.06 / amplitude, rel=1e-3)
    assert found["pitch_rao.flap"] == pytest.approx(0.1 / amplitude, rel=1e-3)


def test_a_hammer_of_one_sample_is_no_largest_pressure():
    t = np.arange(0.0, 1.0, 0.001)
    p = np.full(len(t), 3000.0)
    p[500] = 75000.0
    over, mean = wave_figures.running_mean(t, p, 0.01)
    assert over == 0.01 and mean.max() == pytest.approx(3000 + 72000 * 0.1, rel=1e-6)
    coarse, mean = wave_figures.running_mean(t[::20], p[::20], 0.01)
    assert coarse == pytest.approx(0.04)  # three samples
    assert wave_figures.running_mean(t[:4], p[:4], 0.01)[1] == pytest.approx([3000.0])


def test_peak_is_exact_for_a_parabola_over_the_logarithm():
    x = np.array([1.0, 10.0, 40.0, 100.0, 1000.0])
    place, height, inside = peak(x, 5.0 - (np.log(x) - math.log(30.0)) ** 2)
    assert (place, height, inside) == (pytest.approx(30.0), pytest.approx(5.0), 1.0)
    assert peak(x, x) == (1000.0, 1000.0, 0.0)
    assert peak(x, np.array([np.nan, 1, 3, 2, np.nan]))[2] == 1.0
    assert math.isnan(peak(x, np.full(5, np.nan))[0])


def test_extreme_of_a_storm_from_the_maxima_of_runs():
    rng = np.random.default_rng(2)
    location, scale = gumbel_fit(rng.gumbel(10.0, 2.0, 20000))
    assert location == pytest.approx(10.0, abs=0.06) and scale == pytest.approx(2.0, rel=0.02)
    mode, high = largest_of(10.0, 2.0, 50.0)
    storms = rng.gumbel(10.0, 2.0, (20000, 50)).max(axis=1)
    assert np.mean(storms < high) == pytest.approx(0.95, abs=0.006)
    counts, edges = np.histogram(storms, bins=40)
    assert mode == pytest.approx(edges[np.argmax(counts)], abs=0.8)


def test_the_confidence_of_an_extreme_holds_the_truth():
    rng = np.random.default_rng(1)
    truth = largest_of(10.0, 1.0, 20.0)[1]
    found = [storm_extreme(rng.gumbel(10.0, 1.0, 20), 20.0) for _ in range(60)]
    hits = np.mean([one.high_low <= truth <= one.high_high for one in found])
    assert 0.85 < hits <= 1.0
    few, many = (np.mean([storm_extreme(rng.gumbel(10.0, 1.0, n), 20.0).seeds for _ in range(20)]) for n in (5, 40))
    assert few == pytest.approx(many, rel=0.5)  # how many are needed does not hang on how many there are
    assert storm_extreme(np.array([10.0, 11.0, 12.0]), 20.0).seeds > 3


def test_an_end_stop_bounds_the_motion_of_any_storm():
    motion = np.array([[0.9, 0.5], [1.01, 0.6], [0.8, 0.55]])
    data = xarray.Dataset(
        {
            "motion_max": (("seed", "joint"), motion, {"units": "rad", "long_name": "largest joint position"}),
            "end_stop": (("seed", "joint"), np.array([[np.nan, np.nan], [1.0, np.nan], [np.nan, np.nan]])),
            "measured_seconds": ("seed", np.full(3, 100.0)),
        },
        coords={"seed": [1, 2, 3], "joint": ["a", "b"]},
    )
    found = extreme(data, 10800.0)
    assert found.motion_max_95.values[0] == pytest.approx(1.01) and np.isnan(found.motion_max_seeds.values[0])
    assert found.motion_max_95.values[1] > 0.65 and found.motion_max_seeds.values[1] >= 3
    assert found.motion_max_95_low.values[1] < found.motion_max_95.values[1] < found.motion_max_95_high.values[1]


def test_power_matrix_is_the_mean_of_the_seeds():
    rng = np.random.default_rng(3)
    power = rng.random((2, 3, 4)) + np.arange(6).reshape(2, 3, 1)
    data = xarray.Dataset(
        {"mean_power": (("Hm0", "Te", "seed"), power), "wave_power": (("Hm0", "Te", "seed"), np.full((2, 3, 4), 4.0))},
        coords={"Hm0": [1.0, 2.0], "Te": [5.0, 6.0, 7.0], "seed": [0, 1, 2, 3]},
    )
    data = power_matrix(data)
    assert np.allclose(data.power_matrix, power.mean(axis=2))
    assert np.allclose(data.power_matrix_error, power.std(axis=2, ddof=1) / 2)
    assert np.allclose(data.capture_width_matrix, power.mean(axis=2) / 4)


def test_power_of_an_irregular_sea_in_deep_water(flap_scene):
    sea = {"kind": "irregular", "Hm0": 0.05, "peak_period": 0.9, "seed": 4, "components": 2000}
    scene = flap_scene.model_validate(
        flap_scene.model_dump() | {"waves": sea, "tank": {"min": [0, -5], "max": [5, 0.4]}}
    )
    energy_period = 0.9 * wave_figures.energy_period_ratio(scene.waves)
    deep = 1000.0 * 9.81**2 * 0.05**2 * energy_period / (64 * math.pi)
    assert wave_figures.incident_power(scene) == pytest.approx(deep, rel=0.02)
