"""Waves from the field: a record at a gauge, a spectrum in a file, waves of finite height."""

import math

import numpy as np
import pytest

from fsi.waves import load_kind
from fsi.waves.kind import Water
from fsi.waves.kinds.regular import Waves as Regular
from fsi.waves.linear import piston_transfer, wavenumber

G, DEPTH = 9.81, 0.6
slow = pytest.mark.slow  # seconds each in the libraries
WATER = Water(DEPTH, G, 0.02)


def record(tmp_path, eta, length=40.0, step=0.05):
    t = np.arange(0.0, length, step)
    file = tmp_path / "gauge.csv"
    np.savetxt(file, np.column_stack([t, eta(t)]), delimiter=",", header="t,eta", comments="")
    return file


def sea(t):
    """Three regular waves that fit into 40 s."""
    return sum(
        a * np.cos(2 * math.pi * f * t + p) for a, f, p in ((0.03, 0.5, 0.3), (0.02, 0.65, 2.0), (0.01, 0.8, 4.0))
    )


def test_a_record_comes_back_at_its_gauge(tmp_path):
    """The linear elevation of the piston's motion at the gauge is the record, after the delay."""
    waves = load_kind("measured")(kind="measured", file=record(tmp_path, sea), distance=4.0, delay=12.0, ramp=2.0)
    motion = waves.piston(DEPTH, G)
    surface = waves.surface(motion, DEPTH, G)
    times = np.linspace(4.0, 36.0, 80)  # of the record, away from its ends
    made = np.array([surface(t + 12.0, 4.0) for t in times])
    np.testing.assert_allclose(made, sea(times), atol=2e-3)


def test_the_piston_of_a_record_has_its_own_velocity(tmp_path):
    motion = load_kind("measured")(kind="measured", file=record(tmp_path, sea), distance=2.0).piston(DEPTH, G)
    for t in (0.5, 3.0, 11.0):
        (a, _, _), (b, _, _), (_, u, acc) = motion(t - 1e-4), motion(t + 1e-4), motion(t)
        assert u == pytest.approx((b - a) / 2e-4, abs=1e-6)
        assert acc == pytest.approx((motion(t + 1e-4)[1] - motion(t - 1e-4)[1]) / 2e-4, abs=1e-5)
        assert motion.excursion[0] <= motion(t)[0] <= motion.excursion[1]


@pytest.mark.parametrize(
    "text, why", [("t,x\n" + "".join(f"{n},0.1\n" for n in range(20)), "never changes"), ("t,x\n0,1\n", "row")]
)
def test_records_without_waves_are_refused(tmp_path, text, why):
    file = tmp_path / "gauge.csv"
    file.write_text(text)
    faults = list(load_kind("measured")(kind="measured", file=file, distance=1.0).faults(WATER))
    assert len(faults) == 1 and why in faults[0][1]


def spectrum_file(tmp_path, scale=1.0):
    f = np.linspace(0.2, 2.0, 181)
    density = 1e-3 * np.exp(-0.5 * ((f - 0.6) / 0.1) ** 2)
    file = tmp_path / "sea.csv"
    rows = np.column_stack([f / math.sqrt(scale), density * scale**2.5])
    np.savetxt(file, rows, delimiter=",", header="f,S", comments="")
    return file, 4 * math.sqrt(1e-3 * 0.1 * math.sqrt(2 * math.pi))


@pytest.mark.parametrize("scale", [1.0, 40.0])
def test_a_spectrum_makes_a_sea_of_its_height_and_peak(tmp_path, scale):
    file, Hm0 = spectrum_file(tmp_path, scale)
    waves = load_kind("spectrum")(kind="spectrum", file=file, scale=scale)
    piston = waves.piston(DEPTH, G)
    assert 4 * math.sqrt(0.5 * (piston.wave_amplitude**2).sum()) == pytest.approx(Hm0, rel=1e-3)
    [train] = waves.trains(WATER)
    assert train.period == pytest.approx(1 / 0.6, rel=0.01) and train.height == pytest.approx(Hm0, rel=1e-3)
    assert np.average(piston.omega, weights=piston.wave_amplitude**2) == pytest.approx(2 * math.pi * 0.6, rel=0.02)


