"""A keyframe named "start" poses the bodies."""

import numpy as np

from bodies import load
from fsi.scene.file import load_scene


def test_the_wedge_starts_with_the_speed_of_its_keyframe():
    bodies = load(load_scene("wedge_entry"))
    np.testing.assert_allclose(bodies.motion().velocity[0], [0, 0, -6.15, 0, 0, 0])
    np.testing.assert_allclose(bodies.mass, 241.0)
