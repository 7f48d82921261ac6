"""Boundary particles of large surfaces: those of small ones, where the lattice of known distances would not fit."""

import numpy as np
import pytest
import trimesh

from bodies.shapes import band
from bodies.shapes.meshes import mesh


@pytest.mark.parametrize("most", [band.MOST, 1])
def test_a_surface_too_large_for_the_lattice_is_sampled_from_exact_distances(most, monkeypatch):
    monkeypatch.setattr(band, "MOST", most)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    points = mesh(np.array(ball.vertices), np.array(ball.faces)).sample(0.1, 2)
    depth = 1.0 - np.linalg.norm(points, axis=1)
    layers = 4 / 3 * np.pi * (1 - 0.8**3) / 0.1**3
    assert len(points) == pytest.approx(layers, rel=0.05) and depth == pytest.approx(0.1, abs=0.08)
