"""Every key of a scene stands here: with a case in which it has no effect and is told so, or with why it always has one."""

from typing import Annotated, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from fsi.errors import SceneError
from fsi.plugins import find, registered
from fsi.scene.check import scene_warnings
from fsi.scene.check_effect import IDLE, idle_solids, idle_values
from fsi.scene.file import load_scene, resolved_toml
from fsi.scene.model import Scene
from fsi.waves import known_kinds, load_kind

OFF = {"output.mcap": "false", "output.timeline": "false"}
WEIGHTLESS = {"gravity": "0"}
WAVES = {"waves.wave_height": "0.1", "waves.period": "1.5"}
SPECTRUM = {"waves.kind": "spectrum", "waves.file": "s.csv"}
SEA = {"sea.waves.wave_height": "0.1", "sea.waves.period": "1.3"}
BLOCK = {"fluid.blocks": "[{min = [0, -0.5], max = [1, 0]}]"}
OPEN = {"tank.walls": "[]"}
FIXED = {"numerics.fixed_time_step": "0.001"}
SAND = {"liquids.sand.blocks": "[{min = [0, -0.5], max = [1, -0.3]}]"}
BODY = {"bodies.b.mjcf": "b.xml"}
MOVED = BODY | {"coupler.scheme": "prescribed"}

