"""Wave theory, and the motion of the piston for every kind of waves."""

import math

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.waves import piston, piston_transfer, wavenumber
from fsi.waves.kinds.irregular import Waves as IrregularWaves
from fsi.waves.kinds.irregular import spectrum
from fsi.waves.kinds.packet import Waves as WavePacket
from fsi.waves.kinds.regular import RegularPiston, second_order_stroke
from fsi.waves.kinds.regular import Waves as RegularWaves
from fsi.waves.kinds.solitary import Waves as SolitaryWave
from fsi.waves.kinds.table import TablePiston
from fsi.waves.sponge import reflection

DEPTH, G = 0.5, 9.81


def sea(**keys) -> IrregularWaves:
    return IrregularWaves(kind="irregular", **{"Hm0": 0.08, "peak_period": 1.5} | keys)


@pytest.mark.parametrize("kd", [0.01, 0.3, 1.0, 3.0, 20.0, 400.0])
def test_wavenumber_solves_the_dispersion_relation(kd):
    depth, g = 0.7, 9.81
    omega = math.sqrt(g * kd / depth * math.tanh(kd))
    assert wavenumber(omega, depth, g) * depth == pytest.approx(kd, rel=1e-10)


@pytest.mark.parametrize("kd, expected", [(0.01, 0.01), (1.0, 0.9817), (50.0, 2.0)])
def test_piston_transfer(kd, expected):
    """kd = 1: (2 cosh 2 - 2) / (sinh 2 + 2) = 0.9817; shallow water: H/S = kd; deep: 2."""
    assert piston_transfer(kd) == pytest.approx(expected, rel=2e-4)


def derivatives_agree(motion, times):
    e = 1e-5
    for t in times:
        _, u, a = motion(t)
        assert (motion(t + e)[0] - motion(t - e)[0]) / (2 * e) == pytest.approx(u, abs=1e-7)
        assert (motion(t + e)[1] - motion(t - e)[1]) / (2 * e) == pytest.approx(a, abs=1e-5)


EVERY_KIND = {
    "regular": RegularWaves(wave_height=0.1, period=1.5, order=1),
    "second order": RegularWaves(wave_height=0.1, period=1.5, order=2),
    "irregular": sea(),
    "solitary": SolitaryWave(kind="solitary", wave_height=0.15, start=0.5),
    "packet": WavePacket(
        kind="packet",
        groups=[
            {"wave_height": 0.05, "period": 1.0, "waves": 2},
            {"wave_height": 0.08, "period": 1.5, "waves": 2.5},
        ],
    ),
}


@pytest.mark.parametrize("waves", EVERY_KIND.values(), ids=EVERY_KIND)
def test_every_motion_starts_at_zero_keeps_within_its_reach_and_differentiates(waves):
    motion = piston(waves, DEPTH, G)
    assert motion(0.0)[:2] == (0.0, 0.0)
    derivatives_agree(motion, [0.3, 0.61, 1.1, 1.9, 2.87, 4.7])
    back, forth = motion.excursion
    path = [motion(t)[0] for t in np.linspace(0, 60, 6001)]
    assert back <= min(path) and max(path) <= forth
    steps = np.diff([motion(t)[1] for t in np.linspace(0, 8, 8001)])
    assert np.abs(steps).max() < 0.01  # the velocity has no jumps


def test_regular_piston_starts_smoothly_and_differentiates():
    motion = RegularPiston(stroke=0.1, omega=4.0, ramp=2.0)
    assert motion(0.0)[:2] == (0.0, 0.0)
    derivatives_agree(motion, [0.3, 1.1, 1.9, 2.5, 7.7])


def test_table_piston_passes_through_its_points(tmp_path):
    t = np.linspace(0, 3, 13)
    file = tmp_path / "motion.csv"
    file.write_text("time,x\n" + "\n".join(f"{a},{0.1 * math.sin(2 * a)}" for a in t))
    motion = TablePiston(file)
    assert all(motion(a)[0] == pytest.approx(0.1 * math.sin(2 * a), abs=1e-12) for a in t)
    derivatives_agree(motion, [0.1, 1.37, 2.9])
    assert motion(9.0) == (pytest.approx(0.1 * math.sin(6)), 0.0, 0.0)


@pytest.mark.parametrize("text", ["t,x\n0,0\n1,1\n", "t,x\n0,0\n2,1\n1,2\n", "t,x\n0,zero\n", ""])
def test_bad_tables_are_refused(tmp_path, text):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(SceneError, match=r"bad\.csv"):
        TablePiston(file)


def test_second_harmonic_of_the_piston():
    """kd = 1, H = d / 10: 3 cosh 1 / sinh^3 1 = 2.852 and 2 S/H = 2.037, so 0.01 d / 32 times 0.815. In deep water
    H^2 / (32 d) (0 - 1)."""
    assert second_order_stroke(0.1, 1.0, 1.0) == pytest.approx(0.01 / 32 * (2.8522 - 2.0371), rel=1e-3)
    assert second_order_stroke(0.1, 40.0, 1.0) == pytest.approx(-0.01 / 32, rel=1e-6)
    motion = RegularPiston(stroke=0.1, omega=2.0, ramp=0.0, second=0.01)
    assert motion(0.3)[0] == pytest.approx(0.05 * math.sin(0.6) + 0.01 * math.sin(1.2))


def test_the_second_order_is_left_out_where_it_does_not_hold():
    long = piston(RegularWaves(wave_height=0.1, period=4.0), DEPTH, G)
    short = piston(RegularWaves(wave_height=0.1, period=1.5), DEPTH, G)
    assert long.second == 0.0 < abs(short.second)


