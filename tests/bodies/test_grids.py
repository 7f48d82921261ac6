"""Bathymetries from grids of heights: the same ground from every kind of file, wherever it lies, and clear refusals."""

import numpy as np
import pytest

from fsi.errors import SceneError
from fsi.scene.binding import bind
from fsi.scene.check_waves import bed_at_piston
from fsi.scene.file import load_scene
from fsi.scene.model import Scene

EAST, NORTH, CELL = 5000.0, 7000.0, 0.5
X, Y = EAST + CELL * np.arange(-6, 40), NORTH + CELL * np.arange(-16, 20)


def plane(x, y):
    """Height in the file [m], 30 m above its zero."""
    return 30.0 - 1.0 + 0.1 * (x - EAST) + 0.05 * (y - NORTH)


def write(path, z=None, nodata=-9999.0):
    z = plane(*np.meshgrid(X, Y, indexing="ij")) if z is None else z
    if path.suffix == ".xyz":
        points = np.stack([*np.meshgrid(X, Y, indexing="ij"), z], axis=-1).reshape(-1, 3)
        np.savetxt(path, points[points[:, 2] != nodata], header="x y z", comments="")
    elif path.suffix == ".asc":
        head = f"ncols {len(X)}\nnrows {len(Y)}\nxllcenter {X[0]}\nyllcenter {Y[0]}\ncellsize {CELL}\nNODATA_value {nodata}"
        np.savetxt(path, z.T[::-1], header=head, comments="")
    else:
        rasterio = pytest.importorskip("rasterio")
        where = rasterio.transform.from_origin(X[0] - CELL / 2, Y[-1] + CELL / 2, CELL, CELL)
        shape = {"height": len(Y), "width": len(X), "count": 1, "dtype": "float64"}
        with rasterio.open(
            path, "w", driver="GTiff", transform=where, nodata=nodata, crs="EPSG:32633", **shape
        ) as file:
            file.write(z.T[::-1], 1)
    return path


def scene(path, dimension=3, grid=None, **tank):
    place = {"origin": [EAST, NORTH], "level": 30.0} | (grid or {})
    low, high = ([0.0, 0.0, -1.5], [6.0, 3.0, 1.0]) if dimension == 3 else ([0.0, -1.5], [6.0, 1.0])
    box = {"min": low, "max": high, "bathymetry": str(path), "grid": place} | tank
    return load_scene(Scene.model_validate({"dimension": dimension, "spacing": 0.25, "duration": 1.0, "tank": box}))


def ground(*args, **kwargs):
    return bind(scene(*args, **kwargs), "scene")[2]