CASES = {  # pattern -> key, value without effect, the rest of the scene, a word of the reason
    "tank.walls": ("tank.walls", '["x-", "x+", "y-", "z-"]', {}, "no y axis"),
    "tank.grid": ("tank.grid", "{level = 2.0}", {}, "no grid"),
    "tank.width": ("tank.width", "2.0", "3D", "min and max"),
    "fluid.kinematic_viscosity": ("fluid.kinematic_viscosity", "1e-3", {"numerics.viscosity": "none"}, "'none'"),
    "fluid.rheology": (
        "fluid.rheology",
        "{mu_inf = 1.0, yield_stress = 1.0}",
        {"numerics.viscosity": "none"},
        "'none'",
    ),
    "liquids.*.kinematic_viscosity": (
        "liquids.sand.kinematic_viscosity",
        "1e-3",
        SAND | {"numerics.viscosity": "none"},
        "'none'",
    ),
    "liquids.*.rheology": (
        "liquids.sand.rheology",
        "{mu_inf = 1.0, yield_stress = 1.0}",
        SAND | {"numerics.viscosity": "none"},
        "'none'",
    ),
    "fluid.still_water_level": ("fluid.still_water_level", "0.1", BLOCK, "blocks say"),
    "fluid.acceleration": ("fluid.acceleration", "[0.0, 0.0]", {}, "zero"),
    "fluid.acceleration_gradient": ("fluid.acceleration_gradient", "[[0.0, 0.0], [0.0, 0.0]]", BLOCK | OPEN, "zero"),
    "fluid.start": ("fluid.start", "zero", WEIGHTLESS, "no gravity"),
    "waves.start": ("waves.start", "9.0", {"waves.kind": "solitary", "waves.wave_height": "0.1"}, "ends at 2 s"),
    "waves.file": ("waves.file", "late.csv", {"waves.kind": "table"}, "first row is at 5 s"),
    "sea.waves.ramp": ("sea.waves.ramp", "2.0", SEA, "under waves"),
    "gauges.*": ("gauges.a", "{x = 1.0}", OFF, "both off"),
    "gauges.*.y": ("gauges.a", "{x = 1.0, y = 0.5}", {}, "no y axis"),
    "probes.*": ("probes.a", "{position = [1.0, -0.1]}", {"output.series": "0"}, "output.series is 0"),
    "velocimeters.*": ("velocimeters.a", "{position = [1.0, -0.1]}", OFF, "both off"),
    "velocimeters.*.points": ("velocimeters.a", "{position = [1.0, -0.1], points = 5}", {}, "one point"),
    "depths.*": ("depths.a", "{x = 1.0}", OFF, "both off"),
    "depths.*.y": ("depths.a", "{x = 1.0, y = 0.5}", {}, "no y axis"),
    "fluxes.*": ("fluxes.a", "{min = [1.0, -0.5], max = [1.0, 0.5]}", OFF, "both off"),
    "runups.*": ("runups.a", "{start = [1.0], end = [1.5]}", OFF, "both off"),
    "areas.*": ("areas.a", "{min = [1.0], max = [1.5]}", OFF, "both off"),
    "loads.*": ("loads.a", "{on = 'x+'}", OFF, "both off"),
    "waves.time": ("waves.time", "2", SPECTRUM, "one spectrum"),
    "waves.site": ("waves.site", "1", SPECTRUM, "one spectrum"),
    "control.interval": (
        "control.interval",
        "9.0",
        BODY | {"control.function": "c.py:f", "coupler.scheme": "lagged"},
        "ends at 2 s",
    ),
    "bodies.*.pto": ("bodies.b.pto", "{damping = 0.0}", BODY, "no force"),
    "bodies.*.pto.rest": ("bodies.b.pto", "{damping = 3.0, rest = 0.1}", BODY, "no spring"),
    "coupler.scheme": ("coupler.scheme", "lagged", {}, "no bodies"),
    "coupler.tolerance": (
        "coupler.tolerance",
        "1e-3",
        MOVED | {"coupler.motion.hinge": "{amplitude = 0.1, omega = 1.0}"},
        "nothing to settle",
    ),
    "coupler.motion.*.file": ("coupler.motion.hinge.file", "late.csv", MOVED, "first row is at 5 s"),
    "numerics.accuracy": (
        "numerics.accuracy",
        "draft",
        {"numerics.smoothing_ratio": "1.8", "numerics.mach": "0.25"},
        "all",
    ),
    "numerics.density_tolerance": ("numerics.density_tolerance", "1e-4", {}, "iisph"),
    "numerics.lambda_max": ("numerics.lambda_max", "0.2", {}, "iisph"),
    "numerics.wall_friction": ("numerics.wall_friction", "0.1", {}, "iisph"),
    "numerics.sweeps": ("numerics.sweeps", "8", FIXED | {"numerics.solver": "converged"}, "fixed_time_step"),
    "numerics.pressure_tolerance": ("numerics.pressure_tolerance", "1e-4", {}, "converged"),
    "numerics.wall_slip": ("numerics.wall_slip", "free_slip", BLOCK | OPEN, "no wall"),
    "numerics.viscous_step": ("numerics.viscous_step", "implicit", {"numerics.viscosity": "none"}, "'none'"),
    "numerics.turbulence": ("numerics.turbulence", "smagorinsky", {"numerics.viscosity": "none"}, "'none'"),
    "numerics.smagorinsky": ("numerics.smagorinsky", "0.2", {}, "turbulence"),
    "numerics.artificial_viscosity": ("numerics.artificial_viscosity", "0.1", WEIGHTLESS, "speed of sound"),
    "numerics.velocity_reconstruction": (
        "numerics.velocity_reconstruction",
        "none",
        {"numerics.artificial_viscosity": "0"},
        "no artificial viscosity",
    ),
    "numerics.shifting": ("numerics.shifting", "0.0", {}, "free surface"),
    "numerics.standing_pressure": ("numerics.standing_pressure", "apart", WEIGHTLESS, "gravity"),
    "numerics.wall_guard": ("numerics.wall_guard", "0.5", BLOCK | OPEN, "no wall"),
    "numerics.mach": ("numerics.mach", "0.1", WEIGHTLESS, "gravity"),
    "numerics.courant": ("numerics.courant", "0.1", FIXED, "fixed_time_step"),
    "numerics.max_time_step": ("numerics.max_time_step", "0.1", FIXED, "fixed_time_step"),
    "output.series": ("output.series", "0.05", OFF, "both off"),
    "output.particles": ("output.particles", "0.05", {"output.timeline": "false"}, "no stream"),
    "output.fields": ("output.fields", '["speed"]', {"output.timeline": "false"}, "no stream"),
    "output.fraction": ("output.fraction", "0.5", {"output.particles": "0"}, "output.particles is 0"),
    "output.particles_limit": ("output.particles_limit", "9.0", {"output.fraction": "0.5"}, "output.fraction"),
    "output.values": ("output.values", "true", {"output.timeline": "false"}, "output.timeline is off"),
    "output.cloud": ("output.cloud", "true", {"output.mcap": "false"}, "output.mcap"),
}


def coupler_of(name):
    return find("couplers", name)


