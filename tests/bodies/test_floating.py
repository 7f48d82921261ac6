"""How bodies float: against the hydrostatics of boxes and spheres, upright and not."""

import math
import re
from contextlib import nullcontext

import pytest

import fsi
from bodies import load
from fsi.errors import SceneError
from fsi.particles.instruments import check_instruments
from fsi.scene.check_floating import afloat, floating_lines, narrow, slowed
from fsi.scene.instruments import FluxPlane

BOX = """
<mujoco>
  <worldbody>
    <body name="box">{joint}<geom name="box" type="box" size="0.2 0.15 0.1" density="{density}"/>{more}</body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def scene(tmp_path):
    def made(dimension=2, joint="<freejoint/>", density=500, more="", z=0.0, **keys):
        (tmp_path / "box.xml").write_text(BOX.format(joint=joint, density=density, more=more))
        low, high = ((-1.0, -0.6), (1.0, 0.5)) if dimension == 2 else ((-1.0, -0.8, -0.6), (1.0, 0.8, 0.5))
        body = {"mjcf": tmp_path / "box.xml", "position": (0.0, 0.0, z)} | keys.pop("body", {})
        tank = {"min": low, "max": high, "width": 0.3}
        return fsi.Scene(dimension=dimension, spacing=0.05, duration=1.0, tank=tank, bodies={"box": body}, **keys)

    return made


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_box_floats_as_archimedes_has_it(scene, dimension):
    """GM = I / V - BG (Newman 1977, sec. 6.5)."""
    draft, mass = 0.12, 500 * 1.2 * 0.4 * 0.3 * 0.2
    made = scene(dimension, density=600, z=0.07)
    found = load(made).hydrostatics()["box"]
    assert found["drawn"]["displaced_mass"] == pytest.approx(1000 * 0.4 * 0.3 * 0.03, rel=0.01)
    rest = found["rest"]
    assert rest["mass"] == pytest.approx(mass) and rest["displaced_mass"] == pytest.approx(mass, rel=1e-3)
    assert rest["draft"] == pytest.approx(draft, abs=0.002) and rest["rise"] == pytest.approx(-0.09, abs=0.001)
    assert rest["centre_of_buoyancy"] == pytest.approx(-draft / 2, abs=0.001)
    assert rest["metacentric_height"] == pytest.approx(0.4**2 / 12 / draft + draft / 2 - 0.1, abs=0.004)
    if dimension == 3:
        assert rest["metacentric_height_roll"] == pytest.approx(0.3**2 / 12 / draft + draft / 2 - 0.1, abs=0.004)
    [line] = afloat(made, {"box": found})
    assert re.search(r"rests 0\.0?(9|898) m lower", line) and 'bodies.box.start = "equilibrium"' in line
    assert len(list(floating_lines({"box": found}))) == 2
    bodies = load(scene(dimension, density=600, z=0.07, body={"start": "equilibrium"}))
    assert bodies.data.qpos[2] == pytest.approx(-0.02, abs=0.001)
    assert any("starts at rest, 0.0" in note and "below" in note for note in bodies.notes)
    assert afloat(made, bodies.hydrostatics()) == []


@pytest.mark.parametrize("z", [0.0, 1e-3, 0.01, -0.04])
def test_the_waterplane_is_found_wherever_the_level_cuts_the_cells(scene, z):
    drawn, draft = load(scene(z=z)).hydrostatics()["box"]["drawn"], 0.1 - z
    assert drawn["metacentric_height"] == pytest.approx(0.4**2 / 12 / draft + draft / 2 - 0.1, abs=0.002)


def test_an_unstable_pose_is_left(scene):
    """A heavy mast: upright the box is at rest and unstable, so that it turns over."""
    mast = '<geom name="mast" type="sphere" size="0.02" pos="0 0 0.3" mass="6"/>'
    wet = scene(more=mast, density=300)
    found = load(wet).hydrostatics()["box"]
    assert found["drawn"]["metacentric_height"] < 0 and abs(found["rest"]["heel"]) > 45


def test_a_sinking_body_is_told(scene):
    bodies = load(scene(density=1500))
    found = bodies.hydrostatics()
    assert "rest" not in found["box"] and "finds no rest" in afloat(scene(density=1500), found)[0]
    with pytest.raises(SceneError, match=r"bodies.box.start: the bodies find no rest"):
        load(scene(density=1500, body={"start": "equilibrium"}))


def test_a_spring_shares_the_weight(scene):
    slide = '<joint name="heave" type="slide" axis="0 0 1"/>'
    bodies = load(
        scene(joint=slide, density=500, body={"pto": {"stiffness": 1000.0, "rest": 0.05}, "start": "equilibrium"})
    )
    water = 1000 * 9.81 * 0.4 * 0.3
    assert bodies.data.qpos[0] == pytest.approx(1000 * 0.05 / (1000 + water), rel=0.02)


def test_a_start_at_rest_needs_still_water(scene):
    blocks = {"blocks": [{"min": (-1.0, -0.6), "max": (1.0, 0.0)}]}
    with pytest.raises(SceneError, match=r"bodies.box.start: the tank is not filled"):
        fsi.load_scene(scene(fluid=blocks, body={"start": "equilibrium"}))
    assert load(scene(fluid=blocks)).hydrostatics() == {}


def test_natural_periods_are_those_of_theory(tmp_path):
    """A half immersed cylinder has the added mass of its displaced water in heave at high frequency, half that of the whole
    one in an unbounded fluid (Newman 1977, sec. 4.13): T = 2 pi sqrt(pi R / 2 g)."""
    (tmp_path / "drum.xml").write_text(
        BOX.replace('type="box" size="0.2 0.15 0.1"', 'type="cylinder" zaxis="0 1 0" size="0.2 0.15"').format(
            joint='<joint name="heave" type="slide" axis="0 0 1"/>', density=500, more=""
        )
    )
    tank = {"min": (-2.4, -2.0), "max": (2.4, 0.3), "width": 0.3}
    scene = fsi.Scene(spacing=0.05, duration=1.0, tank=tank, bodies={"drum": {"mjcf": tmp_path / "drum.xml"}})
    [(name, period)] = fsi.check(scene, periods=True)["natural_periods"].items()
    assert name == "heave" and period == pytest.approx(2 * math.pi * math.sqrt(math.pi * 0.2 / (2 * 9.81)), rel=0.015)


@pytest.mark.parametrize("thickness", [0.04, 0.08])
def test_a_thin_plate_under_water_has_the_added_mass_of_theory(scene, thickness):
    """1.14 and 1.21 rho pi a2 of a plate 2a wide, a tenth and a fifth of that thick (DNV-RP-C205, table D-1), however few
    spacings it is thick."""
    spring = '<joint name="heave" type="slide" axis="0 0 1" stiffness="1000"/>'
    plate = scene(joint=spring, density=1000, z=-2.0).model_copy(update={"spacing": 0.04})
    file = plate.bodies["box"].mjcf
    file.write_text(file.read_text().replace('size="0.2 0.15 0.1"', f'size="0.2 0.15 {thickness / 2}"'))
    tank = plate.tank.model_copy(update={"min": (-3.0, -4.0), "max": (3.0, 0.3)})
    [period] = fsi.check(plate.model_copy(update={"tank": tank}), periods=True)["natural_periods"].values()
    added = 1000 * (period / (2 * math.pi)) ** 2 - 1000 * 0.4 * 0.3 * thickness
    theory = {0.04: 1.14, 0.08: 1.21}[thickness] * 1000 * math.pi * 0.2**2 * 0.3
    assert added == pytest.approx(theory, rel=0.05)


def test_a_half_immersed_ball_has_half_the_added_mass_of_a_whole_one(tmp_path):
    (tmp_path / "ball.xml").write_text(
        BOX.replace('type="box" size="0.2 0.15 0.1"', 'type="sphere" size="0.3"').format(
            joint='<joint name="heave" type="slide" axis="0 0 1"/>', density=500, more=""
        )
    )
    tank = {"min": (-1.5, -1.5, -1.5), "max": (1.5, 1.5, 0.4)}
    scene = fsi.Scene(
        dimension=3, spacing=0.06, duration=1.0, tank=tank, bodies={"ball": {"mjcf": tmp_path / "ball.xml"}}
    )
    [period] = fsi.check(scene, periods=True)["natural_periods"].values()
    water, stiffness = 1000 * 2 / 3 * math.pi * 0.3**3, 1000 * 9.81 * math.pi * 0.3**2
    assert period == pytest.approx(2 * math.pi * math.sqrt(1.5 * water / stiffness), rel=0.02)


def test_a_thin_geom_between_whole_spacings_is_told(scene):
    """A plate of 2.5 spacings carries particles for two: held under still water it is lifted by 0.83 of Archimedes' force, and
    by 1.00 of it with the standing pressure apart."""

    def said(spacing, **numerics):
        made = scene(density=1000, z=-0.4).model_copy(update={"spacing": spacing})
        file = made.bodies["box"].mjcf
        file.write_text(file.read_text().replace('size="0.2 0.15 0.1"', 'size="0.2 0.15 0.05"'))
        made = made.model_copy(update={"numerics": made.numerics.model_copy(update=numerics)})
        return [note for note in load(made).notes if "buoyancy" in note]

    [note] = said(0.04)
    assert "geom 'box' is 2.5 spacings thick" in note and "80 %" in note and "a spacing of 0.0333 m" in note
    assert said(0.04, standing_pressure="apart") == said(0.05) == said(0.1 / 3) == said(0.015) == []


def test_narrow_water_is_told(scene):
    wide = scene(z=-0.05).model_copy(update={"spacing": 0.025})
    assert narrow(wide, load(wide), None) == []
    near = wide.model_copy(update={"tank": wide.tank.model_copy(update={"min": (-0.26, -0.6)})})
    [line] = narrow(near, load(near), None)
    assert "narrower than 4 spacings (0.1 m)" in line and "a spacing of 0.01" in line


def test_narrow_water_under_a_fixed_geom_is_told(scene):
    stands = scene(joint="", z=-0.6 + 0.1)
    hangs = scene(joint="", z=-0.6 + 0.1 + 0.05)
    wet = '<custom><tuple name="wet"><element objtype="geom" objname="box"/></tuple></custom><worldbody>'
    file = stands.bodies["box"].mjcf
    file.write_text(file.read_text().replace("<worldbody>", wet))
    assert narrow(stands, load(stands), None) == []
    [line] = narrow(hangs, load(hangs), None)
    assert line.startswith("geom 'box': the water at") and "narrower than 4 spacings" in line


def test_a_flux_plane_inside_a_fixed_geom_is_refused(scene):
    """Its discharge would be nought for ever."""
    made = scene(joint="", z=-0.5)
    file = made.bodies["box"].mjcf
    wet = '<custom><tuple name="wet"><element objtype="geom" objname="box"/></tuple></custom><worldbody>'
    file.write_text(file.read_text().replace("<worldbody>", wet))
    for low, high, refused in ((-0.58, -0.42, True), (-0.58, -0.2, False)):
        solids = load(made).solids()
        placed = made.model_copy(update={"fluxes": {"crest": FluxPlane(min=(0.0, low), max=(0.0, high))}})
        with pytest.raises(SceneError, match=r"fluxes\.crest: lies inside a solid") if refused else nullcontext():
            check_instruments(placed, solids)


def test_a_body_in_a_damping_zone_is_told(scene):
    for start, told in ((0.1, True), (0.3, False)):
        made = scene(damping=[{"start": start, "end": 1.0}])
        lines = slowed(made, load(made))
        assert bool(lines) == told
    assert slowed(scene(), load(scene())) == []


def test_masses_of_bodies_of_one_tree_are_told_apart(scene):
    """A float on a slide of a wet plate, with a dry weight on it: Archimedes holds for each."""
    inner = (
        '<body name="float" pos="0 0 0.4"><joint name="slide" type="slide" axis="0 0 1"/>'
        '<geom name="hull" type="box" size="0.1 0.15 0.05" density="500"/>'
        '<body name="weight"><geom name="weight" type="sphere" size="0.01" mass="0.5"/></body></body>'
    )
    wet = "".join(f'<element objtype="geom" objname="{name}"/>' for name in ("box", "hull"))
    made = scene(joint='<joint type="slide" axis="0 0 1"/>', density=1000, more=inner, z=-0.4)
    file = made.bodies["box"].mjcf
    file.write_text(
        file.read_text().replace("<worldbody>", f'<custom><tuple name="wet">{wet}</tuple></custom><worldbody>')
    )
    found = {name: poses["drawn"] for name, poses in load(made).hydrostatics().items()}
    assert found["box"]["mass"] == pytest.approx(1000 * 0.4 * 0.3 * 0.2) == found["box"]["displaced_mass"]
    assert found["float"]["mass"] == pytest.approx(500 * 0.2 * 0.3 * 0.1 + 0.5)
    assert found["float"]["displaced_mass"] == pytest.approx(500 * 0.2 * 0.3 * 0.1, rel=0.01)
    assert found["float"]["centre_of_mass"] == pytest.approx(0.0) and found["box"]["centre_of_mass"] == pytest.approx(
        -0.4
    )
