"""A series of a shallow-water code at a line drives the piston."""

import numpy as np
import pytest

from fsi.waves import load_kind
from fsi.waves.kind import Water
from fsi.waves.kinds.solitary import SolitaryPiston

G, DEPTH, HEIGHT = 9.81, 0.2, 0.06
WATER = Water(DEPTH, G, 0.01)


def solitary(tmp_path, carries="speed", elevation=0.0):
    """A solitary wave at the piston's first place; the piston that Goring (1978) gives for it, and the waves of the file."""
    piston = SolitaryPiston(HEIGHT, DEPTH, G)
    t = np.linspace(0.0, 1.5 * piston.time, 600)
    passed = 0.5 * piston.time - 0.5 * piston.stroke / piston.speed  # the crest meets the piston half way
    eta = HEIGHT / np.cosh(piston.k * piston.speed * (t - passed)) ** 2 + elevation
    third = piston.speed * eta / (1.0 if carries == "flux" else DEPTH + eta)
    file = tmp_path / "series.csv"
    np.savetxt(file, np.column_stack([t, eta, third]), delimiter=",", header=f"t,eta,{carries}", comments="")
    return piston, load_kind("shallow")(kind="shallow", file=file, carries=carries)


@pytest.mark.parametrize("carries", ["speed", "flux"])
def test_the_series_of_a_solitary_wave_gives_the_path_of_its_own_piston(tmp_path, carries):
    exact, waves = solitary(tmp_path, carries)
    piston = waves.piston(DEPTH, G)
    assert piston.celerity == pytest.approx(exact.speed, rel=1e-6)
    times = np.linspace(0.0, piston.end, 300)
    ours, theirs = np.array([piston(t) for t in times]), np.array([exact(t) for t in times])
    assert ours[:, 0] == pytest.approx(theirs[:, 0], abs=1e-3 * exact.stroke)
    assert ours[:, 1] == pytest.approx(theirs[:, 1], abs=2e-3 * theirs[:, 1].max())
    surface = waves.surface(piston, DEPTH, G)
    assert max(surface(t, 1.0) for t in np.linspace(0, 3, 3001)) == pytest.approx(HEIGHT, rel=1e-3)


def test_a_record_starts_when_it_is_told_and_rests_afterwards(tmp_path):
    _, waves = solitary(tmp_path)
    early, late = waves.piston(DEPTH, G), waves.model_copy(update={"start": 2.0}).piston(DEPTH, G)
    assert late(1.9)[:2] == (0.0, 0.0) and late(2.0 + 1.0)[0] == pytest.approx(early(1.0)[0])
    assert early(early.end + 1) == (pytest.approx(early.excursion[1]), 0.0, 0.0)


def test_a_surface_below_the_bed_and_a_record_that_breaks_off_are_told(tmp_path):
    _, waves = solitary(tmp_path, elevation=-0.3)
    assert "below the bed" in next(waves.faults(WATER))[1]
    _, whole = solitary(tmp_path)
    rows = np.loadtxt(whole.file, delimiter=",", skiprows=1)
    np.savetxt(whole.file, rows[: len(rows) // 3], delimiter=",", header="t,eta,u", comments="")
    assert not list(whole.faults(WATER)) and any("the record ends" in line for line in whole.warnings(WATER))
