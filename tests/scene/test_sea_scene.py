"""`[sea]` in a scene: what is refused, what is told, what it moves."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fsi.compute.reduce import Reductions
from fsi.compute.team import Team
from fsi.errors import SceneError
from fsi.fluid.sea import Sea
from fsi.owners import PISTON
from fsi.particles.layout import build
from fsi.particles.sea import check_zones
from fsi.particles.state import BoundaryState
from fsi.scene import geometry
from fsi.scene.check import scene_warnings
from fsi.scene.check_sea import sea_summary
from fsi.scene.file import load_scene, resolved_toml
from fsi.scene.model import Scene, Tank

SEA = """
[sea.waves]
wave_height = 0.1
period = 1.3
"""
IRREGULAR = "{kind = 'irregular', Hm0 = 0.1, peak_period = 1.3}"
ROUND = "dimension = 3\nspacing = 0.1\nduration = 2\n[tank]\nmin = [-2,-1.5,-0.5]\nmax = [2,1.5,0.3]\n"


@pytest.mark.parametrize(
    "change, told",
    [
        ({"waves.wave_height": "0.1", "waves.period": "1.3"}, "sea: the scene has [waves] too"),
        ({"damping": "[{start = 5, end = 6}]"}, "damping: the zones of the sea take waves away already"),
        ({"fluid.blocks": "[{min = [0, -0.5], max = [6, 0]}]"}, "fluid.blocks: a sea fills the tank"),
        ({"tank.walls": '["x-", "x+", "z-", "z+"]'}, "tank.walls: a sea needs a free surface"),
        ({"fluid.still_water_level": "0.5"}, "tank.walls: a sea needs a free surface"),
        ({"tank.walls": '["x-", "z-"]'}, "tank.walls: a sea needs the wall x+"),
        ({"tank.walls": '["x-", "x+"]'}, "tank.walls: a sea needs a floor"),
        (
            {"tank.periodic": '["x"]', "tank.max": "[5.5, 0.5]"},
            "tank.periodic: waves of 2.355 m do not repeat themselves",
        ),
        ({"tank.periodic": '["x"]', "sea.waves": IRREGULAR}, "sea.waves.kind: irregular waves do not repeat"),
        ({"sea.current": "0.3"}, "sea.current: 0.3 m/s along x would go through the walls x- and x+"),
        ({"sea.current": "[0.3, 0.1]"}, "sea.current: (0.3, 0.1) in 2 dimensions"),
        ({"sea.current": "-1.0", "tank.periodic": '["x"]'}, "sea.current: there are no waves of 1.3 s on this current"),
        ({"sea.heading": "90"}, "sea.heading: 90 degrees in two dimensions"),
        ({"sea.waves.absorb": "true"}, "sea.waves.absorb: there is no piston"),
        ({"fluid.start": "converged"}, "fluid.start: 'converged' is of water at rest"),
        ({"sea.zone": "3.0"}, "sea.zone: zones of 3 m at both ends leave nothing"),
        ({"tank.max": "[6.0, 0.05]"}, "tank.max: crests come to z = 0.05"),
        ({"sea.waves": "{kind = 'solitary', wave_height = 0.1}"}, "sea.waves.kind: waves of the kind 'solitary'"),
        ({"sea.waves.order": "2", "sea.waves.period": "6"}, "sea.waves.order: H L^2 / d^3"),
        ({"sea.order": "2"}, "sea.order: regular waves are one wave"),
        ({"sea.order": "2", "sea.waves": IRREGULAR}, "sea.order: 200 waves have 40000 bound ones"),
        ({"sea.spreading": "8", "sea.waves": IRREGULAR}, "sea.spreading: waves in two dimensions have one direction"),
        ({"loads.a": "{on = 'x+'}"}, "loads.a.on: the wall x+ moves with the waves of the sea"),
    ],
)
def test_what_cannot_be_is_refused(scene_file, change, told):
    with pytest.raises(SceneError) as refused:
        load_scene(scene_file(SEA), [f"{key}={value}" for key, value in change.items()])
    assert any(told in line for line in str(refused.value).splitlines()), refused.value


@pytest.mark.parametrize(
    "change, told",
    [
        ("tank.max=[1.5, 0.5]", "tank: 1.5 m is 0.65 of a wave length"),
        ("sea.zone=0.3", "sea.zone: 0.13 wave lengths wide, sends back about "),
        ("numerics.velocity_reconstruction=none", "numerics.velocity_reconstruction: 'none' lets the artificial visc"),
        ("sea.waves.wave_height=0.05", "2.5 particles over the wave height"),
        ("spacing=0.08", "29 particles over the wave length 2.31 m; such waves run about 3 % too slow, 2 % with 0.06"),
    ],
)
def test_what_is_likely_not_meant_is_told(scene_file, change, told):
    changes = [change, "sea.zone=0.6"] if change.startswith("tank") else [change]
    assert any(told in line for line in scene_warnings(load_scene(scene_file(SEA), changes)))


def test_a_sea_of_two_lengths_says_nothing_but_its_figures(scene_file, tmp_path):
    scene = load_scene(scene_file(SEA), ["tank.max=[4.6, 0.5]"])
    assert scene_warnings(scene) == []
    figures, kind, box, flume = sea_summary(scene)
    assert "kd 1.36" in figures and "5.0 spacings high" in figures
    assert "under waves from the first step" in kind and "zones of 1.16 m, 0.50 wave lengths, at 1.4 omega" in box
    assert "times as long" in flume
    again = tmp_path / "again.toml"
    again.write_text(resolved_toml(scene))
    assert load_scene(again) == scene


def test_waves_on_a_current_are_told_as_the_water_and_as_a_fixed_place_see_them(scene_file):
    changes = ["tank.max=[5.76, 0.5]", "tank.periodic=['x']", "sea.current=0.3"]
    lines = sea_summary(load_scene(scene_file(SEA), changes))
    assert "current (0.3, 0) m/s" in lines[1] and "at a fixed place their period is 1.3 s" in lines[1]
    assert "period 1.51" in lines[0]


def test_a_current_across_the_waves_flows_along_a_periodic_y_axis_and_leaves_them_alone(scene_file):
    more = "[sea]\nzone = 0.5\ncurrent = [0.0, 0.2]\n"
    scene = load_scene(scene_file(SEA + more, instead=ROUND + 'periodic = ["y"]\n'))
    assert geometry.sea_sides(scene) == ["x-", "x+", "y-", "y+"] and geometry.moving_sides(scene) == {"x-", "x+"}
    waves = geometry.incident_waves(scene)
    assert waves.seen == pytest.approx(waves.omega) and waves.drift < 0
    np.testing.assert_allclose(waves.flow(0.0, 3), [waves.drift, 0.2])


def placed(scene, time):
    layout = build(scene)
    boundary = BoundaryState(layout)
    sea = Sea(scene, boundary, 1.0)
    sea.place(boundary, time, 0.0)
    return layout, boundary, sea


def test_walls_move_with_the_water_at_both_ends(scene_file):
    scene = load_scene(scene_file(SEA), ["spacing=0.05"])
    layout, boundary, sea = placed(scene, 0.35)
    mine = boundary.of_owner(PISTON)
    home = layout.boundary[mine]
    assert set(np.sign(home[:, 0] - 3)) == {-1, 1} and (np.abs(home[:, 0] - 3) > 3).all()
    face = home.copy()
    face[:, 0] = np.clip(face[:, 0], 0, 6)
    wet = face[:, 1] < 0
    exact = sea.waves.velocity(0.35, face) - [sea.waves.drift, 0]
    assert boundary.velocity[mine][wet, 0] == pytest.approx(exact[wet, 0], abs=0.15 * np.abs(exact).max())
    np.testing.assert_allclose(boundary.skin[mine][wet, 1], exact[wet, 1], atol=1e-9)
    assert np.abs(boundary.position[mine] - home).max() < geometry.retreats(scene)[0][0]
    assert (layout.owner == PISTON).sum() == len(home) and not boundary.acceleration[boundary.of_owner(0)].any()


def test_the_tank_is_filled_to_its_walls_under_waves_and_the_water_keeps_its_volume(scene_file):
    scene = load_scene(scene_file(SEA), ["spacing=0.05"])
    layout = build(scene)
    still = build(load_scene(scene_file(SEA), ["spacing=0.05", "sea.start=rest"]))
    assert len(layout.position) == len(still.position) and still.velocity.max() == 0
    z = layout.position[:, -1]
    waves = geometry.incident_waves(scene)
    top = waves.elevation(0.0, layout.position[:, :1])
    assert ((z < top) & (z > -0.5)).all() and (layout.pressure >= 0).all()
    near = z > top - 0.06
    assert layout.pressure[near] == pytest.approx(9810 * (top - z)[near], abs=120)
    np.testing.assert_allclose(layout.velocity, waves.velocity(0.0, layout.position))


def test_oblique_waves_move_all_four_walls_and_long_crested_ones_along_x_two(scene_file):
    straight = load_scene(scene_file(SEA + "[sea]\nzone = 0.5\n", instead=ROUND))
    oblique = load_scene(scene_file(SEA + "[sea]\nzone = 0.5\nheading = 30\n", instead=ROUND))
    assert geometry.moving_sides(straight) == {"x-", "x+"}
    assert geometry.moving_sides(oblique) == {"x-", "x+", "y-", "y+"}
    _, boundary, _ = placed(oblique, 0.2)
    mine = boundary.velocity[boundary.of_owner(PISTON)]
    np.testing.assert_allclose(mine[:, 1], math.tan(math.radians(30)) * mine[:, 0], atol=1e-12)
    assert np.isfinite(boundary.acceleration).all()


def test_walls_and_zones_of_a_spread_sea_move_as_its_water(scene_file):
    sea = "\n[sea]\nzone = 0.5\nheading = 20\nspreading = 10\norder = 2\n"
    waves = "[sea.waves]\nkind = 'irregular'\nHm0 = 0.1\npeak_period = 1.5\ncomponents = 10\nhighest = 1.6\n"
    scene = load_scene(scene_file(sea + waves, instead=ROUND))
    layout, boundary, sea = placed(scene, 0.2)
    mine = boundary.of_owner(PISTON)
    face = np.clip(layout.boundary[mine], *map(np.array, ([-2, -1.5, -9], [2, 1.5, 9])))
    wet = face[:, 2] < 0
    exact = sea.waves.velocity(0.2, face[wet]) - [*sea.waves.mean_flow(0.2) * sea.waves.along(3), 0]
    assert boundary.velocity[mine][wet, :2] == pytest.approx(exact[:, :2], abs=0.2 * np.abs(exact).max())
    rng = np.random.default_rng(0)
    water = rng.uniform([-2, -1.5, -0.5], [2, 1.5, 0], (50, 3))
    fluid = SimpleNamespace(count=50, position=water, velocity=np.zeros((50, 3)), label=np.arange(50))
    sea._width = 4.0  # all of it is in a zone
    sea.draw(fluid, 1e9, Team(1), Reductions())
    exact = sea.waves.velocity(0.2, water)
    np.testing.assert_allclose(fluid.velocity, exact, atol=0.01 * np.abs(exact).max())


class Box:
    """A solid whose face comes to x = 0.8."""

    name = "float"

    def boundary(self, spacing, layers):
        return np.array([[0.8, -0.1], [1.5, -0.1]])


class Bodies:
    def solids(self):
        return [(2, Box())]


def test_a_body_in_a_zone_is_refused(scene_file):
    with pytest.raises(SceneError, match=r"sea.zone: float comes to 0.8 m from the side x-"):
        check_zones(load_scene(scene_file(SEA)), Bodies())
    check_zones(load_scene(scene_file(SEA), ["sea.zone=0.7"]), Bodies())


@pytest.mark.parametrize(
    "more, numerics",
    [
        ({"sea": {"waves": {"wave_height": 0.1, "period": 1.3}}}, (0.05, 0.3)),
        ({"sea": {"waves": {"wave_height": 0.1, "period": 1.3}}, "bodies": {"b": {"mjcf": "b.xml"}}}, (0.05, 0.2)),
        ({"waves": {"wave_height": 0.1, "period": 1.3}}, (0.0, 0.3)),
        ({"waves": {"wave_height": 0.1, "period": 1.3}, "numerics": {"mach": 0.1}}, (0.0, 0.1)),
        ({"waves": {"wave_height": 0.1, "period": 1.3}, "bodies": {"b": {"mjcf": "b.xml"}}}, (0.05, 0.2)),
        ({"waves": {"kind": "solitary", "wave_height": 0.1}}, (0.05, 0.2)),
        ({}, (0.05, 0.2)),
    ],
)
def test_a_scene_whose_waves_go_on_has_the_numerics_that_keep_them(more, numerics):
    tank = Tank(min=(0.0, -0.5), max=(6.0, 0.3))
    scene = Scene.model_validate({"spacing": 0.02, "duration": 1.0, "tank": tank} | more)
    assert (scene.numerics.artificial_viscosity, scene.numerics.mach) == numerics
