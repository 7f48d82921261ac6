"""Files for ParaView, the reconstructed surface and pictures of a run."""

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import fsi
from cases.pictures.export import export
from cases.pictures.frames import RunFrames
from cases.pictures.look import Look
from cases.pictures.render import render
from cases.pictures.surface import surface
from cases.pictures.vtkhdf import PolyDataFile
from fsi.errors import SceneError

sys.path.insert(0, str(Path(__file__).parents[1] / "fluid"))
from tanks import still_tank

DR, DEPTH = 0.04, 0.48
slow = pytest.mark.slow  # seconds each to import


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "still"
    instruments = {
        "loads": {"wall": {"on": "x+"}},
        "fluxes": {"gate": {"min": (0.48, -DEPTH), "max": (0.48, 0.2)}},
        "velocimeters": {"adv": {"position": (0.4, -0.2), "end": (0.4, -0.1), "points": 2}},
    }
    output = {"values": True, "particles": 0.1, "series": 0.05, "fields": ("pressure", "speed"), "checkpoint": 0}
    scene = still_tank(spacing=DR, depth=DEPTH, length=0.96, output=output, **instruments)
    fsi.run(scene, out=folder, until=0.3, threads=1, quiet=True)
    return folder


def test_instruments_are_in_the_dataset_and_the_report(run):
    data = fsi.load_run(run)
    assert data.load_force.dims == ("time", "structure", "axis") and data.load_force.attrs["units"] == "N"
    assert float(data.load_force.sel(structure="wall", axis="x")[-2]) == pytest.approx(0.5 * 9810 * DEPTH**2, rel=0.02)
    assert data.velocimeter.values.tolist() == ["adv[0]", "adv[1]"]
    assert float(abs(data.passed_volume[-1, 0])) <= DR**2
    page = fsi.report(run).read_text()
    for words in ("Loads on fixed structures", "largest force on the structure", "mean discharge"):
        assert words in page


def test_frames_keep_values_as_floats(run):
    frames = list(RunFrames(run))
    assert len(frames) == 4 and set(frames[0].values) == {"velocity", "pressure", "speed"}
    last = frames[-1]
    still = -9810 * last.position[:, 2]
    assert np.abs(last.values["pressure"] - still).max() < 0.1 * 9810 * DEPTH
    assert len(np.unique(last.values["pressure"])) > 256
    np.testing.assert_allclose(last.values["speed"], np.linalg.norm(last.values["velocity"], axis=1), rtol=1e-5)


def test_export_for_paraview_holds_every_frame(run):
    h5py = pytest.importorskip("h5py")
    files = export(run, "vtk")
    assert [file.name for file in files] == ["particles.vtkhdf", "walls.vtkhdf"]
    frames = list(RunFrames(run))
    with h5py.File(files[0]) as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"PolyData" and root["Steps"].attrs["NSteps"] == 4
        np.testing.assert_allclose(root["Steps/Values"][:], [frame.time for frame in frames])
        first, count = root["Steps/PointOffsets"][2], root["NumberOfPoints"][2]
        np.testing.assert_array_equal(root["Points"][first : first + count], frames[2].position)
        np.testing.assert_array_equal(root["PointData/velocity"][first : first + count], frames[2].values["velocity"])


@slow
def test_pyvista_reads_what_was_exported(run):
    pv = pytest.importorskip("pyvista")
    reader = pv.get_reader(str(export(run, "vtk")[0])).reader
    frames = list(RunFrames(run))
    assert reader.GetNumberOfSteps() == len(frames)
    for step, frame in enumerate(frames):
        reader.SetStep(step)
        reader.Update()
        cloud = pv.wrap(reader.GetOutputDataObject(0))
        np.testing.assert_array_equal(cloud.points, frame.position)
        for name, values in frame.values.items():
            np.testing.assert_array_equal(cloud.point_data[name], values)
    walls = pv.wrap(pv.get_reader(str(run / "vtk" / "walls.vtkhdf")).read())
    assert walls.bounds[0] == 0.0 and walls.n_cells == 3


@slow
def test_pyvista_reads_meshes_that_change(tmp_path):
    pv = pytest.importorskip("pyvista")
    meshes = [(np.eye(3) * size, np.array([[0, 1, 2]] * size)) for size in (1, 2, 3)]
    with PolyDataFile(tmp_path / "mesh.vtkhdf") as file:
        for time, (points, cells) in enumerate(meshes):
            file.add(time, points, cells, {"size": np.full(3, time)})
    reader = pv.get_reader(str(tmp_path / "mesh.vtkhdf")).reader
    for step, (points, cells) in enumerate(meshes):
        reader.SetStep(step)
        reader.Update()
        mesh = pv.wrap(reader.GetOutputDataObject(0))
        np.testing.assert_array_equal(mesh.points, points)
        assert mesh.n_cells == len(cells) and (mesh.point_data["size"] == step).all()


