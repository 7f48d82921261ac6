"""Incident waves satisfy the equations of waves, and what is made of them keeps the water together."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fsi.waves import load_kind
from fsi.waves.incident import XI, ZETA, Paddle, Table, linear_waves, stokes_wave
from fsi.waves.kinds.irregular import Waves as Irregular
from fsi.waves.kinds.regular import bound_harmonic
from fsi.waves.linear import wavenumber
from fsi.waves.second_order import GroupPaddle, spread, with_bound_waves

G, DEPTH, PERIOD = 9.81, 0.6, 1.2
STEP = 1e-4
KINDS = {
    "regular": {"wave_height": 0.06, "period": PERIOD},
    "irregular": {"Hm0": 0.05, "peak_period": PERIOD, "components": 20},
    "focused": {"crest": 0.04, "peak_period": PERIOD, "time": 3.0},
}


def waves_of(kind, **keys):
    return load_kind(kind).model_validate({"kind": kind} | KINDS.get(kind, {}) | keys).incident(DEPTH, G)


def points(count=40, dim=2):
    rng = np.random.default_rng(0)
    across = rng.uniform(-2, 2, (count, dim - 1))
    return np.column_stack([across, rng.uniform(-DEPTH, -0.05, count)])


def slope(f, x, axis, step=STEP):
    e = np.zeros(x.shape[1])
    e[axis] = step
    return (f(x + e) - f(x - e)) / (2 * step)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dim, heading", [(2, 0.0), (2, math.pi), (3, 0.7)])
def test_the_flow_is_incompressible_without_curl_and_stays_over_the_bed(kind, dim, heading):
    waves, x, t = waves_of(kind).turned(heading, 0.0), points(dim=dim), 1.3
    u = lambda y: waves.velocity(t, y)  # noqa: E731
    size = np.abs(u(x)).max() / DEPTH
    assert np.abs(sum(slope(u, x, d)[:, d] for d in range(dim))).max() < 1e-5 * size
    assert np.abs(slope(u, x, 0)[:, -1] - slope(u, x, dim - 1)[:, 0]).max() < 1e-5 * size
    x[:, -1] = -DEPTH
    assert np.abs(u(x)[:, -1]).max() < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_every_component_disperses_and_accelerates_as_it_moves(kind):
    waves, x, t = waves_of(kind), points(), 0.4
    rates = (waves.velocity(t + STEP, x) - waves.velocity(t - STEP, x)) / (2 * STEP)
    np.testing.assert_allclose(waves.acceleration(t, x), rates, atol=1e-5)
    if not waves.steady:
        np.testing.assert_allclose(waves.k, [wavenumber(w, DEPTH, G) for w in waves.omega])


def residuals(height):
    """What the kinematic condition and the pressure at the surface are off, for a wave of third order."""
    waves, t = stokes_wave(height, PERIOD, DEPTH, G), 0.2
    x = np.linspace(0, 2 * math.pi / waves.k[0], 101)[:, None]
    eta = lambda y, time=t: waves.elevation(time, y)  # noqa: E731
    surface = np.column_stack([x, eta(x)])
    u = waves.velocity(t, surface)
    rise = (eta(x, t + STEP) - eta(x, t - STEP)) / (2 * STEP)
    kinematic = rise + u[:, 0] * slope(eta, x, 0) - u[:, 1]
    return np.abs(kinematic).max() / (waves.omega[0] * height), np.ptp(waves.pressure(t, surface, 1.0)) / (G * height)


def test_the_surface_conditions_hold_to_third_order():
    """Half the height: residuals over the height fall with its cube, or with its square where the return flow does that."""
    for high, low in zip(residuals(0.06), residuals(0.03), strict=True):
        assert low < 0.003 and high / low > 3.5


def test_waves_of_finite_height_meet_the_surface_conditions():
    pytest.importorskip("raschii")
    waves = waves_of("nonlinear", wave_height=0.1, period=PERIOD)
    x = np.linspace(0, 2 * math.pi / waves.k[0], 101)[:, None]
    surface = np.column_stack([x, waves.elevation(0.2, x)])
    assert np.ptp(waves.pressure(0.2, surface, 1.0)) < 0.01 * G * 0.1  # as far as the return flow counts
    assert np.ptp(surface[:, 1]) == pytest.approx(0.1, rel=1e-3)
    second = stokes_wave(0.1, PERIOD, DEPTH, G)
    assert waves.k[0] == pytest.approx(second.k[0], rel=2e-3)  # by the speed of the third order
    assert waves.elevation_amplitude[1] == pytest.approx(second.elevation_amplitude[1], rel=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_carried_water_keeps_its_area_and_lies_under_the_surface(kind):
    waves, t = waves_of(kind), 3.0
    corner = np.array([[0, 0], [STEP, 0], [0, STEP], [-STEP, 0], [0, -STEP]])
    for home in points(12):
        _, e, n, w, s = waves.carried(t, home + corner)
        east, north = (e - w) / (2 * STEP), (n - s) / (2 * STEP)
        assert east[0] * north[1] - east[1] * north[0] == pytest.approx(1, abs=1e-5)
    x = np.linspace(-2, 2, 101)
    top = waves.carried(t, np.column_stack([x, np.zeros_like(x)]))
    assert np.abs(waves.elevation(t, top[:, :1]) - top[:, 1]).max() < 0.1 * np.ptp(top[:, 1])
    assert np.abs(waves.pressure_of(t, np.column_stack([x, np.zeros_like(x)]), 1.0)).max() < 0.03 * G * np.ptp(
        top[:, 1]
    )


def test_paddles_move_with_the_water_and_let_none_through():
    """dD/dt + w D_z = u at x = D to second order, without its mean, the drift."""
    times, z, off = np.linspace(0, PERIOD, 48, endpoint=False), np.linspace(-0.5, -0.1, 9), {}
    for height in (0.06, 0.03):
        waves = stokes_wave(height, PERIOD, DEPTH, G)
        paddle, through = Paddle(waves, np.eye(1), np.zeros((1, 1)), z), []
        for t in times:
            way, speed, acceleration, *_ = (part[..., 0, :].reshape(-1) for part in paddle.at(t))
            u = waves.velocity(t, np.column_stack([way, z]))
            lower = Paddle(waves, np.eye(1), np.zeros((1, 1)), z - STEP)
            bend = (paddle.at(t)[0][0, 0] - lower.at(t)[0][0, 0]) / STEP
            through.append(speed + u[:, 1] * bend - u[:, 0])
            before, after = paddle.at(t - STEP), paddle.at(t + STEP)
            np.testing.assert_allclose(speed, (after[0] - before[0])[0, 0] / (2 * STEP), atol=1e-6)
            np.testing.assert_allclose(acceleration, (after[1] - before[1])[0, 0] / (2 * STEP), atol=1e-5)
        through = np.array(through) - np.mean(through, axis=0)
        off[height] = np.abs(through).max() / height
    assert off[0.06] < 0.1 and 3 < off[0.06] / off[0.03] < 5


def test_tables_are_the_sums():
    waves = waves_of("irregular")
    s, z = np.linspace(-1, 1, 5), np.linspace(-0.5, 0, 4)
    at = np.stack(np.meshgrid(s, z, indexing="ij"), -1).reshape(-1, 2)
    found = Table(waves, np.eye(1), s[:, None], z, [XI(0), ZETA]).at(0.7, 1)
    exact = waves.velocity(0.7, at) - [waves.mean_flow(0.7), 0]
    np.testing.assert_allclose(found.reshape(2, -1).T, exact, atol=1e-12)


def test_a_seed_gives_the_waves_of_the_flume():
    kind = Irregular(kind="irregular", Hm0=0.05, peak_period=PERIOD, ramp=0.0, seed=3)
    motion = kind.piston(DEPTH, G)
    surface, waves = kind.surface(motion, DEPTH, G), kind.incident(DEPTH, G)
    for t in (10.0, 11.3):  # evanescent modes are gone 3 m from the piston
        assert waves.elevation(t, np.array([[3.0]]))[0] == pytest.approx(surface(t, 3.0), abs=1e-4)
    assert math.sqrt(8 * (waves.elevation_amplitude**2).sum()) == pytest.approx(0.05)


def test_a_group_meets_at_its_focus():
    waves = waves_of("focused", place=0.5)
    there = waves.elevation(3.0, np.array([[0.5]]))[0]
    assert there == pytest.approx(0.04) == pytest.approx(waves.crest)
    around = [waves.elevation(t, np.linspace(-3, 3, 61)[:, None]).max() for t in (2.0, 2.7, 3.3, 4.0)]
    assert max(around) < there
    surface = load_kind("focused").model_validate({"kind": "focused", **KINDS["focused"], "place": 3.0})
    motion = surface.piston(DEPTH, G)
    assert surface.surface(motion, DEPTH, G)(3.0, 3.0) == pytest.approx(0.04, rel=0.02)


def test_a_ramp_begins_at_rest_and_ends_in_the_waves():
    waves, x = linear_waves(np.array([0.03]), np.array([5.0]), np.zeros(1), DEPTH, G), points(5)
    slow = waves.turned(0.0, 2.0)
    assert np.abs(slow.velocity(0.0, x)).max() == 0 and np.abs(slow.displacement(0.0, x)).max() == 0
    np.testing.assert_array_equal(slow.velocity(2.5, x), waves.velocity(2.5, x))


def pair(height, second=True):
    """Two linear waves of half this height each, with or without what is bound to them."""
    plain = linear_waves(
        np.array([0.25, 0.25]) * height, 2 * math.pi / np.array([1.2, 0.9]), np.array([0.3, 1.0]), DEPTH, G
    )
    return with_bound_waves(plain) if second else plain


def test_a_wave_carries_the_second_harmonic_of_stokes():
    waves = with_bound_waves(linear_waves(np.array([0.03]), np.array([5.0]), np.zeros(1), DEPTH, G))
    k = waves.k[0]
    assert waves.k[1] == pytest.approx(2 * k) and waves.omega[1] == pytest.approx(10.0)
    assert waves.elevation_amplitude[1] == pytest.approx(bound_harmonic(0.03, k, DEPTH), rel=1e-9)
    speed = (
        0.75 * 0.03**2 * 5.0 * k * math.cosh(2 * k * DEPTH) / math.sinh(k * DEPTH) ** 4
    )  # Dean & Dalrymple 1991, ch. 11
    assert 2 * k * waves.potential[1] * 10.0 == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("off", [None, np.array([-0.4, 0.5])])
def test_bound_waves_meet_the_surface_conditions_to_second_order(off):
    """What pressure and kinematic condition are off on the surface falls with the cube of the height, but for its mean."""

    def residuals(height, second):
        waves, t = replace(pair(height, second=False), off=off, drift=0.0), 0.2
        waves = with_bound_waves(waves) if second else waves
        feet = np.random.default_rng(1).uniform(-2, 2, (300, 2))
        eta = lambda y, time=t: waves.elevation(time, y)  # noqa: E731
        surface = np.column_stack([feet, eta(feet)])
        u = waves.velocity(t, surface)
        rise = (eta(feet, t + STEP) - eta(feet, t - STEP)) / (2 * STEP)
        kinematic = rise + u[:, 0] * slope(eta, feet, 0) + u[:, 1] * slope(eta, feet, 1) - u[:, 2]
        return np.std(waves.pressure(t, surface, 1.0)), np.std(kinematic)

    for part in range(2):
        high, low, rough = residuals(0.04, True)[part], residuals(0.02, True)[part], residuals(0.02, False)[part]
        assert 7 < high / low < 9 and low < 0.3 * rough


def test_walls_let_no_water_through_under_groups():
    """dD/dt + w D_z = u at x = D to second order, at the frequency of the groups too; but for the mean."""
    times, z, off = np.linspace(0, 3.6, 120, endpoint=False), np.linspace(-0.5, -0.1, 7), {}
    for height in (0.06, 0.03):
        waves = pair(height)
        paddle, lower = (GroupPaddle(waves, np.eye(1), np.zeros((1, 1)), y) for y in (z, z - STEP))
        through = []
        for t in times:  # groups of 3.6 s
            way, speed, *_ = (part[..., 0, :].reshape(-1) for part in paddle.at(t))
            u = waves.velocity(t, np.column_stack([way, z])) - [waves.mean_flow(t), 0]
            through.append(speed + u[:, 1] * (way - lower.at(t)[0][0, 0]) / STEP - u[:, 0])
        through = np.array(through) - np.mean(through, axis=0)
        slow = np.abs(np.exp(2j * math.pi / 3.6 * times) @ through).max() / len(times)
        off[height] = np.array([np.abs(through).max(), slow])
    assert (off[0.06] / off[0.03] > 6).all()


def test_a_spread_sea_runs_along_its_heading():
    waves = spread(waves_of("irregular", components=2000), 8.0, 3)
    mean = np.exp(1j * waves.off).mean()
    assert np.angle(mean) == pytest.approx(0, abs=0.05)
    assert abs(mean) == pytest.approx(8 / 9, abs=0.01)  # s / (s + 1)
    x, t = points(20, dim=3), 0.7
    u = lambda y: waves.velocity(t, y)  # noqa: E731
    size = np.abs(u(x)).max() / DEPTH
    assert np.abs(sum(slope(u, x, d)[:, d] for d in range(3))).max() < 1e-4 * size
    assert np.abs(slope(u, x, 0)[:, 1] - slope(u, x, 1)[:, 0]).max() < 1e-4 * size
