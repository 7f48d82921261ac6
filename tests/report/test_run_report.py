"""The page of a run: the figures on it are those of a synthetic run with exact answers, and a real run has all of it."""

import re
import shutil
from html import unescape

import numpy as np
import pytest

import fsi
from cases import pages
from cases.report.froude import power
from cases.report.run import report
from cases.report.wave_figures import jolt, settled, wave_power
from fsi.errors import SceneError
from fsi.protocols import Event, Frame, Moment
from fsi.record.mcap import McapRecorder
from fsi.record.run_folder import RunFolder
from fsi.record.timeline_reader import read_snapshots
from fsi.scene.file import load_scene

AMPLITUDE, PHASE, DAMPING, END, DT = 0.2, 0.5, 20.0, 40.0, 0.02


class Hinged:
    """A body set of one flap, as far as a log needs it."""

    names, dry_names, joint_names, joint_is_rotary, sensor_names = ("flap",), (), ("hinge",), (True,), ("reaction.x",)


def cells(page: str) -> dict[tuple[str, str], str]:
    """(figure, of what) -> value with its unit, from the table of key figures."""
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", page)]
    return {(unescape(r[0]), r[1]): f"{r[2]} {unescape(r[3])}" for r in rows if len(r) in (4, 5)}


@pytest.fixture
def converter(tmp_path):
    """The folder of a made-up run of the flap: pitch and loads are sines of the period of the waves after 8 s."""
    scene = load_scene("flap", [f"duration={END}", "output.timeline=false"])
    omega = 2 * np.pi / scene.waves.period
    folder = RunFolder.choose(scene, tmp_path / "run")
    folder.create(scene)
    recorder = McapRecorder(folder.path / "run.mcap")
    recorder.begin(scene, Hinged)
    for n in range(int(END / DT) + 1):
        t, ramp = n * DT, min(n * DT / 8, 1.0)
        pitch, rate = (
            ramp * AMPLITUDE * np.cos(omega * t + PHASE),
            -ramp * AMPLITUDE * omega * np.sin(omega * t + PHASE),
        )
        series = {
            "body_position": np.array([[4.0, 0.0, -0.2]]),
            "body_quaternion": np.array([[1.0, 0, 0, 0]]),
            "dry_position": np.zeros((0, 3)),
            "dry_quaternion": np.zeros((0, 4)),
            "body_force": np.array([[100.0 * pitch, 0.0, 300.0]]),
            "body_torque": np.array([[0.0, 10.0 * pitch, 0.0]]),
            "sensor_reading": np.array([-5.0 * pitch]),
            "joint_position": np.array([pitch]),
            "joint_velocity": np.array([rate]),
            "joint_force": np.array([-DAMPING * rate]),
            "pto_power": np.array([DAMPING * rate**2]),
            "elevation": np.array([0.05, -0.05, 0.0]) * np.cos(omega * t),
            **dict.fromkeys(("kinetic_energy", "dissipated_energy", "body_work", "wavemaker_work"), 1.0),
            **{"time_step": DT, "max_speed": 1.0, "volume": 7.0, "lost_particles": 0.0},
        }
        recorder.series(Frame(t, n, t, series=series))
    recorder.event(Event(Moment(12.5, 625, 12.5), "info", "joint 'hinge' at its upper limit, 1 rad"))
    recorder.end()
    folder.write(status="done", phases={"pressure": 3.0, "record": 1.0}, warnings=["a <warning>"])
    return folder.path, omega


def test_figures_of_a_converter_are_exact(converter):
    folder, omega = converter
    page = report(folder, scale=25.0).read_text()
    found = cells(page)
    power = 0.5 * DAMPING * (AMPLITUDE * omega) ** 2
    flux = wave_power(0.1, 1.8, 0.7, 1000.0, 9.81)
    number = {key: float(value.split()[0]) for key, value in found.items()}
    assert number["motion over wave amplitude", "hinge"] == pytest.approx(AMPLITUDE / 0.05, rel=1e-3)
    assert number["mean absorbed power of all joints", ""] == pytest.approx(power, rel=2e-3)
    assert number["power of the incident waves per metre of crest", ""] == pytest.approx(flux, rel=1e-3)
    assert number["capture width over device width", ""] == pytest.approx(power / flux, rel=3e-3)
    assert number["largest fluid force", "flap"] == pytest.approx(np.hypot(300, 20), rel=1e-3)
    assert number["largest reading", "reaction.x"] == pytest.approx(5 * AMPLITUDE, rel=1e-3)
    assert "±" in found["mean absorbed power of all joints", ""]
    assert found["motion over wave amplitude", "hinge"].endswith("rad/m")
    assert "in which the waves have come to the body" in page and "12.5000" in page and "upper limit" in page
    assert "a &lt;warning&gt;" in page
    assert {"body_force", "elevation", "energy"} <= {file.stem for file in (folder / "report").iterdir()}
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", page)]
    scaled = {(unescape(r[0]), r[1]): (r[2], r[4]) for r in rows if len(r) == 5}
    assert float(scaled["static fluid force", "flap"][0]) == pytest.approx(300, rel=2e-3)
    assert float(scaled["largest dynamic fluid force", "flap"][0]) == pytest.approx(100 * AMPLITUDE, rel=1e-2)
    assert scaled["times that the joint came to an end stop", "hinge"][0] == "1"
    assert scaled["position of the end stop that was reached", "hinge"] == ("1", "1 rad")
    model, full = scaled["mean absorbed power of all joints", ""]
    assert float(full.split()[0]) == pytest.approx(float(model.split()[0]) * 25**3.5, rel=1e-3)
    assert "The largest dynamic force of the fluid, 20 N, acts on the body flap" in page
    assert (folder / "report/largest_load.png").is_file()
    with pytest.raises(SceneError, match="--scale: is -1; give full size over model"):
        report(folder, scale=-1.0)