def block(dim, count=14):
    axis = (np.arange(count) + 0.5) * DR
    axes = [axis, axis if dim == 3 else np.zeros(1), axis]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def test_surface_in_two_dimensions_encloses_the_fluid():
    mesh = surface(block(2), DR, 2)
    (x0, _, z0), (x1, _, z1) = (mesh.vertices[mesh.cells[:, end]].T for end in (0, 1))
    area = abs(0.5 * (x0 * z1 - x1 * z0).sum())
    assert area == pytest.approx((14 * DR) ** 2, rel=0.02)
    assert len(surface(np.empty((0, 3)), DR, 2).cells) == 0


@slow
def test_surface_in_three_dimensions_encloses_the_fluid():
    pytest.importorskip("pysplashsurf")
    mesh = surface(block(3), DR, 3)
    a, b, c = (mesh.vertices[mesh.cells[:, n]] for n in range(3))
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx((14 * DR) ** 3, rel=0.02)


def test_surface_as_a_layer_of_the_timeline(run):
    rr = pytest.importorskip("rerun")
    files = export(run, "surface")
    assert [file.name for file in files] == ["surface.vtkhdf", "surface.rrd"]
    layer, whole = (rr.chunk.RrdReader(run / name).recordings()[0] for name in ("surface.rrd", "run.rrd"))
    assert layer.recording_id == whole.recording_id
    paths = {str(chunk.entity_path) for chunk in rr.chunk.RrdReader(run / "surface.rrd").stream()}
    assert "/world/surface" in paths


def test_pictures_of_a_two_dimensional_run(run):
    iio = pytest.importorskip("imageio.v3")
    folder = render(run, "png", look=Look(field="speed", size=(640, 400)), every=3)
    files = sorted(folder.glob("*.png"))
    assert [file.name for file in files] == ["frame_0000.png", "frame_0001.png"]
    picture = iio.imread(files[0])
    assert picture.shape == (400, 640, 3) and len(np.unique(picture.reshape(-1, 3), axis=0)) > 20


@slow
def test_videos(run):
    iio = pytest.importorskip("imageio.v3")
    pytest.importorskip("imageio_ffmpeg")
    for to, frames in (("gif", 4), ("mp4", 4)):
        file = render(run, to, look=Look(size=(320, 200)))
        assert file.name == f"run.{to}" and len(iio.imread(file)) == frames
    surface_file = render(run, "gif", look=Look(surface=True, size=(320, 200)))
    assert len(iio.imread(surface_file)) == 4


def test_a_thinned_timeline_has_no_surface(run, tmp_path):
    """Half of the particles would give specks of water in place of the fluid's surface."""
    pytest.importorskip("imageio")
    thin = shutil.copytree(run, tmp_path / "thin", ignore=shutil.ignore_patterns("vtk"))
    scene = thin / "scene.toml"
    scene.write_text(re.sub(r"(# )?fraction .*", "fraction = 0.5", scene.read_text()))
    for act in (lambda: export(thin, "surface"), lambda: render(thin, "png", look=Look(surface=True))):
        with pytest.raises(SceneError, match="holds 50 % of the particles, too few for the surface"):
            act()
    assert not (thin / "vtk" / "surface.vtkhdf").exists()


def test_pictures_are_as_high_as_the_tank_needs(run):
    iio = pytest.importorskip("imageio.v3")
    wide, low = (0.0, 1.0, 0.0, 0.1), (0.0, 0.4, 0.0, 0.3)
    for window, least, most in ((wide, 180, 260), (low, 700, 1000)):
        folder = render(run, "png", look=Look(window=window), every=10)
        height, width, _ = iio.imread(folder / "frame_0000.png").shape
        assert width == 1280 and least < height < most


def test_what_cannot_be_drawn_is_refused(run, tmp_path):
    pytest.importorskip("imageio")
    for look, why in ((Look(field="eddy"), "no values of 'eddy'"), (Look(camera=(0,) * 6), "seen from the side")):
        with pytest.raises(SceneError, match=why):
            render(run, "png", look=look)
    with pytest.raises(SceneError, match="no frame lies between"):
        render(run, "png", start=5.0)
    with pytest.raises(SceneError, match="holds no run"):
        export(tmp_path, "vtk")