ALWAYS = {  # pattern -> why a value always has an effect, or which check refuses or tells one that has none
    "name description": "names the run folder; is listed by `fsi cases`",
    "dimension spacing duration gravity tank.min tank.max": "the run is made of them",
    "numerics.density_relaxation": "every solver reads it; refused above 1 for `iisph`",
    "tank.open": "refused for a side with a wall or without an axis",
    "tank.periodic": "refused for an axis that the scene does not have",
    "tank.grid.origin tank.grid.direction tank.grid.level tank.grid.depths": "with a grid, see `tank.grid`",
    "tank.grid.missing": "told by `idle_solids` where nothing is missing",
    "tank.bathymetry": "refused where no part of it lies in the tank, by `idle_solids`",
    "fluid.density liquids.*.density": "pressures and forces are proportional to it",
    "fluid.blocks.*.min fluid.blocks.*.max fluid.blocks.*.velocity": "the fluid at the start",
    "fluid.blocks.*.polygon fluid.blocks.*.mesh fluid.blocks.*.angle": "the fluid at the start",
    "liquids.*.blocks.*.min liquids.*.blocks.*.max liquids.*.blocks.*.velocity": "the fluid at the start",
    "liquids.*.blocks.*.polygon liquids.*.blocks.*.mesh liquids.*.blocks.*.angle": "the fluid at the start",
    "fluid.rheology.law fluid.rheology.mu_inf fluid.rheology.mu_0 fluid.rheology.yield_stress": "with the rheology",
    "fluid.rheology.cross_time fluid.rheology.consistency fluid.rheology.exponent": "with the rheology",
    "fluid.rheology.regularisation fluid.rheology.friction fluid.rheology.friction_fast": "with the rheology",
    "fluid.rheology.inertial_number fluid.rheology.grain_diameter fluid.rheology.grain_density": "with the rheology",
    "fluid.rheology.pore_density": "with the rheology",
    "liquids.*.rheology.law liquids.*.rheology.mu_inf liquids.*.rheology.mu_0": "with the rheology",
    "liquids.*.rheology.yield_stress liquids.*.rheology.cross_time": "with the rheology",
    "liquids.*.rheology.consistency liquids.*.rheology.exponent liquids.*.rheology.regularisation": "with the rheology",
    "liquids.*.rheology.friction liquids.*.rheology.friction_fast": "with the rheology",
    "liquids.*.rheology.inertial_number liquids.*.rheology.grain_diameter": "with the rheology",
    "liquids.*.rheology.grain_density liquids.*.rheology.pore_density": "with the rheology",
    "waves.kind waves.absorb waves.wave_height waves.period waves.order waves.ramp": "the piston's path",
    "waves.spectrum waves.Hm0 waves.peak_period waves.seed waves.components waves.highest waves.theory": "the piston's path",
    "waves.distance waves.delay waves.lowest waves.format waves.scale waves.terms waves.carries": "the piston's path",
    "waves.crest waves.place": "the piston's path",
    "sea.heading sea.zone sea.rate sea.start": "walls and zones",
    "sea.spreading sea.order": "of a sum of waves; refused for one wave",
    "sea.current": "refused along an axis that is not periodic",
    "sea.waves.*": "those of `waves`, for the incident waves; kinds that a piston alone makes are refused, and `absorb`",
    "waves.gamma": "refused where the spectrum has none",
    "waves.groups.*.wave_height waves.groups.*.period waves.groups.*.waves": "the piston's path",
    "damping.*.start damping.*.end damping.*.axis damping.*.rate": "a zone outside the tank is refused",
    "gauges.*.reading": "how the gauge reads",
    "probes.*.body probes.*.site": "refused without bodies, or where no moving wet body has it",
    "depths.*.x velocimeters.*.position velocimeters.*.end": "outside the tank refused",
    "fluxes.*.min fluxes.*.max": "refused where the plane lies outside the tank",
    "runups.*.start runups.*.end areas.*.min areas.*.max": "outside the tank refused",
    "runups.*.depth areas.*.depth": "where the water line is",
    "loads.*.on loads.*.min loads.*.max": "refused where nothing fixed is there",
    "loads.*.about": "the torque",
    "gauges.*.x probes.*.position": "outside the tank refused; over dry ground told by `dry_gauges`",
    "bodies.*.mjcf bodies.*.position": "bodies outside the tank are refused, fixed geoms told by `check_inside`",
    "bodies.*.moorings.*.anchor bodies.*.moorings.*.fairlead bodies.*.moorings.*.length": "the line's force",
    "bodies.*.moorings.*.mass bodies.*.moorings.*.diameter bodies.*.moorings.*.EA": "its weight and stretch",
    "bodies.*.moorings.*.body": "refused beside a site",
    "bodies.*.start": "refused where the bodies find no rest, or nothing moves them",
    "bodies.*.glued_layers": "told by `idle_solids` where no body of the file moves",
    "bodies.*.pto.kind bodies.*.pto.damping bodies.*.pto.stiffness bodies.*.pto.hold bodies.*.pto.least_speed": "the force",
    "bodies.*.pto.force bodies.*.pto.file bodies.*.pto.function": "the force; refused for prescribed motion",
    "coupler.motion.*.amplitude coupler.motion.*.omega coupler.motion.*.ramp": "refused without bodies, or another scheme",
    "numerics.smoothing_ratio numerics.solver numerics.precision numerics.viscosity": "in every sweep",
    "numerics.kernel tank.boundary": "in every sweep; refused where a solver does not know it",
    "numerics.fixed_time_step": "in every step",
    "output.mcap output.timeline": "a stream more or less",
    "control.function control.settings": "refused for prescribed motion, without bodies, actuators, or a class that takes them",
    "output.checkpoint": "checkpoints more or less often",
    "output.on_failure": "decides when a log fails",
    "alarms.lost_particles alarms.energy": "when a run fails",
    "bodies.*.dry_inside": "water inside an open body or none",
}


