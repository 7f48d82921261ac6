"""What is too large is refused by number and key before anything is made: counted, not tried."""

import itertools
import math

import numpy as np
import pytest

from fsi.compute.memory import free_memory
from fsi.errors import SceneError
from fsi.particles import filling
from fsi.particles.cells import Grid
from fsi.particles.layout import build
from fsi.scene import check_size
from fsi.scene.binding import bind
from fsi.scene.check import scene_warnings
from fsi.scene.file import load_scene
from fsi.scene.geometry import fluid_volume

BLOCK = "[[fluid.blocks]]\nmin = [0, -0.5]\nmax = [1, 0]\n"


def refusal(path, *overrides) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path, overrides)
    return str(caught.value)


@pytest.mark.parametrize(
    "text, key, number",
    [
        ("spacing = 1e-5\nduration = 1\n[tank]\nmin = [0, -1]\nmax = [1, 1]\n", "spacing", "1e+10 fluid particles"),
        ("spacing = 1e-200\nduration = 1\n[tank]\nmin = [0, -1]\nmax = [1, 1]\n", "spacing", "inf fluid particles"),
        (f"spacing = 0.01\nduration = 1\n[tank]\nmin = [0, -1]\nmax = [1e8, 1]\n{BLOCK}", "tank", "walls take 4e+10"),
        (
            f"spacing = 0.01\nduration = 1\n[tank]\nmin = [0, -1]\nmax = [1e5, 1e5]\nwalls = []\n{BLOCK}",
            "tank",
            "is 1e+07 spacings long",
        ),
        ("spacing = 0.1\nduration = 1e12\n[tank]\nmin = [0, -1]\nmax = [1, 1]\n", "duration", "1.96e+13 steps"),
        (
            "spacing = 0.1\nduration = 1\n[tank]\nmin = [0, -1]\nmax = [1, 1]\n[numerics]\nfixed_time_step = 1e-12",
            "numerics.fixed_time_step",
            "1e+12 steps",
        ),
    ],
)
def test_sizes_are_refused_by_number_and_key(tmp_path, text, key, number):
    file = tmp_path / "s.toml"
    file.write_text(text)
    answer = refusal(file)
    assert answer.startswith(f"s.toml: {key}: ") and number in answer, answer


def test_the_memory_that_is_free_counts(scene_file, monkeypatch):
    assert 1e6 < free_memory() < 1e14
    monkeypatch.setattr(check_size, "free_memory", lambda: 1e6)
    assert refusal(scene_file()).startswith(
        "pool.toml: spacing: 0.02 m gives 7.5e+03 fluid particles, 0.003 GB of 0.001 GB that are free; use more than"
    )


def test_a_bathymetry_is_taken_off_the_water_before_it_is_counted(tmp_path, monkeypatch):
    """The tank is 4 m2 to the still water level; a slope from its floor to that level leaves a half."""
    np.savetxt(tmp_path / "bed.xyz", [[x, 0.0, 0.25 * x] for x in np.linspace(-1, 5, 13)])
    tank = "min = [0, 0]\nmax = [4, 2]\nbathymetry = 'bed.xyz'\n"
    file = tmp_path / "s.toml"
    file.write_text(f"spacing = 0.02\nduration = 1\n[tank]\n{tank}[fluid]\nstill_water_level = 1\n")
    scene = load_scene(file)
    ground = bind(scene, file.name)[2]
    layout = build(scene, ground=ground)
    outside = filling.volume_outside(scene, [ground])
    assert check_size.fluid_particles(scene, outside) == pytest.approx(len(layout.position), rel=0.05)
    each = check_size.BYTES_PER_PARTICLE
    rest = check_size.wall_particles(scene) * each + 8.0 * 3 * check_size.FEW_CELLS
    monkeypatch.setattr(check_size, "free_memory", lambda: 7e3 * each + rest)  # of 5000 fluid particles, not of 10000
    build(load_scene(file), ground=ground)
    monkeypatch.setattr(check_size, "free_memory", lambda: 4e3 * each)
    with pytest.raises(SceneError, match=r"spacing: 0.02 m gives 4.84e\+03 fluid particles"):
        build(load_scene(file), ground=ground)


@pytest.mark.parametrize("name", ["tank_still", "dam_break", "owsc_2d", "floating_box"])
def test_counts_are_those_of_the_layout(name):
    scene = load_scene(name, ["bodies=", "spacing=0.05"])
    layout = build(scene)
    assert len(layout.position) == pytest.approx(check_size.fluid_particles(scene, fluid_volume(scene)), rel=0.1)
    assert len(layout.owner) == pytest.approx(check_size.wall_particles(scene), rel=0.15)
    grid = Grid.over(layout.domain_min, layout.domain_max, scene.spacing, 2 * scene.smoothing_length)
    assert grid.cells == pytest.approx(check_size.grid_cells(scene), rel=0.35)


def test_files_that_are_no_scene_are_refused_at_once(tmp_path):
    file = tmp_path / "s.toml"
    for text, fault in (
        ("a = " + "[" * 100_000, "is nested too deeply"),
        (".".join("a" * 20_000) + " = 1", "is nested too deeply"),
        ("spacing = " + "9" * 5000, "not TOML: "),
        ("duration = 1\nspacing = " + "9" * 400 + "\n[tank]\nmin = [0, 0]\nmax = [1, 1]", "should be a number"),
        ("x = " + "[" * 300 + "]" * 300, "unknown key"),
    ):
        file.write_text(text)
        assert fault in refusal(file)


def test_thousands_of_blocks_are_compared_at_once(scene_file):
    """Columns of fluid side by side; the last two overlap."""
    edges = np.linspace(0, 5, 3001)
    blocks = [f"{{min = [{a:.6f}, -0.5], max = [{b:.6f}, 0]}}" for a, b in itertools.pairwise(edges)]
    blocks.append("{min = [4.9991, -0.5], max = [5.5, 0]}")
    answer = refusal(scene_file(f"[fluid]\nblocks = [{', '.join(blocks)}]"))
    assert answer == "pool.toml: fluid.blocks[3000]: overlaps fluid.blocks[2999]; let blocks touch but not overlap"


def test_frames_without_end_are_counted_by_the_steps(scene_file):
    from fsi.estimate import check_room, estimate

    scene = load_scene(scene_file(), ["output.series=1e-300", "spacing=0.1"])
    facts = estimate(scene)
    assert facts["series_frames"] <= facts["steps"] + 1 and math.isfinite(facts["log_bytes"])
    assert scene_warnings(scene) == []
    check_room(scene, None, 100, scene_file().parent / "not" / "there")


def test_logs_that_do_not_fit_on_the_disk_are_refused(tmp_path):
    from fsi.record.log_size import check_disk

    with pytest.raises(SceneError, match=r"output: the logs take about 1e\+09 GB of .* GB that are free in"):
        check_disk(1e18, tmp_path / "runs" / "x")
