"""Instruments in a fluid whose surface and pressure are known."""

import numpy as np
import pytest

from fsi.fluid.gauges import elevation, pressure_at

DR = 0.05


def pool(dim):
    axes = [(np.arange(20) + 0.5) * DR] * (dim - 1) + [-(np.arange(12) + 0.5) * DR]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("x", [0.5, 0.512])
def test_elevation_is_half_a_spacing_above_the_top_layer(dim, x):
    assert elevation(pool(dim), np.full(dim - 1, x), DR, 1.5 * DR) == pytest.approx(0.0, abs=0.05 * DR)


def test_elevation_ignores_spray_and_follows_a_slope():
    points = pool(2)
    points[:, 1] += 0.1 * (points[:, 0] - 0.5)
    points = np.vstack([points, [[0.5, 0.4]]])
    assert elevation(points, np.array([0.5]), DR, 1.5 * DR) == pytest.approx(0.0, abs=0.06 * DR)
    assert np.isnan(elevation(points, np.array([5.0]), DR, 1.5 * DR))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_probe_reads_hydrostatic_pressure_even_on_the_wall(dim):
    points = pool(dim)
    pressure = -9810 * points[:, -1]
    for place in ([0.5, 0.5, -0.3], [0.0, 0.5, -0.2]):
        point = np.array(place if dim == 3 else [place[0], place[2]])
        assert pressure_at(points, pressure, point, 1.5 * DR, 9810.0) == pytest.approx(-9810 * place[2], rel=1e-6)
    assert pressure_at(points, pressure, np.full(dim, 9.0), 1.5 * DR, 9810.0) == 0.0
