"""Tables of a user, as spreadsheets write them: taken, or refused with row and column; and solved in linear time."""

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.scene.file import load_scene
from fsi.tables import read_table
from fsi.waves.kinds.table import natural_spline

GOOD = ["0,0", "0.5,0.01", "1,0.0", "1.5,-0.01", "2,0"]


def refusal(file, lines, least=3) -> str:
    file.write_text("\n".join(lines) + "\n")
    with pytest.raises(SceneError) as caught:
        read_table(file, ("time", "position"), least)
    assert str(caught.value).startswith(f"{file}: ")
    return caught.value.fault


def test_units_of_the_si_in_a_header_are_taken(tmp_path):
    for head in ("t [s],x [m]", "Time (s),Position (m, left)"):
        (tmp_path / "t.csv").write_text("\n".join([head, *GOOD]))
        assert len(read_table(tmp_path / "t.csv", ("time", "position"), 3)) == len(GOOD)


@pytest.mark.parametrize("text", ["\n", "\r\n", "\n\n"])
def test_tables_of_spreadsheets_are_taken(tmp_path, text):
    file = tmp_path / "t.csv"
    file.write_bytes(("\ufefftime,x" + text + text.join(GOOD) + "\n\n").encode())
    assert read_table(file, ("time", "position"), 3).tolist() == [[float(x) for x in row.split(",")] for row in GOOD]


@pytest.mark.parametrize(
    "lines, fault",
    [
        (["t,x", "0,0", "0.5,nan", "1,0"], "row 3, column position: nan is not a finite number"),
        (["t,x", "0,0", "inf,1", "1,0"], "row 3, column time: inf is not a finite number"),
        (["t,x", "0,0", "2,1", "1,0"], "row 4, column time: 1 does not lie above 2 of the row before"),
        (["t,x", "0,0", "", "1,1", "1,0"], "row 5, column time: 1 does not lie above 1 of the row before"),
        (GOOD, "row 1: has numbers, '0,0', where a header line belongs"),
        (["t,x", "[s],[m]", *GOOD], "row 2, column time: '[s]' is not a number"),
        (["t;x", "0;0", "0,5;0,01"], "row 2: '0;0' has its columns between semicolons; use commas, and points in"),
        (["t\tx", "0\t0"], "row 2: '0\\t0' has its columns between tabs"),
        (["t,x,v", "0,0,0", "1,0,0"], "row 2: has 3 columns, '0,0,0', where 2 belong"),
        (["t,x", "0,0", "0.5", "1,0"], "row 3: has 1 column, '0.5', where 2 belong"),
        (["t,x", "0,0", "1,1"], "has 2 rows of numbers under its header, and needs 3 or more"),
        (["t,x"], "has 0 rows of numbers"),
        (
            ["time [ms],x [m]", "0,0", "500,0.01", "1000,0"],
            "row 1, column time: is in ms, and is read in units of the SI",
        ),
        (["t (s),angle (deg)", *GOOD], "row 1, column position: is in deg"),
        (["t [s],v [mm/s]", *GOOD], "row 1, column position: is in mm"),
        ([""], "is empty"),
    ],
)
def test_faults_name_row_and_column(tmp_path, lines, fault):
    assert fault in refusal(tmp_path / "t.csv", lines)


def test_text_in_another_encoding_is_named(tmp_path):
    file = tmp_path / "t.csv"
    file.write_bytes("time,x\n0,0\n".encode("utf-16"))
    with pytest.raises(SceneError, match=r"is not UTF-8 text; save it as CSV in UTF-8"):
        read_table(file, ("time", "position"), 3)


def test_a_piston_begins_at_its_wall(scene_of_table):
    with pytest.raises(SceneError, match=r"waves.file: column position: the first row is 0, 0.1, so the piston begins"):
        scene_of_table("time,x\n0,0.1\n1,0.2\n2,0.1\n")
    scene_of_table("time,x\n0,0\n1,0.1\n2,0\n")


@pytest.fixture
def scene_of_table(tmp_path):
    def load(text: str):
        (tmp_path / "t.csv").write_text(text)
        (tmp_path / "s.toml").write_text(
            'spacing = 0.05\nduration = 3\n[tank]\nmin = [0, -0.5]\nmax = [4, 0.5]\n[waves]\nkind = "table"\nfile = "t.csv"\n'
        )
        return load_scene(tmp_path / "s.toml")

    return load


def test_the_spline_solves_its_equations_whatever_its_length():
    """Second derivatives meet h0 m0 + 2 (h0 + h1) m1 + h1 m2 = 6 (slope1 - slope0) at every inner knot."""
    random = np.random.default_rng(1)
    t, x = np.cumsum(random.uniform(0.01, 1.0, 50_000)), random.normal(size=50_000)
    m, h = natural_spline(t, x), np.diff(t)
    left = h[:-1] * m[:-2] + 2 * (h[:-1] + h[1:]) * m[1:-1] + h[1:] * m[2:]
    right = 6 * np.diff(np.diff(x) / h)
    assert m[0] == m[-1] == 0.0
    assert np.abs(left - right).max() < 1e-12 * np.abs(right).max()
