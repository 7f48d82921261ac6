"""What a scene file can get wrong, and what its author is told: the file, the key, the fault, the way out."""

import pytest

from fsi.errors import SceneError
from fsi.scene.check import scene_warnings
from fsi.scene.check_waves import wave_summary
from fsi.scene.file import load_scene
from fsi.scene.model import Scene, Tank
from fsi.scene.toml import dumps

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
        '[output]\nfields = ["presure"]',
        [
            "pool.toml: output.fields[0]: 'presure' is not one of pressure, speed, viscosity, eddy_viscosity, liquid; "
            "did you mean pressure?"
        ],
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
        [
            "pool.toml: waves: the kind 'regulr' is not one of focused, irregular, measured, nonlinear, packet, regular, "
            "shallow, solitary, spectrum, table; did you mean regular?"
        ],
    ),
    "not a number": (
        '[gauges.near]\nx = "left"',
        ["pool.toml: gauges.near.x: 'left' should be a number"],
    ),
    "dimension": (
        "[probes.p]\nposition = [1.0, 0.0, 0.1]",
        ["pool.toml: probes.p.position: [1.0, 0.0, 0.1] has 3 components in 2 dimensions; give x, z"],
    ),
    "linear field between walls": (
        "[fluid]\nacceleration_gradient = [[-1.0, 0.0], [0.0, -1.0]]",
        [
            "pool.toml: fluid.acceleration_gradient: acts on a free body of fluid alone, which touches no solid; "
            "set tank.walls = [] and leave solids out"
        ],
    ),
    "linear field of the wrong shape": (
        "[fluid]\nacceleration_gradient = [[-1.0, 0.0, 0.0], [0.0, -1.0]]",
        ["pool.toml: fluid.acceleration_gradient[0]: [-1.0, 0.0, 0.0] has 3 components in 2 dimensions; give x, z"],
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
            "pool.toml: waves: the piston moves from -2.53 to 2.53 m; a quarter of the tank's length is 1.5 m; "
            "use lower or shorter waves, or a longer tank"
        ],
    ),
    "solitary wave too high, and its stroke too long": (
        '[waves]\nkind = "solitary"\nwave_height = 0.4',
        [
            "pool.toml: waves.wave_height: 0.4 m is more than 0.78 of the depth 0.5 m, where a solitary wave breaks; "
            "use a lower wave or deeper water"
        ],
    ),
    "second order beyond its range": (
        "[waves]\nwave_height = 0.1\nperiod = 4\norder = 2",
        [
            "pool.toml: waves.order: H L^2 / d^3 is 60, and the second order ends at 26; "
            "set order = 1, or use lower or shorter waves, or deeper water"
        ],
    ),
    "a spectrum without a peak factor": (
        '[waves]\nkind = "irregular"\nHm0 = 0.1\npeak_period = 1.5\nspectrum = "pierson_moskowitz"\ngamma = 2',
        [
            "pool.toml: waves: gamma is of no use to 'pierson_moskowitz'; leave it out or set spectrum = 'jonswap'",
        ],
    ),
    "a packet of nothing": (
        '[waves]\nkind = "packet"\ngroups = []',
        ["pool.toml: waves: a packet without groups; add [[waves.groups]] with wave_height, period and waves"],
    ),
    "a part of a wave": (
        '[waves]\nkind = "packet"\ngroups = [{wave_height = 0.1, period = 1.0, waves = 2.2}]',
        ["pool.toml: waves.groups[0].waves: 2.2 should be a multiple of 0.5"],
    ),
    "a motion that is none": (
        '[coupler]\nscheme = "prescribed"\nmotion.hinge = 3',
        ["pool.toml: coupler.motion.hinge: 3 should be a table"],
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
        ("coupler.motion.hinge.omega=3", "coupler.motion: unknown key; it belongs to scheme = 'prescribed'"),
        (
            "coupler.scheme=lag",
            "coupler: the scheme 'lag' is not one of added_mass, fixed_point, lagged, prescribed; did",
        ),
        ("numerics.sweeps=2.5", "numerics.sweeps: 2.5 should be a whole number"),
        ("output.mcap=maybe", "output.mcap: 'maybe' should be true or false"),
        ("tank.bathymetry=3", "tank.bathymetry: 3 should be a path"),
        ("spacing=inf", "spacing: inf should be a finite number"),
        ("dimension=4", "dimension: 4 is not one of 2, 3; use one of them"),
        ("name=a b", "name: 'a b' is no name of a folder; use letters, digits, _, - and dots, and not dots alone"),
    ],
)
def test_wrong_type_is_told_in_words_of_the_file(scene_file, override, line):
    assert any(fault.startswith(f"pool.toml: {line}") for fault in fault_of(scene_file(), [override]))


def test_box_the_wrong_way_round(scene_file):
    path = scene_file(instead="spacing = 0.02\nduration = 1\n[tank]\nmin = [0, 1]\nmax = [2, 0]")
    assert fault_of(path) == ["pool.toml: tank: min [0.0, 1.0] must lie below max [2.0, 0.0] on every axis; swap them"]


def test_solitary_wave_from_too_long_a_stroke(scene_file):
    path = scene_file('[waves]\nkind = "solitary"\nwave_height = 0.38')
    assert fault_of(path, ["tank.max=[5, 0.5]"]) == [
        "pool.toml: waves: the piston moves from 0 to 1.34 m; a quarter of the tank's length is 1.25 m; "
        "use lower or shorter waves, or a longer tank"
    ]


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
    (close,) = scene_warnings(load_scene(scene, ["waves.wave_height=0.11"]))
    assert close.startswith("waves.wave_height: 0.11 m is 0.78 of the 0.141 m at which such waves break")
    assert scene_warnings(load_scene(scene, ["waves.wave_height=0.1"])) == []
    assert "2.5 particles over the wave height" in scene_warnings(load_scene(scene, ["waves.wave_height=0.05"]))[0]


