"""The exact answers of the validation cases, against each other and against their own equations."""

import csv
import math
import os
from pathlib import Path

import numpy as np
import pytest

from cases.validation.fluid import dam_front, jet_step, poiseuille, short_box, taylor_green
from cases.validation.fluid.drop import FIELD, PERIOD, exact_axes
from cases.validation.fluid.standing_wave import crossings, extremes, standing_frequency
from cases.validation.fluid.still_shapes import (
    RISE_X,
    RISE_Y,
    SIDE,
    water_over,
    water_over_planes,
    write_bed,
    write_planes,
)
from cases.validation.fluid.still_water import DEPTH
from cases.validation.theory.separation import first_harmonic, group_speed, separate, wave_heights, wavenumber_of
from cases.validation.theory.series import impulse, low_passed, relative_rms
from cases.validation.waves import irregular_sea, solitary_wave
from fsi.estimate import estimate
from fsi.scene.binding import bind
from fsi.scene.file import load_scene


def test_standing_waves_of_finite_height_are_slower_in_deep_water():
    k, g = 2.0, 9.81
    linear = math.sqrt(g * k * math.tanh(k * 0.3))
    assert standing_frequency(k, 0.3, 0.0, g) == pytest.approx(linear)
    deep = math.sqrt(g * k) * (1 - (k * 0.1) ** 2 / 8)  # Rayleigh 1915
    assert standing_frequency(k, 10.0, 0.1, g) == pytest.approx(deep)


def test_zeros_and_extremes_of_a_decaying_oscillation():
    t = np.linspace(0.1, 10, 2001)
    zeros = crossings(t, np.sin(3 * t))
    np.testing.assert_allclose(zeros, np.pi / 3 * np.arange(1, len(zeros) + 1), atol=1e-6)
    times, sizes = extremes(t, np.exp(-0.2 * t) * np.sin(3 * t))
    assert -np.polyfit(times, np.log(sizes), 1)[0] == pytest.approx(0.2, rel=1e-3)


def waves(incident, reflected, k, omega, x, t):
    elevation = incident * np.cos(k * x - omega * t[:, None] + 0.4) + reflected * np.cos(k * x + omega * t[:, None])
    return elevation + 0.1 * incident * np.cos(2 * (k * x - omega * t[:, None])) + 0.003


@pytest.mark.parametrize("gauges", [[1.0, 1.4], [1.0, 1.3, 1.9], [1.0, 1.4, 1.8, 2.2, 2.6]])
def test_incident_and_reflected_waves_are_separated(gauges):
    k, omega, x = 2 * math.pi / 2.0, 4.0, np.array(gauges)
    t = np.linspace(3.0, 3.0 + 2.7 * 2 * math.pi / omega, 108)
    amplitude = first_harmonic(t, waves(0.05, 0.01, k, omega, x, t), omega)
    incident, reflected, rest = separate(x, amplitude, k)
    assert abs(incident) == pytest.approx(0.05, rel=1e-9)
    assert abs(reflected) == pytest.approx(0.01, rel=1e-9)
    assert rest < 1e-12


def test_a_wave_longer_than_linear_theory_is_not_taken_for_reflection():
    k, omega, x = math.pi, 4.0, 1.0 + 0.4 * np.arange(5)
    t = np.linspace(0, 3 * 2 * math.pi / omega, 120, endpoint=False)
    elevation = waves(0.05, 0.001, k, omega, x, t)
    assert wavenumber_of(x, first_harmonic(t, elevation, omega), 1.04 * k) == pytest.approx(k, rel=2e-3)
    incident, reflected = wave_heights(t, elevation, x, omega, 1.04 * k)
    assert incident == pytest.approx(0.1, rel=1e-3)
    assert reflected == pytest.approx(0.002, rel=0.05)


def test_the_group_speed_is_the_slope_of_the_dispersion_relation():
    def omega(k):
        return math.sqrt(9.81 * k * math.tanh(0.7 * k))

    assert group_speed(2.0, 0.7, 9.81) == pytest.approx((omega(2.001) - omega(1.999)) / 0.002, rel=1e-6)


def test_the_crest_of_a_passing_solitary_wave():
    t = np.linspace(0, 3, 61)
    time, height = solitary_wave.crest(t, 0.06 / np.cosh(4 * (t - 1.23)) ** 2 + 1e-4 * np.sin(80 * t))
    assert time == pytest.approx(1.23, abs=2e-3)
    assert height == pytest.approx(0.06, rel=5e-3)


def test_the_linear_record_of_the_sea_has_the_asked_figures():
    waves, step = irregular_sea.WAVES, irregular_sea.Sea.interval
    t = irregular_sea.START + np.arange(0, irregular_sea.RECORD, step)
    height, period = irregular_sea.sea_state(t, irregular_sea.linear_elevation(t, irregular_sea.GAUGE))
    assert height == pytest.approx(waves.Hm0, rel=0.01)
    assert period == pytest.approx(waves.peak_period, rel=0.01)


