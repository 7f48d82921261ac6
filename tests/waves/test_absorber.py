"""Active absorption: the elevation the piston expects, and its answer to what comes back, by linear theory."""

import math

import numpy as np
import pytest
from test_motions import DEPTH, EVERY_KIND, G, sea

from fsi.scene.model import Scene
from fsi.simulation import absorber
from fsi.waves import piston, piston_transfer, wavenumber
from fsi.waves.kinds.regular import bound_harmonic
from fsi.waves.kinds.solitary import Waves as SolitaryWave
from fsi.waves.linear import evanescent


def scene(**waves) -> Scene:
    tank = {"min": (1.0, -DEPTH), "max": (21.0, 0.3)}
    return Scene.model_validate({"spacing": 0.02, "duration": 9.0, "tank": tank, "waves": {"absorb": True} | waves})


@pytest.mark.parametrize("kd", [0.3, 1.0, 3.0])
def test_the_modes_before_a_piston_add_up_to_its_velocity(kd):
    """sum of 4 sin / (2 k_j d + sin 2 k_j d) cos k_j (z + d), and its like with sinh and cosh for the wave, is 1."""
    omega = math.sqrt(G * kd / DEPTH * math.tanh(kd))
    k, share = evanescent(omega, DEPTH, G, 4000)
    np.testing.assert_allclose(-G * k[:9] * np.tan(k[:9] * DEPTH), omega**2, rtol=1e-6)
    for height in (0.1, 0.25, 0.4):  # above the bed
        wave = 4 * math.sinh(kd) * math.cosh(kd / DEPTH * height) / (2 * kd + math.sinh(2 * kd))
        near = (share / np.sin(k * DEPTH) * np.cos(k * height)).sum()
        assert wave + near == pytest.approx(1.0, abs=2e-3)


def test_a_stokes_wave_of_second_order():
    """Deep water: a^2 k / 2. kd = 1: a^2 k / 4 times 5.4782."""
    assert bound_harmonic(0.01, 40.0, 1.0) == pytest.approx(0.5 * 0.01**2 * 40, rel=1e-9)
    assert bound_harmonic(0.1, 1.0, 1.0) == pytest.approx(0.0025 * 5.4782, rel=1e-4)


def test_the_surface_of_every_kind_of_waves():
    """Well before the piston only the travelling wave is left; it moves at its speed, and at the piston its volume is what
    the piston displaces."""
    found = {name: w.surface(piston(w, DEPTH, G), DEPTH, G) for name, w in EVERY_KIND.items()}
    k = wavenumber(2 * math.pi / 1.5, DEPTH, G)
    later = 2.0 * k * 1.5 / (2 * math.pi)  # the time over 2 m
    assert found["regular"](9.0, 6.0) == pytest.approx(found["regular"](9.0 + later, 8.0), abs=1e-9)
    crest = max(found["second order"](9.0 + t, 6.0) for t in np.linspace(0, 1.5, 500))
    assert crest == pytest.approx(0.05 + bound_harmonic(0.05, k, DEPTH), rel=1e-4)
    record = [found["irregular"](t, 3.0) for t in np.linspace(1000, 1300, 3001)]
    assert 4 * np.std(record) == pytest.approx(sea().Hm0, rel=0.1)
    assert max(found["packet"](t, 0.0) for t in np.linspace(0, 2, 500)) == pytest.approx(0.025, rel=1e-3)
    assert found["packet"](30.0, 0.0) == 0.0
    t = np.linspace(0, 12, 4001)
    motion = piston(EVERY_KIND["solitary"], DEPTH, G)
    path = np.array([motion(a)[:2] for a in t])
    eta = np.array([found["solitary"](a, x) for a, (x, _) in zip(t, path, strict=True)])
    inside = (t > motion.start) & (t < motion.start + motion.time)
    np.testing.assert_allclose((motion.speed * eta / (DEPTH + eta))[inside], path[inside, 1], rtol=1e-6)


