"""What a scene file can get wrong, and what its author is told: the file, the key, the fault, the way out."""

import pytest

from fsi.errors import SceneError
from fsi.scene import Scene, Tank
from fsi.scene_check import scene_warnings
from fsi.scene_file import load_scene

FAULTS = {
    "unknown key": (
        "[fluid]\nstill_water_levl = 0.1",
        ["pool.toml: fluid.still_water_levl: unknown key; did you mean still_water_level?"],
    ),
    "unknown key, nothing like it": (
        "[[damping]]\nstart = 4\nend = 5\nzeal = 3",
        ["pool.toml: damping[0].zeal: unknown key; known are axis, end, rate, start"],
    ),
    "not one of": (
        '[output]\ncolour = "presure"',
        ["pool.toml: output.colour: 'presure' is not one of pressure, speed; did you mean pressure?"],
    ),
    "missing and out of range, both at once": (
        "[waves]\nwave_height = -0.1",
        [
            "pool.toml: waves.wave_height: -0.1 should be greater than 0",
            "pool.toml: waves.period: missing; add it",
        ],
    ),
    "unknown kind of waves": (
        '[waves]\nkind = "regulr"',
        ["pool.toml: waves: the kind 'regulr' is not one of regular, table; did you mean regular?"],
    ),
    "not a number": (
        '[gauges.near]\nx = "left"',
        ["pool.toml: gauges.near.x: 'left' should be a number"],
    ),
    "dimension": (
        "[probes.p]\nposition = [1.0, 0.0, 0.1]",
        ["pool.toml: probes.p.position: [1.0, 0.0, 0.1] has 3 components in 2 dimensions; give x, z"],
    ),
    "block outside, and overlapping": (
        "[[fluid.blocks]]\nmin = [0, -0.5]\nmax = [1, 0]\n[[fluid.blocks]]\nmin = [0.5, -0.5]\nmax = [7, 0]",
        [
            "pool.toml: fluid.blocks[1]: [0.5, -0.5] to [7.0, 0.0] m leaves the tank [0.0, -0.5] to [6.0, 0.5] m; "
            "shrink or move it",
            "pool.toml: fluid.blocks[1]: overlaps fluid.blocks[0]; let blocks touch but not overlap",
        ],
    ),
    "level above the tank": (
        "[fluid]\nstill_water_level = 0.7",
        ["pool.toml: fluid.still_water_level: 0.7 m is not in the tank, z = -0.5 to 0.5 m; move it inside"],
    ),
    "zone and gauges outside": (
        "[gauges.far]\nx = 7\n[[damping]]\nstart = 5\nend = 5\n[[damping]]\nstart = 5\nend = 8",
        [
            "pool.toml: damping[0]: start and end are both 5 m; move one of them",
            "pool.toml: damping[1]: x = 5 to 8 m leaves the tank, x = 0 to 6 m; shorten it",
            "pool.toml: gauges.far.x: 7 m is outside the tank, x = 0 to 6 m; move it inside",
        ],
    ),
    "piston stroke": (
        "[waves]\nwave_height = 0.6\nperiod = 12",
        [
            "pool.toml: waves.wave_height: 0.6 m at a period of 12 s in 0.5 m of water takes a piston stroke of "
            "5.06 m; half of it must stay below a quarter of the tank's length 6 m; use lower or shorter waves, or a "
            "longer tank"
        ],
    ),
    "motion": (
        '[coupler]\nscheme = "prescribed"',
        [
            "pool.toml: coupler.motion: scheme 'prescribed' needs a motion; "
            "add [coupler.motion.JOINT] with amplitude, omega"
        ],
    ),
}


def fault_of(*arguments) -> list[str]:
    with pytest.raises(SceneError) as caught:
        load_scene(*arguments)
    return str(caught.value).splitlines()


@pytest.mark.parametrize("added, lines", FAULTS.values(), ids=FAULTS)
def test_fault_is_told(scene_file, added, lines):
    assert fault_of(scene_file(added)) == lines


