"""The bed of a grid of heights in pictures."""

import numpy as np
import pytest

from cases.report.terrain import bed
from fsi.scene.model import Scene


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_bed_is_drawn_at_its_heights(dimension, tmp_path):
    """A bed that rises by 1 in 10."""
    x, y = np.meshgrid(np.arange(-0.5, 3.0, 0.1), np.arange(-1.0, 1.1, 0.1))
    np.savetxt(tmp_path / "bed.xyz", np.column_stack([x.ravel(), y.ravel(), -0.5 + 0.1 * x.ravel()]))
    low, high = ((0.0, -0.6), (2.0, 0.4)) if dimension == 2 else ((0.0, -0.5, -0.6), (2.0, 0.5, 0.4))
    tank = {"min": low, "max": high, "bathymetry": tmp_path / "bed.xyz"}
    scene = Scene(dimension=dimension, spacing=0.1, duration=1.0, tank=tank)
    points, cells = bed(scene)
    assert points[:, 2] == pytest.approx(-0.5 + 0.1 * points[:, 0], abs=1e-4)
    assert len(points) == (21 if dimension == 2 else 21 * 11)
    assert cells.shape == ((20, 2) if dimension == 2 else (2 * 20 * 10, 3))
    assert bed(Scene(spacing=0.1, duration=1.0, tank={"min": low, "max": high}, dimension=dimension)) is None
