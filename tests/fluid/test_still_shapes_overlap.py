"""Solids that touch and overlap the tank's walls make one boundary, and water at rest over it stays so."""

import numpy as np
import pytest

from cases.validation.fluid import still_beds
from cases.validation.fluid.still_beds import SETUPS, SPACING, TARGET, measure, scene
from fsi.particles.fixed import distances
from fsi.particles.layout import build
from fsi.particles.tank import PISTON, WALL
from fsi.scene.binding import bind
from fsi.scene.model import Scene

WORST = ("wide_top+0.1", "narrow_top+0.5", "wide_hover+0.7", "wavy_cut", "cliff", "pile_in_bed", "beam_through_wall")
PLAIN = [
    pytest.param(name, marks=[] if name in WORST else pytest.mark.slow)
    for name, setup in SETUPS.items()
    if setup.get("dimension", 2) == 2
]


def laid(data):
    it = Scene.model_validate(data)
    bodies, _, ground = bind(it, "test")
    solids = [ground] * (ground is not None) + [s for owner, s in (bodies.solids() if bodies else []) if owner == WALL]
    return build(it, bodies, ground), solids


def gaps(points):
    pairs = np.linalg.norm(points[:, None] - points[None], axis=2) + np.eye(len(points))
    return pairs.min(1)


@pytest.mark.parametrize("name", PLAIN)
def test_the_boundary_is_one_layer_without_holes(name, tmp_path):
    """No two of its particles crowd, no water is inside, and within reach of the water every place in the solids has a
    particle near it."""
    layout, solids = laid(scene(SPACING, tmp_path, **SETUPS[name]))
    assert gaps(layout.boundary).min() > 0.5 * SPACING
    assert min(solid.clearance(layout.position).min() for solid in solids) > 0
    assert distances(layout.position, layout.boundary, SPACING).min() > 0.5 * SPACING
    x, z = np.arange(-0.03, still_beds.LENGTH + 0.03, 0.005), np.arange(-still_beds.DEPTH - 0.03, -0.1, 0.005)
    points = np.stack(np.meshgrid(x, z, indexing="ij"), -1).reshape(-1, 2)
    outside = np.min([points[:, 0], still_beds.LENGTH - points[:, 0], points[:, 1] + still_beds.DEPTH], axis=0)
    solid = np.minimum(outside, np.min([s.clearance(points) for s in solids], axis=0)) < -0.2 * SPACING
    wet = distances(points, layout.position, 1.2 * SPACING) < 1.2 * SPACING
    assert distances(points[solid & wet], layout.boundary, 2 * SPACING).max() < 1.3 * SPACING


def test_a_bed_flush_with_the_floor_changes_nothing(tmp_path):
    plain, _ = laid(scene(SPACING, tmp_path))
    flush, _ = laid(scene(SPACING, tmp_path, **SETUPS["wide_top+0.0"]))
    under, _ = laid(scene(SPACING, tmp_path, **SETUPS["narrow_top-0.5"]))
    for layout in (flush, under):
        assert np.array_equal(layout.boundary, plain.boundary)
        assert np.array_equal(layout.position, plain.position)


def test_a_sealed_gap_holds_no_water_and_says_so(tmp_path):
    layout, _ = laid(scene(SPACING, tmp_path, **SETUPS["wide_hover+0.7"]))
    assert layout.position[:, 1].min() > -still_beds.DEPTH + 5 * SPACING
    assert any("sealed gaps" in note for note in layout.notes)


def test_the_piston_ends_at_the_bed_it_stands_on(tmp_path):
    """And the bed goes on behind it, as far back as it moves."""
    bed = still_beds.box(-1.0, 4.0, -0.9, -0.453)
    data = scene(SPACING, tmp_path, ground=bed) | {"waves": {"wave_height": 0.08, "period": 1.5}}
    data["tank"]["max"] = [3.0, 0.2]
    layout, _ = laid(data)
    piston, walls = layout.boundary[layout.owner == PISTON], layout.boundary[layout.owner == WALL]
    assert piston[:, 1].min() > -0.453
    under = walls[(walls[:, 1] < -0.453) & (walls[:, 1] > -0.453 - SPACING)]
    assert under[:, 0].min() < layout.domain_min[0] + 2 * SPACING
    assert gaps(layout.boundary).min() > 0.5 * SPACING


@pytest.mark.parametrize("name", ["wide_top+0.5", "cliff", "pile_in_bed"])
def test_water_starts_still(name, tmp_path):
    """A slab under a tank once made 1.8 m/s within two steps, 0.8 of sqrt(g H)."""
    found = measure(name, tmp_path, until=0.2)
    assert found["largest_speed"] < 0.15 and found["leaks"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SETUPS)
def test_water_stays_still(name, tmp_path):
    found = measure(name, tmp_path)
    assert {key: value for key, value in found.items() if not value <= TARGET[key]} == {}
