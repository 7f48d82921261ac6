"""A body in a liquid so viscous that the drag of one explicit step would throw it back."""

import numpy as np

from fsi.scene.binding import bind
from fsi.scene.file import load_scene
from fsi.simulation.loop import Simulation


def test_a_box_sinks_slowly_into_tar():
    """1e3 Pa s in implicit steps: it comes down without turning round, to where it floats in water or above."""
    scene = load_scene("floating_box_2d", ["fluid.kinematic_viscosity=1.0", "spacing=0.04"])
    bodies, coupler, ground = bind(scene, "test")
    sim = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=1)
    height = []
    sim.run(0.5, lambda sim: height.append(bodies.motion().position[0, 2]))
    assert sim.fluid.rheology.implicit
    assert height[-1] < height[0] - 1e-3 and height[-1] > -0.05
    assert max(np.diff(height)) < 1e-4