@pytest.mark.parametrize(
    "override, line",
    [
        ("tank=5", "tank: 5 should be a table"),
        ("tank.min=3", "tank.min: 3 should be a list"),
        ("tank.min=[1]", "tank.min: [1] should have at least 2 items"),
        ("waves=5", "waves: 5 should be a table"),
        ("coupler.motion.hinge=3", "coupler.motion.hinge: 3 should be a table"),
        ("numerics.sweeps=2.5", "numerics.sweeps: 2.5 should be a whole number"),
        ("output.mcap=maybe", "output.mcap: 'maybe' should be true or false"),
        ("tank.bathymetry=3", "tank.bathymetry: 3 should be a path"),
        ("spacing=inf", "spacing: inf should be a finite number"),
        ("dimension=4", "dimension: 4 is not one of 2, 3; use one of them"),
        ("name=a b", r"name: 'a b' should match pattern '^[\w.-]+$'"),
    ],
)
def test_wrong_type_is_told_in_words_of_the_file(scene_file, override, line):
    assert f"pool.toml: {line}" in fault_of(scene_file(), [override])


def test_box_the_wrong_way_round(scene_file):
    path = scene_file(instead="spacing = 0.02\nduration = 1\n[tank]\nmin = [0, 1]\nmax = [2, 0]")
    assert fault_of(path) == ["pool.toml: tank: min [0.0, 1.0] must lie below max [2.0, 0.0] on every axis; swap them"]


def test_waves_need_their_wall(scene_file):
    path = scene_file("[waves]\nwave_height = 0.1\nperiod = 1.5")
    assert fault_of(path, ['tank.walls=["x+", "z-"]']) == [
        "pool.toml: tank.walls: waves need the x- wall, where the piston stands; add 'x-'"
    ]


def test_missing_files_are_named_with_their_keys(scene_file, tmp_path):
    path = scene_file('[bodies.a]\nmjcf = "a.xml"\n[bodies.b]\nmjcf = "package://nowhere/b.xml"')
    assert fault_of(path) == [
        "pool.toml: bodies.b.mjcf: no installed package 'nowhere'; write package://bodies/models/FILE or a plain path"
    ]
    assert fault_of(path, ["bodies.b="]) == [
        f"pool.toml: bodies.a.mjcf: no such file: {tmp_path}/a.xml; check the path; it is relative to the scene file"
    ]


def test_too_coarse_and_too_fine(scene_file):
    assert fault_of(scene_file(), ["spacing=0.2"]) == [
        "pool.toml: spacing: 0.2 m gives 2.5 particles over the fluid's depth 0.5 m; use 0.12 m or less, for at least 4"
    ]
    [line] = fault_of(scene_file(), ["spacing=1e-7"])
    assert line.startswith("pool.toml: spacing: 1e-07 m gives 3e+14 fluid particles, 1.2e+08 GB of ")


def test_syntax_and_unknown_names(scene_file):
    [line] = fault_of(scene_file("[fluid"))
    assert line.startswith("pool.toml: not TOML: ")
    assert "(at end of document)" in line
    assert fault_of("nowhere.toml") == [
        "nowhere.toml: no such file; give the path of a scene, or a name that `fsi cases` lists"
    ]
    assert fault_of("dam_brake") == ["dam_brake: neither a file nor a built-in scene; did you mean dam_break?"]


def test_scene_made_in_python_is_checked_too():
    scene = Scene(name="made", spacing=0.02, duration=1, tank=Tank(min=(0, 0), max=(1, 1)))
    assert fault_of(scene) == ["made: fluid.still_water_level: 0 m is not in the tank, z = 0 to 1 m; move it inside"]


def test_waves_that_would_break_are_warned_of(scene_file):
    scene = load_scene(scene_file("[waves]\nwave_height = 0.4\nperiod = 0.8"))
    depth, steepness = scene_warnings(scene)
    assert depth == "waves.wave_height: 0.4 m is 0.80 of the depth 0.5 m; waves break at about 0.78"
    assert steepness == (
        "waves.wave_height: 0.4 m is 0.40 of the wave length 0.996 m; waves break at 0.142 of it at most"
    )
    assert scene_warnings(load_scene(scene, ["waves.wave_height=0.1"])) == []
    assert "2.5 particles over the wave height" in scene_warnings(load_scene(scene, ["waves.wave_height=0.05"]))[0]