def test_runs_are_compared_on_one_page(converter, tmp_path, monkeypatch):
    folder, _ = converter
    other = shutil.copytree(folder, tmp_path / "other")
    text = (other / "scene.toml").read_text()
    (other / "scene.toml").write_text(text.replace("wave_height = 0.1", "wave_height = 0.2"))
    monkeypatch.chdir(tmp_path)
    page = pages.report(folder, other).read_text()
    assert "waves.wave_height" in page and "<td>0.1</td><td>0.2</td>" in page
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", page)]
    [motion] = [row for row in rows if row[:1] == ["motion over wave amplitude"]]
    assert [float(value) for value in motion[3:]] == pytest.approx([4.0, 2.0, 0.5], rel=2e-3)
    (tmp_path / "mine.html").write_text("mine")
    for folders, options, fault in (
        ((folder, other), {"out": "mine.html"}, "something else than a page of Spindrift"),
        ((folder, tmp_path), {}, "holds no run"),
        ((folder, folder), {}, "stands twice"),
        ((folder,), {"out": "a.html"}, "is the page of a comparison"),
        ((folder,), {"scatter": "a.csv"}, "of no use to a run"),
        ((folder, other), {"scale": 2.0}, "of no use to a comparison"),
    ):
        with pytest.raises(SceneError, match=fault):
            pages.report(*folders, **options)


@pytest.mark.parametrize(
    "units, exponent",
    [
        ("N m s/rad", 4.5),
        ("W/m", 2.5),
        ("m3/s", 2.5),
        ("l/s/m", 1.5),
        ("kg m2", 5),
        ("rad/s", -0.5),
        ("1/m", -1),
        ("1", 0),
    ],
)
def test_powers_of_the_scale(units, exponent):
    assert power(units) == exponent


def test_unknown_units_have_no_power():
    assert power("V") is None and power("m or rad") is None and power("") is None


def test_waves_that_pass_are_measured_from_their_arrival(tmp_path):
    """A piston that rests for 3 s: what comes before its wave can be at the body counts for nothing."""
    times = np.arange(0, 10, 0.1)
    rows = "\n".join(f"{t:.2f},{0.0 if t < 3 else 0.2 * (1 - np.cos(np.pi * min(t - 3, 1)))}" for t in times)
    (tmp_path / "stroke.csv").write_text(f"time,position\n{rows}\n")
    waves = {"kind": "table", "file": str(tmp_path / "stroke.csv")}
    base = load_scene("flap", ["duration=10.0"])
    scene = base.model_validate(base.model_dump() | {"waves": waves})
    place = 4.0
    begin = settled(scene, scene.tank.min[0] + place)
    assert 3.0 < begin < 3.2 + place / np.sqrt(9.81 * 0.7)
    assert settled(scene, scene.tank.min[0]) > jolt(scene) > 0.4


def test_report_of_a_real_run_has_its_particles(tmp_path):
    pytest.importorskip("rerun")
    run = fsi.run("dam_break", overrides=["spacing=0.05"], until=0.4, out=tmp_path / "run", quiet=True, threads=1)
    page = report(run.folder).read_text()
    for title in ("Summary", "Key figures", "Time series", "Particles", "Energy and momentum", "Run time", "Scene"):
        assert f">{title}</h2>" in page
    assert (run.folder / "report/particles.png").stat().st_size > 20_000
    shots = read_snapshots(run.folder / "run.rrd", [0.0, 0.19, 0.4])
    assert [round(shot.time, 1) for shot in shots] == [0.0, 0.2, 0.4]
    assert len(shots[0].position) == 200
    np.testing.assert_allclose(shots[0].position.min(0), [0.025, 0, 0.025], atol=0.004)
    assert shots[-1].position[:, 0].max() > 0.6 > shots[0].position[:, 0].max()
    recording = run.folder / "run.rrd"
    recording.write_bytes(recording.read_bytes()[: recording.stat().st_size * 9 // 10])  # as a killed run leaves it
    assert len(read_snapshots(recording, [0.0, 0.4])[0].position) == 200
    recording.write_bytes(b"nothing")
    with pytest.raises(SceneError, match=r"run.rrd: cannot be read"):
        read_snapshots(recording, [0.0])


def test_folder_without_a_run(tmp_path):
    with pytest.raises(SceneError, match="holds no run"):
        report(tmp_path)
