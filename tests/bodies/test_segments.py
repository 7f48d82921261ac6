"""Distance to polygons, against every segment in turn."""

import numpy as np
import pytest

from bodies.shapes.distance import nearest_segment


@pytest.mark.parametrize("count", [3, 40, 700])
def test_distance_and_side_are_those_of_every_segment(count):
    rng = np.random.default_rng(count)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = 1 + 0.3 * np.sin(5 * angle) + 0.05 * rng.normal(size=count) / count
    start = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    end = np.roll(start, -1, axis=0)
    points = np.vstack([rng.uniform(-2, 2, (300, 2)), start[:20]])
    along = end - start
    share = np.clip(((points[:, None] - start) * along).sum(2) / (along**2).sum(1), 0, 1)
    gap = np.linalg.norm(points[:, None] - start - share[..., None] * along, axis=2)
    x, z = points[:, 0, None], points[:, 1, None]
    crosses = (start[:, 1] > z) != (end[:, 1] > z)
    with np.errstate(divide="ignore", invalid="ignore"):
        right = x < start[:, 0] + (z - start[:, 1]) / along[:, 1] * along[:, 0]
    inside = (crosses & right).sum(1) % 2 == 1
    expected = np.where(inside, -1, 1) * gap.min(axis=1)
    for order in (np.arange(count), rng.permutation(count)):
        distance, closest = nearest_segment(points, start[order], end[order])
        np.testing.assert_allclose(distance[:300], expected[:300], rtol=1e-12)
        np.testing.assert_allclose(np.abs(distance), gap.min(axis=1), atol=1e-14)
        np.testing.assert_allclose(np.linalg.norm(points - closest, axis=1), gap.min(axis=1), atol=1e-14)