@pytest.mark.parametrize("kind", ["bed.xyz", "bed.asc", "bed.tif"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_every_kind_of_file_is_the_same_ground(kind, dimension, tmp_path):
    solid = ground(write(tmp_path / kind), dimension)
    x = np.random.default_rng(0).uniform([0.5, 0.5, -1.0], [5.5, 2.5, 1.0], (50, 3))
    y = x[:, 1] if dimension == 3 else 0.0
    steep = np.sqrt(1.01 + (0.05**2 if dimension == 3 else 0.0))
    over = (x[:, 2] - plane(EAST + x[:, 0], NORTH + y) + 30.0) / steep
    points = x if dimension == 3 else x[:, [0, 2]]
    near = np.abs(over) < 0.7
    assert solid.clearance(points)[near] == pytest.approx(over[near], abs=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_on_a_line_are_a_profile_the_same_across_it(dimension, tmp_path):
    away = np.array([0.6, 0.8])  # the line and the tank's x axis
    along = np.concatenate([np.linspace(-3.0, 9.0, 40), [2.0, 2.0]])  # a place given twice more
    places = [EAST, NORTH] + along[:, None] * away
    np.savetxt(tmp_path / "line.xyz", np.column_stack([places, 29.0 + 0.1 * along]), header="x y z", comments="")
    turn = {"direction": np.degrees(np.arctan2(*away[::-1]))}
    solid = ground(tmp_path / "line.xyz", dimension, grid=turn)
    x = np.random.default_rng(0).uniform([0.5, 0.5, -1.3], [5.5, 2.5, 0.0], (50, 3))
    over = (x[:, 2] + 1.0 - 0.1 * x[:, 0]) / np.sqrt(1.01)
    assert solid.clearance(x if dimension == 3 else x[:, [0, 2]]) == pytest.approx(over, abs=1e-6)


def test_points_at_one_place_are_refused(tmp_path):
    np.savetxt(tmp_path / "same.xyz", [[EAST, NORTH, z] for z in (1.0, 2.0, 3.0, 4.0)])
    with pytest.raises(SceneError, match=r"same.xyz.*all points lie at one place"):
        ground(tmp_path / "same.xyz")


def test_layers_under_a_grid_are_even_and_cover_it(tmp_path):
    points = ground(write(tmp_path / "bed.asc")).boundary(0.25, 4)
    under = (30.0 - points[:, 2] - 30.0 + plane(EAST + points[:, 0], NORTH + points[:, 1]) - 30.0) / np.sqrt(1.0125)
    assert np.abs(under / 0.25 - np.round(under / 0.25 - 0.5) - 0.5).max() < 0.01
    inner = points[np.all((points[:, :2] > 0) & (points[:, :2] < [6, 3]), axis=1)]
    assert len(inner) == pytest.approx(4 * 6 * 3 * np.sqrt(1.0125) / 0.25**2, rel=0.03)


def test_the_tank_lies_where_origin_and_direction_say(tmp_path):
    solid = ground(write(tmp_path / "bed.asc"), grid={"origin": [EAST + 4.0, NORTH + 1.0], "direction": 90.0})
    low = -1.0 + 0.1 * (4.0 - 1.0) + 0.05 * (1.0 + 2.0)  # 2 m along x are 2 m north, 1 m along y is 1 m west
    assert solid.clearance(np.array([[2.0, 1.0, low]])) == pytest.approx(0.0, abs=1e-9)


def test_depths_are_heights_upside_down(tmp_path):
    file = write(tmp_path / "bed.asc", -plane(*np.meshgrid(X, Y, indexing="ij")))
    solid = ground(file, grid={"depths": True})
    assert solid.clearance(np.array([[2.0, 1.0, -0.75]])) == pytest.approx(0.0, abs=1e-9)


def test_scattered_points_are_joined_by_triangles(tmp_path):
    pytest.importorskip("scipy")
    at = np.random.default_rng(1).uniform([X[0], Y[0]], [X[-1], Y[-1]], (2000, 2))
    at = np.concatenate([at, [[a, b] for a in (X[0], X[-1]) for b in (Y[0], Y[-1])]])
    np.savetxt(tmp_path / "bed.xyz", np.column_stack([at, plane(*at.T)]), delimiter=",")
    assert ground(tmp_path / "bed.xyz").clearance(np.array([[2.0, 1.0, -0.75]])) == pytest.approx(0.0, abs=1e-9)


def test_a_grid_finer_than_the_spacing_is_averaged(tmp_path):
    from bodies.rasters import read

    rough = plane(*np.meshgrid(X, Y, indexing="ij")) + 0.3 * (-1.0) ** np.arange(len(X))[:, None]
    data = read(write(tmp_path / "bed.asc", rough), None, 2 * CELL)
    assert data.at(np.array([[EAST + 3.0, NORTH + 1.0]])) == pytest.approx(plane(EAST + 3.0, NORTH + 1.0), abs=0.01)


def gap(i=10, j=18):
    z = plane(*np.meshgrid(X, Y, indexing="ij"))
    z[i, j] = -9999.0
    return z


@pytest.mark.parametrize("kind", ["bed.xyz", "bed.asc", "bed.tif"])
def test_places_without_data_are_refused_inside_the_tank_alone(kind, tmp_path):
    with pytest.raises(
        SceneError, match=r"bed.* has no data in .* of the tank's area, such as at x = .* set tank.grid.missing"
    ):
        ground(write(tmp_path / kind, gap()))
    assert ground(write(tmp_path / kind, gap()), grid={"missing": 29.0}).notes == ()
    (told,) = ground(write(tmp_path / kind), grid={"missing": 29.0}).notes
    assert told.startswith("tank.grid.missing: has no effect")
    ground(write(tmp_path / kind, gap(i=2)))


@pytest.mark.parametrize(
    ("grid", "words"),
    [
        ({"origin": [0.0, 0.0]}, r"lies beside the tank: the file covers x = 4996.75 to .*; set tank.grid.origin"),
        ({"level": 0.0}, r"fills the tank: it lies at z = .* over the tank's top at 1 m; set tank.grid.level"),
        ({"level": 60.0}, r"has no effect: it lies at z = .* under the tank's floor at -1.5 m; set tank.grid.level"),
        ({"level": -3e4}, r"fills the tank: .*if its heights are in millimetres"),
    ],
)
def test_ground_that_does_not_meet_the_tank_is_refused(grid, words, tmp_path):
    with pytest.raises(SceneError, match=words):
        ground(write(tmp_path / "bed.asc"), grid=grid)


def test_malformed_files_are_refused_by_name(tmp_path):
    for text, words in {
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 5\n": "the number of columns|5 values for 3",
        "ncols 3\nnrows 2\ncellsize 1\n1 2 3\n4 5 6\n": "lacks xllcorner",
        "nrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 5 6\n": "no ncols",
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 five 6\n": "no number",
    }.items():
        (tmp_path / "bad.asc").write_text(text)
        with pytest.raises(SceneError, match=words):
            ground(tmp_path / "bad.asc")
    (tmp_path / "bad.xyz").write_text("1 2\n3 4\n5 6\n7 8\n")
    with pytest.raises(SceneError, match="2 columns; give lines of x y z"):
        ground(tmp_path / "bad.xyz")
    (tmp_path / "bad.dxf").write_text("0\nSECTION\n")
    with pytest.raises(SceneError, match="export it as STL, OBJ or PLY, or a grid of heights as XYZ, ASC or GeoTIFF"):
        ground(tmp_path / "bad.dxf")


def test_degrees_and_a_missing_rasterio_are_told(tmp_path, monkeypatch):
    rasterio = pytest.importorskip("rasterio")
    where = rasterio.transform.from_origin(10.0, 55.0, 0.001, 0.001)
    shape = {"height": 40, "width": 40, "count": 1, "dtype": "float64"}
    with rasterio.open(tmp_path / "b.tif", "w", driver="GTiff", transform=where, crs="EPSG:4326", **shape) as file:
        file.write(np.full((40, 40), -1.0), 1)
    with pytest.raises(SceneError, match=r"b.tif: its coordinates are degrees .*gdalwarp"):
        ground(tmp_path / "b.tif")
    monkeypatch.setitem(__import__("sys").modules, "rasterio", None)
    with pytest.raises(SceneError, match=r"needs the package 'rasterio'.*pip install 'spindrift\[geo\]'"):
        ground(tmp_path / "b.tif")


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [2, 3])
def test_water_over_a_steep_grid_stays_at_rest(dimension, tmp_path):
    from cases.validation.fluid import still_beds
    from fsi.simulation.loop import Simulation

    x, y = np.meshgrid(np.arange(-0.5, 1.2, 0.02), np.arange(-0.5, 0.51, 0.02), indexing="ij")
    z = 0.05 - still_beds.DEPTH + 0.03 * np.sin(11 * x + 0.4) + 0.011 * np.sin(37 * x) + 0.02 * np.sin(9 * y)
    np.savetxt(tmp_path / "bed.xyz", np.stack([x, y, z], axis=-1).reshape(-1, 3))
    parts = still_beds.scene(still_beds.SPACING, tmp_path, dimension=dimension)
    parts["tank"]["bathymetry"] = str(tmp_path / "bed.xyz")
    it = load_scene(Scene.model_validate(parts))
    sim = Simulation(it, ground=bind(it, "bed")[2])
    rest = still_beds.Rest(sim)
    sim.run(2.0)
    assert all(error <= still_beds.TARGET[name] for name, error in rest.errors().items())


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_bed_over_the_floor_at_the_piston_is_told(dimension, tmp_path):
    """Waves are made for the depth down to the tank's floor: 1.5 m, where the bed stands 0.5 m over it."""
    path = write(tmp_path / "bed.xyz", np.where(X < EAST + 3, 29.0, 29.0 + 0.1 * (X - EAST - 3))[:, None] + 0 * Y)
    parts = scene(path, dimension).model_dump() | {"waves": {"wave_height": 0.1, "period": 2.0}}

    def told(floor):
        parts["tank"]["min"] = (*parts["tank"]["min"][:-1], floor)
        made = load_scene(Scene.model_validate(parts))
        return bed_at_piston(made, bind(made, "scene")[2])

    assert told(-1.0) == []
    [line] = told(-1.5)
    assert "the waves are made for 1.5 m of water" in line
    assert float(line.split(f"set tank.min[{dimension - 1}] = ")[1]) == pytest.approx(-1.0, abs=0.01)