def test_the_height_and_the_period_of_a_sine():
    waves, step = irregular_sea.WAVES, irregular_sea.Sea.interval
    t = np.arange(0, irregular_sea.RECORD, step)
    height, period = irregular_sea.sea_state(t, 0.02 * np.cos(2 * math.pi / waves.peak_period * t) + 0.01)
    assert height == pytest.approx(4 * 0.02 / math.sqrt(2), rel=1e-9)
    assert period == pytest.approx(waves.peak_period, rel=1e-3)


def test_the_drop_keeps_its_area_and_its_energy():
    a, b = exact_axes(0.8)
    assert a * b == pytest.approx(1.0)
    # energy A^2 (a^2 + b^2) = 2, so that t = integral of db / (A b)
    major = np.linspace(1.0, b, 20001)
    strain = np.sqrt(2 / (major**-2 + major**2))
    assert np.trapezoid(1 / (strain * major), major) == pytest.approx(0.8, rel=1e-7)


def test_the_drop_in_a_central_field_oscillates_with_the_period_of_the_literature():
    round_again, stretched = exact_axes(PERIOD, FIELD), exact_axes(PERIOD / 4, FIELD)
    assert round_again == pytest.approx((1.0, 1.0), rel=1e-3)
    a, b = stretched
    # at rest there: all the energy A^2 (a^2 + b^2) + B^2 (a^2 + b^2) = 4 is the field's
    assert a * b == pytest.approx(1.0) and a * a + b * b == pytest.approx(4.0, rel=1e-3)


def test_centres_of_water_over_planes():
    assert water_over([(0.0, -0.5), (1.0, -0.5)]) == pytest.approx((0.5, -0.25))
    assert water_over([(0.0, -0.6), (1.0, 0.0)]) == pytest.approx((0.3, -0.2))  # a triangle