@slow
def test_a_reader_of_wavespectra_gives_the_same_sea_as_the_table(tmp_path):
    pytest.importorskip("wavespectra")
    import xarray

    file, Hm0 = spectrum_file(tmp_path)
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    efth = xarray.DataArray(rows[None, :, 1:] / 360 * np.ones(36), dims=("time", "freq", "dir"), name="efth")
    data = efth.assign_coords(time=[0], freq=rows[:, 0], dir=np.arange(0.0, 360.0, 10.0)).to_dataset()
    data.to_netcdf(tmp_path / "sea.nc", engine="h5netcdf")
    kind = load_kind("spectrum")
    read = kind(kind="spectrum", file=tmp_path / "sea.nc", format="netcdf")
    assert read.trains(WATER)[0].height == pytest.approx(Hm0, rel=1e-3)
    one, other = read.piston(DEPTH, G), kind(kind="spectrum", file=file).piston(DEPTH, G)
    np.testing.assert_allclose(one.amplitude, other.amplitude, rtol=1e-3)
    for bad, why in (({"format": "morse"}, "no reader"), ({"format": "netcdf", "time": 3}, "has 1 of them")):
        [(_, fault, _)] = kind(kind="spectrum", file=tmp_path / "sea.nc", **bad).faults(WATER)
        assert why in fault


def nonlinear(height, period, **keys):
    pytest.importorskip("raschii")
    return load_kind("nonlinear")(kind="nonlinear", wave_height=height, period=period, **keys)


@slow
def test_a_low_nonlinear_wave_needs_the_linear_piston():
    motion = nonlinear(0.002, 1.8, ramp=0.0).piston(DEPTH, G)
    k = wavenumber(2 * math.pi / 1.8, DEPTH, G)
    assert motion.amplitude[0] == pytest.approx(0.001 / piston_transfer(k * DEPTH), rel=1e-3)
    assert abs(motion.amplitude[1:]).max() < 0.01 * motion.amplitude[0]


@slow
def test_its_second_harmonic_is_madsens_in_long_waves():
    """Second-order theory (Madsen 1971) where it holds: H L^2 / d^3 = 9, kd = 0.5."""
    period = 2 * math.pi / math.sqrt(G * 0.5 / DEPTH * math.tanh(0.5))
    own, second = nonlinear(0.03, period).piston(DEPTH, G), Regular(wave_height=0.03, period=period).piston(DEPTH, G)
    assert own.amplitude[1] == pytest.approx(second.second, rel=0.2)


@pytest.mark.parametrize("theory, terms", [("stokes", 5), pytest.param("stream_function", 10, marks=slow)])
def test_a_nonlinear_wave_has_its_height_and_no_mean(theory, terms):
    wave = nonlinear(0.1, 1.6, theory=theory, terms=terms)._wave(DEPTH, G)
    eta = wave.elevation(np.linspace(0, 2 * math.pi, 2001)[:-1])
    assert np.ptp(eta) == pytest.approx(0.1, rel=0.02) and abs(eta.mean()) < 1e-6
    assert eta.max() > 1.1 * -eta.min()  # crests are sharper than troughs


@slow
def test_the_piston_of_a_shallow_wave_moves_with_the_water():
    """dX/dt = c eta / (d + eta) where the piston stands, but for the small correction of the first harmonic."""
    waves = nonlinear(0.12, 4.0, ramp=0.0)
    motion, wave = waves.piston(DEPTH, G), waves._wave(DEPTH, G)
    for t in np.linspace(0.0, 4.0, 23):
        x, u, _ = motion(t)
        eta = float(wave.elevation(np.array([wave.omega * t - wave.k * x]))[0])
        assert u == pytest.approx(wave.omega / wave.k * eta / (DEPTH + eta), abs=0.03)
    (a, *_), (b, *_), (_, u, _) = motion(1.0 - 1e-5), motion(1.0 + 1e-5), motion(1.0)
    assert u == pytest.approx((b - a) / 2e-5, rel=1e-5)


def test_waves_that_cannot_be_are_refused():
    [(key, fault, _)] = nonlinear(0.59, 2.0, theory="stokes").faults(WATER)
    assert key == "waves.wave_height" and "no such wave" in fault
    [(key, _, _)] = nonlinear(0.1, 2.0, theory="stokes", terms=9).faults(WATER)
    assert key == "waves.terms"


def test_a_missing_file_is_told(tmp_path):
    for kind, keys in (("measured", {"distance": 1.0}), ("spectrum", {})):
        [(key, fault, _)] = load_kind(kind)(kind=kind, file=tmp_path / "none.csv", **keys).faults(WATER)
        assert key == "waves.file" and "no such file" in fault