@pytest.mark.parametrize("shape, gamma", [("jonswap", 3.3), ("jonswap", 1.0), ("pierson_moskowitz", 1.0)])
def test_a_sea_has_its_height_and_its_spectrum(shape, gamma):
    """The moments of the components are those of the spectrum, and the spectrum's peak is where it should be."""
    keys = {"gamma": gamma} if shape == "jonswap" else {}
    motion = piston(sea(spectrum=shape, components=1000, highest=4.0, **keys), DEPTH, G)
    energy, f = 0.5 * motion.wave_amplitude**2, motion.omega / (2 * math.pi)
    assert 4 * math.sqrt(energy.sum()) == pytest.approx(0.08, rel=1e-12)
    fine = np.linspace(0.5, 4.0, 20001) / 1.5
    density = spectrum(fine, 1 / 1.5, gamma)
    assert fine[density.argmax()] == pytest.approx(1 / 1.5, rel=1e-3)
    for order in (-1, 1, 2):
        exact = np.trapezoid(fine**order * density, fine) / np.trapezoid(density, fine)
        assert (f**order * energy).sum() / energy.sum() == pytest.approx(exact, rel=2e-3)
    transfer = [piston_transfer(wavenumber(w, DEPTH, G) * DEPTH) for w in motion.omega[::100]]
    np.testing.assert_allclose(motion.wave_amplitude[::100] / motion.amplitude[::100], transfer)


def test_pierson_moskowitz_has_the_energy_of_its_formula():
    """With gamma = 1 the share of the energy below f is exp(-1.25 (peak/f)^4)."""
    f = np.linspace(0.3, 1.3, 20001)
    density = spectrum(f, 1.0, 1.0)
    assert np.trapezoid(density, f) * 5 == pytest.approx(math.exp(-1.25 / 1.3**4), rel=1e-6)


def test_a_seed_gives_the_same_sea_again_and_another_seed_another():
    first, again, other = (piston(sea(seed=seed), DEPTH, G) for seed in (7, 7, 8))
    assert [first(t) for t in (1.0, 33.3)] == [again(t) for t in (1.0, 33.3)]
    assert first(33.3)[0] != other(33.3)[0]
    assert first(33.3) == first(33.3)  # however often and in whatever order it is asked
    late = np.array([first(t)[0] for t in np.linspace(1000, 1300, 3000)])
    assert late.std() == pytest.approx(math.sqrt(0.5 * (first.amplitude**2).sum()), rel=0.15)


@pytest.mark.parametrize("theory", ["boussinesq", "rayleigh"])
@pytest.mark.parametrize("height", [0.05, 0.15, 0.3])
def test_a_solitary_wave_takes_its_volume_from_the_piston(theory, height):
    """The stroke times the depth is the volume under H sech^2 k x, 2 H / k; the piston moves with the water at its face,
    which the wave carries past it at the speed c."""
    motion = piston(SolitaryWave(kind="solitary", wave_height=height, theory=theory), DEPTH, G)
    k, c = motion.k, math.sqrt(G * (DEPTH + height))
    assert k == pytest.approx(math.sqrt(0.75 * height / (DEPTH**2 * (DEPTH + (height if theory == "rayleigh" else 0)))))
    assert motion.stroke * DEPTH == pytest.approx(2 * height / k, rel=1e-4)
    assert motion(motion.time)[:2] == (motion.stroke, 0.0)
    crest = 0.5 * motion.time  # when it passes the piston
    for t in np.linspace(0, motion.time, 9)[1:-1]:
        x, u, _ = motion(t)
        eta = height / math.cosh(k * (c * (t - crest) - (x - 0.5 * motion.stroke))) ** 2
        assert u == pytest.approx(c * eta / (DEPTH + eta), rel=1e-9)


def test_a_packet_counts_its_waves():
    motion = piston(EVERY_KIND["packet"], DEPTH, G)
    assert motion.end == pytest.approx(2 * 1.0 + 2.5 * 1.5)
    t = np.linspace(0, 6, 6001)
    x, u, _ = np.array([motion(a) for a in t]).T
    zeros = t[:-1][u[:-1] * u[1:] < 0]
    np.testing.assert_allclose(zeros[:3], [0.5, 1.0, 1.5], atol=2e-3)
    np.testing.assert_allclose(zeros[-4:], 2 + 0.75 * np.arange(1, 5), atol=2e-3)
    strokes = [h / piston_transfer(wavenumber(2 * math.pi / p, DEPTH, G) * DEPTH) for h, p in ((0.05, 1), (0.08, 1.5))]
    assert x.max() - x[0] == pytest.approx(max(strokes), rel=1e-5)
    assert u[t < 2].max() == pytest.approx(0.5 * strokes[0] * 2 * math.pi, rel=1e-4)
    assert -u[t > 2].min() == pytest.approx(0.5 * strokes[1] * 2 * math.pi / 1.5, rel=1e-4)
    assert motion(99.0) == (pytest.approx(strokes[1]), 0.0, 0.0)  # five half waves leave it one stroke further


def test_a_damping_zone_reflects_by_long_wave_theory():
    """No damping reflects all; a thin stiff zone is a wall. A slow rise to a small rate reflects what passes it twice,
    exp(-2 integral of r/2 over x) = exp(-2 pi length rate / 3), and next to nothing before."""
    assert reflection(1.0, 1e-9) == pytest.approx(1.0, abs=1e-6)
    assert reflection(0.02, 1e4) == pytest.approx(1.0, abs=0.05)
    assert reflection(3.0, 0.2) == pytest.approx(math.exp(-2 * math.pi * 3.0 * 0.2 / 3), rel=0.01)
    assert reflection(1.0, 3.0) < 0.03 < reflection(0.5, 3.0)
    assert all(0 <= reflection(length, rate) <= 1 + 1e-9 for length in (1e-9, 30.0, 1e9) for rate in (1e-9, 1e3, 1e12))