def patterns(part: type[BaseModel], prefix: str = ""):
    """Every key of a part, `*` for names and numbers; of the waves and the coupler those of every kind."""
    kinds = {"waves": map(load_kind, known_kinds()), "coupler": map(coupler_of, registered("couplers"))}
    for name, field in part.model_fields.items():
        if part is Scene and name in kinds:
            for kind in kinds[name]:
                yield from patterns(kind, f"{name}.")
            continue
        here = f"{prefix}{name}"
        if here == "sea.waves":
            yield "sea.waves.*"
            continue
        inner = list(_parts(field.annotation, ""))
        if not inner:
            yield here
        for star, inside in inner:
            star = "" if here.endswith(".pto") else star
            yield from patterns(inside, f"{here}{star}.")


def _parts(annotation, star):
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield star, annotation
    origin = get_origin(annotation)
    many = origin is dict or origin is tuple
    for inner in get_args(annotation)[:1] if origin is Annotated else get_args(annotation):
        yield from _parts(inner, ".*" if many else star)


def test_every_key_of_a_scene_stands_in_one_of_the_tables():
    keys = set(patterns(Scene))
    listed = {key for line in ALWAYS for key in line.split()}
    assert set(CASES) == set(IDLE)
    assert not listed & set(IDLE)
    leaves = {pattern for pattern in IDLE if pattern in keys}
    assert set(IDLE) - leaves == {
        "tank.grid",
        "fluid.rheology",
        "liquids.*.rheology",
        "sea.waves.ramp",
        "gauges.*",
        "probes.*",
        "velocimeters.*",
        "depths.*",
        "fluxes.*",
        "runups.*",
        "areas.*",
        "loads.*",
        "bodies.*.pto",
    }  # whole parts
    assert keys - leaves - listed == set()
    assert listed - keys == set()


@pytest.fixture
def scene(scene_file, tmp_path):
    (tmp_path / "late.csv").write_text("t,x\n5,0\n6,0.01\n7,0\n")
    (tmp_path / "s.csv").write_text("f,S\n0.4,0.0\n0.6,0.02\n0.8,0.02\n1.0,0.0\n")
    (tmp_path / "b.xml").write_text("<mujoco/>")
    (tmp_path / "c.py").write_text("def f(run):\n    pass\n")

    def load(changes):
        if isinstance(changes, dict) and changes.pop("3D", None):
            return load_scene(
                scene_file(
                    instead="dimension = 3\nspacing = 0.1\nduration = 2\n[tank]\nmin = [0,0,-1]\nmax = [2,1,1]\n"
                ),
                [f"{key}={value}" for key, value in changes.items()],
            )
        return load_scene(scene_file(), [f"{key}={value}" for key, value in changes.items()])

    return load