@pytest.mark.parametrize(
    "waves, lines",
    [
        (
            'kind = "irregular"\nHm0 = 0.35\npeak_period = 1.0',
            [
                "waves.Hm0: 0.35 m is 0.70 of the depth 0.5 m; a sea hardly exceeds 0.6, higher waves break",
                "waves.Hm0: 0.35 m is 0.23 of the wave length 1.51 m at the peak; a sea hardly exceeds 0.07, "
                "steeper waves break",
            ],
        ),
        (
            'kind = "irregular"\nHm0 = 0.08\npeak_period = 0.8',
            [
                "waves.Hm0: 0.08 m is 0.08 of the wave length 0.996 m at the peak",
                "spacing: 0.02 m gives 8.0 particles over the shortest wave 0.16 m",
            ],
        ),
        (
            'kind = "solitary"\nwave_height = 0.05',
            [
                "spacing: 0.02 m gives 2.5 particles over the wave height 0.05 m",
                "duration: the run ends at 2 s, and the piston has made its waves at 8.41 s",
            ],
        ),
        (
            'kind = "packet"\ngroups = [{wave_height = 0.1, period = 1.5, waves = 2},'
            "{wave_height = 0.4, period = 2, waves = 1}]",
            [
                "waves.groups[1].wave_height: 0.4 m is 0.80 of the depth 0.5 m; waves break at about 0.78",
                "duration: the run ends at 2 s, and the piston has made its waves at 5 s",
            ],
        ),
        (
            "wave_height = 0.1\nperiod = 1.5\n[[damping]]\nstart = 5\nend = 6",
            [
                "damping[0]: 0.35 wave lengths long, sends back about 33 % of the wave height; make it about a wave length"
            ],
        ),
        ("wave_height = 0.1\nperiod = 1.5\n[[damping]]\nstart = 3\nend = 6", []),
        (
            "wave_height = 0.1\nperiod = 1.5\n[gauges.a]\nx = 0.04\n[gauges.b]\nx = 0.06",
            ["gauges.a.x: 0.04 m lies in the path of the piston, which may come to 0.0463 m"],
        ),
        ('kind = "table"\nfile = "fast.csv"', ["waves: the piston reaches 3 m/s, 1.35 of sqrt(g depth)"]),
    ],
)
def test_every_kind_of_waves_is_looked_at(scene_file, tmp_path, waves, lines):
    (tmp_path / "fast.csv").write_text("t,x\n0,0\n0.1,0.3\n0.2,0.6\n0.3,0.9\n")
    warnings = scene_warnings(load_scene(scene_file(f"[waves]\n{waves}")))
    assert len(warnings) == len(lines)
    for warning, line in zip(warnings, lines, strict=True):
        assert warning.startswith(line)


def test_waves_in_figures(scene_file):
    added = "[waves]\nwave_height = 0.1\nperiod = 1.5\n[[damping]]\nstart = 3\nend = 6"
    assert wave_summary(load_scene(scene_file(added))) == [
        "waves: order 2, height 0.1 m, period 1.5 s, length 2.83 m, kd 1.11, H/L 0.035, 5.0 spacings high, 141 long",
        "waves: regular, piston from -0.0463 to 0.0463 m, at most 0.108 m/s",
        "damping[0]: 1.06 wave lengths at 2.4 omega send back about 0.71 %, by long-wave theory",
    ]
    assert wave_summary(load_scene(scene_file())) == []
    solitary = '[waves]\nkind = "solitary"\nwave_height = 0.15'
    figures, path = wave_summary(load_scene(scene_file(solitary), ["waves.absorb=true", "tank.max=[20, 0.5]"]))
    assert "H/d 0.30, speed 2.53 m/s, 7.5 spacings high" in figures
    assert path.startswith("waves: solitary, absorbing, piston from -0.721 to 1.44 m")
    assert path.endswith("at rest from 5.05 s on")


LIQUID = {"density": 1950.0, "blocks": [{"min": [0.0, -0.5], "max": [0.5, -0.3]}]}


@pytest.mark.parametrize(
    "change, message",
    [
        ({"blocks": []}, "liquids.sand: is nowhere; add [[liquids.sand.blocks]] with min and max"),
        (
            {"blocks": [{"min": [0.0, -0.9], "max": [0.5, -0.3]}]},
            "liquids.sand.blocks[0]: [0.0, -0.9] to [0.5, -0.3] m leaves",
        ),
        ({"blocks": LIQUID["blocks"] * 2}, "liquids.sand.blocks[1]: overlaps liquids.sand.blocks[0]"),
        (
            {"blocks": [{"min": [0, 0, 0], "max": [1, 1, 1]}]},
            "liquids.sand.blocks[0].min: [0.0, 0.0, 0.0] has 3 components",
        ),
        (
            {"rheology": {"mu_inf": 1.0}},
            "liquids.sand.rheology: needs either yield_stress or cross_time; give one of the two",
        ),
        (
            {"rheology": {"mu_inf": 1.0, "mu_0": 0.5, "yield_stress": 1}},
            "mu_0 must lie above mu_inf 1 Pa s; raise mu_0",
        ),
        ({"kinematic_viscosity": 1e-3, "rheology": {"mu_inf": 1.0, "yield_stress": 1}}, "remove one of them"),
    ],
)
def test_faults_of_liquids(change, message, tmp_path):
    data = {"spacing": 0.05, "duration": 1.0, "tank": {"min": [0, -0.5], "max": [1, 0.5]}}
    path = tmp_path / "scene.toml"
    path.write_text(dumps(data | {"liquids": {"sand": LIQUID | change}}))
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert message in str(error.value)