def test_the_ground_under_the_planes_is_closed(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    write_planes(tmp_path / "planes.stl")
    mesh = trimesh.load_mesh(tmp_path / "planes.stl")
    x = (np.arange(500) + 0.5) * SIDE / 500
    above = np.maximum(RISE_X * x[:, None], RISE_Y * x).mean() * SIDE**2
    assert mesh.is_watertight
    area = (SIDE + 0.4) ** 2
    assert mesh.volume == pytest.approx(area * 1.0 + above, rel=1e-5)
    rim = (area - SIDE**2) * DEPTH  # of water
    water = area * (DEPTH + 1.0) - mesh.volume - rim
    moment = -area * (DEPTH + 1.0) ** 2 / 2 - mesh.volume * mesh.center_mass[2] + rim * DEPTH / 2
    depth, centre = water_over_planes()
    assert water == pytest.approx(depth * SIDE**2, rel=1e-4)
    assert moment / water == pytest.approx(centre, rel=1e-4)


def test_the_plates_series_starts_at_rest_obeys_its_equation_and_ends_in_a_parabola():
    gap, nu, force = poiseuille.GAP, poiseuille.VISCOSITY, poiseuille.FORCE
    z, t, dz, dt = 0.3 * gap, 0.05, 1e-3 * gap, 1e-4
    speed = poiseuille.exact_speed
    assert abs(speed(np.array([z]), 0.0)[0]) < 1e-4 * poiseuille.LARGEST
    below, here, above = speed(np.array([z - dz, z, z + dz]), t)
    rate = (speed(np.array([z]), t + dt)[0] - speed(np.array([z]), t - dt)[0]) / (2 * dt)
    assert rate == pytest.approx(force + nu * (below - 2 * here + above) / dz**2, rel=1e-3)
    np.testing.assert_allclose(speed(np.array([0.0, 0.5 * gap, gap]), 9.0), [0, poiseuille.LARGEST, 0], atol=1e-12)


def test_the_vortices_are_free_of_divergence_and_decay_by_viscosity():
    x, d, t = np.array([0.13, 0.37]), 1e-5, 0.2
    u = taylor_green.exact_velocity
    step = d * np.eye(2)
    gradient = np.array([(u((x + s)[None], t) - u((x - s)[None], t))[0] / (2 * d) for s in step])
    assert abs(np.trace(gradient)) < 1e-8 < np.abs(gradient).max()
    d = 1e-3
    laplacian = (
        sum(u((x + s)[None], t)[0] - 2 * u(x[None], t)[0] + u((x - s)[None], t)[0] for s in d * np.eye(2)) / d**2
    )
    rate = (u(x[None], t + d) - u(x[None], t - d))[0] / (2 * d)
    np.testing.assert_allclose(rate, taylor_green.VISCOSITY * laplacian, rtol=1e-4)


def test_impulse_and_mean_over_a_window():
    t = np.linspace(0, 2, 41)
    assert impulse(t, 3 * t, 0.33, 1.21) == pytest.approx(1.5 * (1.21**2 - 0.33**2))
    np.testing.assert_allclose(low_passed(t, 2 * t + 1, 0.2)[5:-5], (2 * t + 1)[5:-5])
    spike = np.where(np.arange(41) == 20, 1.0, 0.0)
    assert low_passed(t, spike, 0.2).max() == pytest.approx(0.05 / 0.2)
    assert relative_rms(np.array([1.0, 3.0]), np.array([1.0, 2.0]), 2.0) == pytest.approx(math.sqrt(0.5) / 2)


def test_a_late_front_is_shifted_onto_the_experiment():
    assert dam_front.best_shift(dam_front.TIME - 0.3, dam_front.FRONT) == pytest.approx(0.3)


def test_the_ground_under_a_profile_is_closed(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    write_bed([(0.0, -0.5), (0.4, -0.5), (0.4, -0.3), (1.0, -0.3)], tmp_path / "bed.stl")
    mesh = trimesh.load_mesh(tmp_path / "bed.stl")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(2 * (0.4 * 1.0 + 0.6 * 1.2), rel=1e-6)


@pytest.mark.skipif("SPINDRIFT_REFERENCE" not in os.environ, reason="needs the folder of the full records")
def test_the_table_of_the_short_box_agrees_with_the_full_record():
    [file] = Path(os.environ["SPINDRIFT_REFERENCE"]).rglob("kleefsman2005_full*.csv")
    with open(file, encoding="utf-8") as lines:
        record = np.array(list(csv.reader(lines))[1:], float)
    for n in range(4):
        full = impulse(record[:, 0], record[:, 1 + n], *short_box.SPAN)
        assert short_box.IMPULSE[n] == pytest.approx(full, rel=2e-3)
        later = short_box.TABLE[short_box.TABLE[:, 0] >= 0.5]  # the rise before is too steep to be read
        np.testing.assert_allclose(np.interp(later[:, 0], record[:, 0], record[:, 1 + n]), later[:, 1 + n], atol=250)


@pytest.mark.parametrize("spacing, error", [(0.04, 0.006), (0.02, 0.006), (0.01, 0.002)])
def test_the_reservoir_of_the_short_box_holds_its_volume(spacing, error):
    length, depth = short_box.reservoir(spacing)
    assert length * depth == pytest.approx(short_box.RESERVOIR * short_box.DEPTH, rel=error)
    assert depth == pytest.approx(short_box.DEPTH, abs=0.5001 * spacing)


def test_water_arrives_when_its_depth_passes_a_level():
    t = np.array([0.0, 0.1, 0.2, 0.3])
    assert short_box.first_above(t, np.array([0.0, 0.0, 0.02, 0.0]), 0.01) == pytest.approx(0.15)
    assert math.isnan(short_box.first_above(t, np.zeros(4), 0.01))
    lattice = 0.1 * (np.stack(np.meshgrid(*[np.arange(10)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5)
    assert short_box.mean_depth(lattice, np.array([0.5, 0.5]), 0.1, 0.2) == pytest.approx(1.0)


def test_a_jet_that_passes_a_gauge_is_not_the_water_that_arrives():
    t = np.arange(0.0, 1.0, 0.01)
    depth = np.where((t > 0.2) & (t < 0.28), 0.03, 0.0) + np.where(t > 0.605, 0.05, 0.0)
    assert short_box.first_above(t, depth, 0.01) == pytest.approx(0.205, abs=0.01)
    assert short_box.arrival(t, depth) == pytest.approx(0.605, abs=0.01)


@pytest.mark.parametrize("angle", [0.5, 1.0, 1.4])
def test_the_jet_on_a_step_loses_the_momentum_that_the_step_takes(angle):
    height, pressure = jet_step.on_face(angle)
    thrust = 0.5 * ((pressure[1:] + pressure[:-1]) * 0.5 * np.diff(height)).sum()
    assert thrust == pytest.approx(1 - math.cos(angle), abs=1e-5)


def test_a_thick_jet_on_a_step_is_kirchhoffs_flow_past_a_plate():
    heights = tuple(np.linspace(0, 1, 2001))
    drag = np.trapezoid(jet_step.exact_pressure(heights, 1000.0), heights)
    assert drag == pytest.approx(2 * math.pi / (4 + math.pi), abs=0.002)


@pytest.mark.parametrize(
    "name, fluid, theirs", [("dam_tank", 120**3, 3558212), ("column_collapse", 40 * 40 * 100, 731860)]
)
def test_the_scaling_scenes_have_the_size_of_the_source(name, fluid, theirs):
    """Water exactly; walls to within a fifth, for they have other numbers of rows."""
    scene = load_scene(name, level="paper")
    found = estimate(scene, *(bind(scene, name)[n] for n in (0, 2)))
    assert found["fluid"] == fluid
    assert found["wall"] == pytest.approx(theirs - fluid, rel=0.2)


def test_the_channel_of_the_slide_is_24_m_long_with_all_gauges():
    for name in ("slide_channel", "slide_channel_prescribed"):
        for level in (None, "medium", "paper"):
            scene = load_scene(name, level=level)
            assert scene.tank.max[0] - scene.tank.min[0] == pytest.approx(24)
            assert [g.x / 0.24 for g in scene.gauges.values()] == pytest.approx([3, 5, 7.5, 10, 15, 22.5, 35])