@pytest.mark.parametrize("key, value, rest, why", CASES.values(), ids=CASES)
def test_a_value_without_effect_is_told(scene, key, value, rest, why):
    rest = {"3D": True} if rest == "3D" else dict(rest)
    told = scene_warnings(scene(rest | {key: value}))
    lines = [line for line in told if line.startswith(key) and "has no effect" in line]
    assert len(lines) == 1 and why in lines[0], told
    assert [line for line in told if "has no effect" in line] == lines  # and nothing else is told


def test_a_scene_with_every_default_written_out_says_nothing(scene, tmp_path):
    file = tmp_path / "resolved.toml"
    for changes in ({}, {"numerics.accuracy": "fine", **FIXED}, {"numerics.accuracy": "draft", **WAVES}):
        file.write_text(resolved_toml(scene(dict(changes))))
        assert idle_values(load_scene(file)) == []


def test_a_ramp_longer_than_the_run_is_told(scene):
    told = scene_warnings(scene(WAVES | {"waves.ramp": "500.0"}))
    assert any(line.startswith("waves.ramp: 500 s, and the run ends at 2 s") for line in told)
    with pytest.raises(SceneError, match="control: has no effect on prescribed motion"):
        scene(
            MOVED | {"control.function": "c.py:f", "coupler.motion.hinge": "{amplitude = 0.1, omega = 1.0}"},
        )


def test_waves_need_blocks_that_reach_the_still_water_level(scene):
    with pytest.raises(SceneError, match=r"fluid.blocks: no block meets the x- wall"):
        scene(WAVES | {"fluid.blocks": "[{min = [1, -0.5], max = [6, 0]}]"})
    low = WAVES | {"fluid.blocks": "[{min = [0, -0.5], max = [6, -0.2]}]"}
    (told,) = [line for line in scene_warnings(scene(low)) if line.startswith("fluid.still_water_level")]
    assert "0.3 m of water there" in told and told.endswith("set it to -0.2")
    told = scene_warnings(scene(low | {"fluid.still_water_level": "-0.2"}))
    assert not any("blocks at the piston" in line for line in told)


class Ground:
    """A box of solid ground from `low` to `high`."""

    def __init__(self, low, high, name=""):
        self.low, self.high, self.name = np.array(low), np.array(high), name

    def clearance(self, points):
        return np.maximum(self.low - points, points - self.high).max(1)

    def boundary(self, spacing, layers):
        return np.array([self.low, self.high, (self.low + self.high) / 2])


class Fixed:
    """Bodies that are one fixed solid."""

    names = ()

    def __init__(self, solid):
        self._solid = solid

    def solids(self):
        return [(0, self._solid)]

    def gaps(self):
        return []


def test_a_bathymetry_outside_the_tank_is_refused(scene):
    tank, far, near = scene({}), Ground((250, -1), (251, 1), "quay"), Ground((2, -1), (3, -0.3), "sill")
    with pytest.raises(SceneError, match=r"tank.bathymetry: has no effect: no part of it lies in the tank; move it"):
        idle_solids(tank, None, far)
    assert idle_solids(tank, Fixed(near), near) == []  # fixed geoms outside are told where bodies are checked


def test_gauges_over_dry_ground_are_told(scene):
    from fsi.fluid.gauges import dry_gauges
    from fsi.particles.layout import build

    for ground, keys in (
        (None, {}),
        (Ground((2, -1), (3, -0.3)), {}),
        (Ground((2, -1), (3, 0.2)), None),
        (None, BLOCK),
        (None, {"gauges.a": "{x = 0.0}", "tank.periodic": '["x"]'}),  # where the tank repeats itself there is water
    ):
        it = scene({"gauges.a": "{x = 2.5}"} | (keys or {}))
        laid = build(it, None, ground)
        told = dry_gauges(it, laid.position, laid.boundary)
        assert bool(told) == (keys in (None, BLOCK))
        assert all("gauges a: no free surface there at the start" in line for line in told)


def test_water_up_to_a_top_without_a_wall_is_refused(scene):
    with pytest.raises(
        SceneError, match=r"still_water_level: 0.5 m is the tank's top, where there is no wall.*; raise tank.max"
    ):
        scene({"fluid.still_water_level": "0.5"})
    lid = '["x-", "x+", "z-", "z+"]'
    assert scene({"fluid.still_water_level": "0.5", "tank.walls": lid}).closed
