"""A series of a shallow-water code at a line drives the piston."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cases.validation.waves.solitary_wave import crest, write_series
from fsi.fluid.gauges import elevation
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation
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


def faults(folder, text, *, carries="flux", duration=0.0):
    """Key, fault and fix of the waves of a file."""
    file = folder / "line.csv"
    file.write_text(text)
    waves = load_kind("shallow")(kind="shallow", file=file, carries=carries)
    return next(waves.faults(replace(WATER, duration=duration)), None)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("time,elevation\n0,0\n1,0.1\n2,0\n", "row 2: has 2 columns"),
        ("time,elevation,q\n0,0,0\n2,0.05,0.1\n1,0,0\n", "row 4, column time"),
        ("time,elevation,q\n0,0,0\n1,wet,0.1\n2,0,0\n", "row 3, column elevation"),
        (
            "time,elevation,q\n0,0,0\n1,-0.3,0.1\n2,0,0\n",
            "column elevation: -0.3 m at 1 s is below the bed, 0.2 m deep",
        ),
        ("time,elevation,q\n0,0,0\n1,0.1,0\n2,0,0\n", "never moves"),
    ],
)
def test_a_bad_file_is_told_by_its_name_and_column(tmp_path, text, told):
    key, fault, fix = faults(tmp_path, text)
    assert key == "waves.file" and fault.startswith("line.csv: ") and told in fault and fix


def test_a_record_too_short_for_the_run_is_told(tmp_path):
    text = "time,elevation,q\n0,0,0\n1,0.02,0.03\n2,0.02,0.03\n"
    assert faults(tmp_path, text, duration=2.0) is None
    key, fault, fix = faults(tmp_path, text, duration=9.0)
    assert key == "waves.file" and "ends at 2 s" in fault and "duration" in fix


@pytest.mark.parametrize(
    ("head", "carries"), [("q", "speed"), ("flux [m2/s]", "speed"), ("u", "flux"), ("speed [m/s]", "flux")]
)
def test_a_column_called_by_another_name_than_it_is_read_is_told(tmp_path, head, carries):
    key, fault, _ = faults(tmp_path, f"time,elevation,{head}\n0,0,0\n1,0.02,0.03\n2,0,0\n", carries=carries)
    assert key == "waves.carries" and head in fault


def test_a_flux_read_as_a_speed_is_warned_of(tmp_path):
    _, waves = solitary(tmp_path, "flux")
    assert not any("check that" in line for line in waves.warnings(WATER))
    text = waves.file.read_text().replace("flux", "third")
    waves.file.write_text(text)
    assert any("check that 'speed'" in line for line in waves.model_copy(update={"carries": "speed"}).warnings(WATER))


def test_a_series_of_elevation_and_flux_makes_its_wave_in_a_flume(tmp_path):
    """A solitary wave of ten spacings to the depth passes two gauges at its height and at sqrt(g (d + H))."""
    depth, height, dr, passed = 0.125, 0.0375, 0.0125, 1.0
    write_series(tmp_path / "line.csv", height, depth, passed, 2 * passed)
    data = {
        "spacing": dr,
        "duration": 2.9,
        "tank": {"min": [0, -depth], "max": [3.0, depth]},
        "waves": {"kind": "shallow", "file": str(tmp_path / "line.csv"), "carries": "flux"},
        "numerics": {"artificial_viscosity": 0.0},
    }
    sim = Simulation(Scene.model_validate(data), threads=1)
    time, surface, gauges = [], [], np.array([0.8, 2.0])

    def watch(sim):
        time.append(sim.time)
        surface.append([elevation(sim.fluid.position, np.array([x]), dr, 2 * dr) for x in gauges])

    sim.run(on_step=watch)
    sim.close()
    tops = [crest(np.array(time), column) for column in np.array(surface).T]
    speed = math.sqrt(G * (depth + height))
    assert [top for _, top in tops] == pytest.approx([height, height], rel=0.08)
    assert 1.2 / (tops[1][0] - tops[0][0]) == pytest.approx(speed, rel=0.03)
    assert tops[0][0] == pytest.approx(passed + 0.8 / speed, abs=0.03)