def test_what_the_piston_answers_to_a_wave_is_not_reflected():
    """A wave e comes in and o goes out: the surface stands at e + o, and the piston's velocity is (o - e) over the gain.
    Here e is a wave of the very period that the gain is for; the correction's lag and its recall leave some of it."""
    at = scene(wave_height=0.1, period=2.5, order=1)
    motion = piston(at.waves, DEPTH, G)
    control = absorber.Absorber(at, motion, DEPTH)
    omega, dt, expected = 2 * math.pi / 2.5, 4e-3, at.waves.surface(motion, DEPTH, G)
    outgoing, state = [], {}

    def level(point):
        assert point[0] == pytest.approx(1.0 + state["face"] + 2 * at.smoothing_length)
        return state["made"] + state["in"] + state["out"]

    for t in np.arange(0, 20, dt):
        state["face"] = face = motion(t)[0] + control.shift
        state["made"] = expected(t, face + 2 * at.smoothing_length)
        state["in"] = 0.03 * math.sin(omega * t)
        state["out"] = state["in"] + control.rate / at.waves.gain(DEPTH, G)
        before = control.shift
        _, _, after = control.step(t, dt, level, motion(t)[0])
        assert control.shift == pytest.approx(before + dt * after)
        outgoing.append(state["out"])
    assert np.abs(outgoing[3000:]).max() < 0.06 * 0.03


def test_without_waves_coming_back_the_piston_returns_to_its_path():
    at = scene(kind="solitary", wave_height=0.1)
    motion = piston(at.waves, DEPTH, G)
    control = absorber.Absorber(at, motion, DEPTH)
    control.shift = 0.05
    expected = at.waves.surface(motion, DEPTH, G)
    times = np.arange(0, 60, 0.01)
    for t in times:
        x = motion(t)[0]
        made = expected(t, x + control.shift + 2 * at.smoothing_length)
        control.step(t, 0.01, lambda _, made=made: made, x)
    decay = math.exp(-60 / (absorber.RECALL * math.sqrt(DEPTH / G)))
    assert control.shift == pytest.approx(0.05 * decay, rel=0.05)


def test_the_piston_keeps_to_the_room_it_has():
    at = scene(kind="solitary", wave_height=0.1)
    motion = piston(at.waves, DEPTH, G)
    control = absorber.Absorber(at, motion, DEPTH)
    back, forth = at.waves.excursion(motion)
    for n in range(2000):
        control.step(n * 0.01, 0.01, lambda _: 5.0, 0.0)
        assert back <= control.shift <= forth
    assert control.shift == pytest.approx(back)
    assert control.step(99.0, 0.01, lambda _: math.nan, 0.0)[2] > 0  # no water at the piston: no correction


def test_the_settling_of_still_water_moves_the_piston_by_less_than_it_settles():
    at = scene(kind="solitary", wave_height=0.1, start=1000.0)
    control = absorber.Absorber(at, piston(at.waves, DEPTH, G), DEPTH)
    settled = 0.07 * at.spacing
    for n in range(6000):
        control.step(n * 0.01, 0.01, lambda _: -settled, 0.0)
    assert 0 < control.shift < settled


def test_in_three_dimensions_the_surface_is_read_across_the_tank():
    box = Scene.model_validate(
        {
            "dimension": 3,
            "spacing": 0.05,
            "duration": 1.0,
            "tank": {"min": (0, -1, -DEPTH), "max": (9, 3, 0.3)},
            "waves": {"kind": "solitary", "wave_height": 0.1, "absorb": True},
        }
    )
    control, places = absorber.Absorber(box, piston(box.waves, DEPTH, G), DEPTH), []
    control.step(0.0, 0.01, lambda point: places.append(point) or 0.0, 0.0)
    x = 2 * box.smoothing_length
    np.testing.assert_allclose(places, [(x, -0.2), (x, 1.0), (x, 2.2)])


def test_the_gain_is_that_of_the_waves_and_of_long_waves():
    long = scene(wave_height=0.01, period=20.0).waves
    none = SolitaryWave(kind="solitary", wave_height=0.1)
    assert long.gain(DEPTH, G) == pytest.approx(none.gain(DEPTH, G), rel=0.01)
    k = wavenumber(2 * math.pi / 1.5, DEPTH, G)
    expected = 2 * math.pi / 1.5 / piston_transfer(k * DEPTH)
    assert EVERY_KIND["packet"].gain(DEPTH, G) == pytest.approx(expected)


def test_modes_of_many_frequencies_are_those_of_each():
    omega = np.array([1.0, 2.5, 6.0])
    decay, share = evanescent(omega, DEPTH, G)
    for n, one in enumerate(omega):
        alone = evanescent(one, DEPTH, G)
        np.testing.assert_allclose([decay[n], share[n]], alone, rtol=1e-12)
