"""Pressure at the start over several blocks and liquids, under overhangs and in chambers: exact answers."""

import numpy as np
import pytest

from fsi.particles.layout import build
from fsi.scene.model import Scene

G, RHO, DR = 9.81, 1000.0, 0.02


class Boxes:
    """Fixed boxes, each (low, high) in (x, z)."""

    def __init__(self, *boxes):
        self.boxes = [(np.array(low), np.array(high)) for low, high in boxes]

    def boundary(self, spacing, layers):
        return np.empty((0, 2))

    def clearance(self, points):
        found = []
        for low, high in self.boxes:
            beyond = np.maximum(low - points, points - high)
            found.append(np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(1), 0))
        return np.min(found, axis=0)


def started(blocks=(), liquids=None, ground=None, length=0.6, level=0.6):
    scene = Scene.model_validate(
        {
            "spacing": DR,
            "duration": 1.0,
            "tank": {"min": [0.0, 0.0], "max": [length, 0.8]},
            "fluid": {"still_water_level": level, "blocks": [{"min": a, "max": b} for a, b in blocks]},
            "liquids": {
                name: {"density": density, "blocks": [{"min": a, "max": b} for a, b in parts]}
                for name, (density, parts) in (liquids or {}).items()
            },
        }
    )
    layout = build(scene, ground=ground)
    return layout.position, layout.pressure


def test_stacked_blocks_are_one_column():
    """Two blocks once began with 1,962 Pa where 4,905 Pa are right."""
    one = started([([0, 0], [0.6, 0.6])])
    two = started([([0, 0], [0.6, 0.3]), ([0, 0.3], [0.6, 0.6])])
    side = started([([0, 0], [0.3, 0.6]), ([0.3, 0], [0.6, 0.6])])
    for position, pressure in (two, side):
        np.testing.assert_allclose(pressure, RHO * G * (0.6 - position[:, 1]), rtol=1e-12)
        assert sorted(pressure) == pytest.approx(sorted(one[1]), rel=1e-12)


def test_blocks_of_different_height_and_pools_keep_their_own_tops():
    position, pressure = started([([0, 0], [0.2, 0.5]), ([0.2, 0], [0.4, 0.1]), ([0.5, 0], [0.6, 0.3])])
    top = np.where(position[:, 0] < 0.2, 0.5, np.where(position[:, 0] < 0.4, 0.1, 0.3))
    np.testing.assert_allclose(pressure, RHO * G * (top - position[:, 1]), rtol=1e-12)


def test_a_drop_in_the_air_does_not_weigh_on_the_pool_below():
    position, pressure = started([([0, 0], [0.6, 0.2])], {"oil": (800.0, [([0.2, 0.5], [0.4, 0.6])])})
    pool = position[:, 1] < 0.2
    np.testing.assert_allclose(pressure[pool], RHO * G * (0.2 - position[pool, 1]), rtol=1e-9)
    np.testing.assert_allclose(pressure[~pool], 800 * G * (0.6 - position[~pool, 1]), rtol=1e-9)


def test_an_overhang_and_a_chamber_have_the_level_of_the_water_beside_them():
    """A shelf with water under and over it, and a chamber that is open below: one level for all."""
    ground = Boxes(((0.3, 0.3), (0.6, 0.36)), ((0.1, 0.2), (0.14, 0.8)))
    for blocks in ((), [([0, 0], [0.6, 0.24]), ([0, 0.24], [0.6, 0.6])]):
        position, pressure = started(blocks, ground=ground)
        np.testing.assert_allclose(pressure, RHO * G * (0.6 - position[:, 1]), rtol=1e-12)


def test_a_low_block_under_a_roof_is_pressed_by_the_tall_one_beside_it():
    """A duct filled by a block of its own up to its roof, and a tower of water at its end."""
    ground = Boxes(((0.2, 0.2), (0.6, 0.8)))
    blocks = [([0, 0], [0.2, 0.6]), ([0.2, 0], [0.6, 0.3])]
    position, pressure = started(blocks, ground=ground)
    np.testing.assert_allclose(pressure, RHO * G * (0.6 - position[:, 1]), rtol=1e-12)


def test_sealed_water_starts_from_its_own_top():
    ground = Boxes(((0.2, 0.2), (0.6, 0.3)), ((0.18, 0.0), (0.22, 0.3)))
    position, pressure = started(ground=ground)
    sealed = (position[:, 0] > 0.22) & (position[:, 1] < 0.2)
    np.testing.assert_allclose(pressure[~sealed], RHO * G * (0.6 - position[~sealed, 1]), rtol=1e-12)
    np.testing.assert_allclose(pressure[sealed], RHO * G * (0.2 - position[sealed, 1]), rtol=1e-9)


def test_a_thin_plate_divides_two_pools():
    """Thinner than a spacing, between two columns of particles: no water passes."""
    ground = Boxes(((0.297, 0.0), (0.303, 0.8)), ((0.3, 0.2), (0.6, 0.3)))
    position, pressure = started(ground=ground)
    sealed = (position[:, 0] > 0.3) & (position[:, 1] < 0.2)
    np.testing.assert_allclose(pressure[sealed], RHO * G * (0.2 - position[sealed, 1]), rtol=1e-9)


def test_liquids_in_a_u_tube():
    """Three columns over one heavy liquid in a duct, in balance: its pressure is the same from every column."""
    ground = Boxes(((0.1, 0.1), (0.2, 0.8)), ((0.4, 0.1), (0.5, 0.8)))
    heavy = [([0, 0], [0.6, 0.2])]
    liquids = {
        "brine": (2000.0, heavy),
        "oil": (500.0, [([0.2, 0.2], [0.4, 0.6])]),
        "alcohol": (800.0, [([0.5, 0.2], [0.6, 0.44])]),
    }
    position, pressure = started([([0, 0.2], [0.1, 0.4])], liquids, ground)
    x, z = position.T
    load = np.where(x < 0.1, RHO * (0.4 - z), np.where(x < 0.45, 500 * (0.6 - z), 800 * (0.44 - z)))
    brine = 2000 * (0.2 - z) + np.where(x < 0.1, 200.0, np.where(x < 0.45, 200.0, 192.0))
    exact = G * np.where(z > 0.2, load, brine)
    open_columns = (x < 0.1) | ((x > 0.2) & (x < 0.4)) | (x > 0.5)
    np.testing.assert_allclose(pressure[open_columns], exact[open_columns], rtol=1e-9)
    duct = (x > 0.1) & (x < 0.2)
    np.testing.assert_allclose(pressure[duct], G * (2000 * (0.2 - z[duct]) + 200.0), rtol=1e-9)


def test_blocks_off_the_lattice_keep_their_exact_load():
    position, pressure = started([([0, 0], [0.6, 0.413])], {"oil": (800.0, [([0, 0.413], [0.6, 0.55])])})
    low = position[:, 1] < 0.413
    exact = np.where(low, RHO * (0.413 - position[:, 1]) + 800 * 0.137, 800 * (0.55 - position[:, 1]))
    np.testing.assert_allclose(pressure, G * exact, rtol=1e-9)
