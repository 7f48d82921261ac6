"""Linear wave theory and the wavemaker's motion."""

import math

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.waves import RegularPiston, TablePiston, piston_transfer, wavenumber


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
