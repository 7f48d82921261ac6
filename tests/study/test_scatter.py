"""Scatter tables, and what a power matrix makes of them in a year."""

import numpy as np
import pytest
import xarray

from cases.study.scatter import HOURS, annual, read_scatter
from fsi.errors import SceneError

LINES = "Hs [m],Te [s],hours\n1.0,6.0,1\n2.0,7.0,2\n3.0,20.0,1\n"
MATRIX = "Hs/Tp;6;7\n1.0;1;\n2.0;0;3\n"


def matrix(period="Te"):
    """Power 100 Hm0 + 10 T, which bilinear interpolation keeps; the heights in descending order."""
    height, time = np.array([3.0, 1.0]), np.array([5.0, 10.0])
    values = 100 * height[:, None] + 10 * time
    power = xarray.DataArray(values, dims=("Hm0", period), coords={"Hm0": height, period: time})
    return power, xarray.full_like(power, 8.0)


def test_energy_of_a_year_is_that_of_its_seas(tmp_path):
    (tmp_path / "a.csv").write_text(LINES)
    power, error = matrix()
    found = annual(power, error, read_scatter(tmp_path / "a.csv"), None)
    assert found.power == pytest.approx(0.25 * 160 + 0.5 * 270)
    assert found.energy == pytest.approx(HOURS * found.power)
    flux = np.array([1.0 * 6, 2 * 4.0 * 7, 9.0 * 20])
    assert found.covered == pytest.approx(0.75) and found.covered_energy == pytest.approx(flux[:2].sum() / flux.sum())
    assert 0 < found.error < 1.96 * 8 * HOURS * 0.75  # errors of the seas are independent
    assert np.isnan(annual(power, None, read_scatter(tmp_path / "a.csv"), None).error)


def test_a_table_as_a_matrix_of_peak_periods(tmp_path):
    (tmp_path / "b.csv").write_text(MATRIX)
    seas = read_scatter(tmp_path / "b.csv")
    assert seas.kind == "tp" and seas.share.tolist() == [0.25, 0, 0, 0.75]
    power, _ = matrix()
    assert annual(power, None, seas, 0.9).power == pytest.approx(0.25 * (100 + 54) + 0.75 * (200 + 63))
    assert annual(matrix("peak_period")[0], None, seas, None).power == pytest.approx(0.25 * 160 + 0.75 * 270)
    with pytest.raises(SceneError, match="give the table energy periods"):
        annual(power, None, seas, None)


@pytest.mark.parametrize(
    "text, fault",
    [
        ("", "is no scatter table"),
        ("Hs,Tp,hours\n", "is no scatter table"),
        ("a,b,c\n1,2,3\n", "is no scatter table"),
        ("Hs,Tp,hours,more\n1,2,3,4\n", "of three columns"),
        ("Hs,Tp,hours\n1,x,3\n", "line 2 has 'x' in column 2"),
        ("Hs,Tp,hours\n1,2,-3\n", "an occurrence is -3"),
        ("Hs,Tp,hours\n1,2,nan\n", "line 2 has 'nan'"),
        ("Hs,Tp,hours\n1,2,0\n", "no sea occurs"),
    ],
)
def test_a_table_that_is_none_says_why(tmp_path, text, fault):
    (tmp_path / "s.csv").write_text(text)
    with pytest.raises(SceneError, match=fault):
        read_scatter(tmp_path / "s.csv")


def test_a_matrix_with_a_gap_has_no_energy(tmp_path):
    (tmp_path / "a.csv").write_text(LINES)
    power, _ = matrix()
    power[0, 0] = np.nan
    with pytest.raises(SceneError, match="a run of the power matrix is missing"):
        annual(power, None, read_scatter(tmp_path / "a.csv"), None)
    with pytest.raises(SceneError, match="a matrix over significant height and period"):
        annual(power.rename(Hm0="wave_height"), None, read_scatter(tmp_path / "a.csv"), None)
