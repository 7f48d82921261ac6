"""Contact and friction are solved for body and fluid together, however heavy the fluid and however its motions couple."""

import numpy as np
import pytest

from couplers import AddedMass

FLOOR = '<geom name="floor" type="plane" size="5 5 1" friction="{mu} 0 0"/>'
BOX = """<body name="box" pos="0 0 0.21"><freejoint/>
  <geom name="box" type="box" size="0.3 0.25 0.2" density="500" friction="{mu} 0 0"/></body>"""


def dense(mass, ratio, skew):
    """Added mass (6, 6) that couples all motions, with an antisymmetric part of the share `skew`."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(6, 6))
    matrix = root @ root.T
    matrix *= ratio * mass / np.diag(matrix).mean()
    odd = rng.normal(size=(6, 6))
    return matrix + skew * ratio * mass * (odd - odd.T) / 2


@pytest.mark.usefixtures("without_reserve")
@pytest.mark.parametrize("mu", [0.0, 0.4])
@pytest.mark.parametrize("ratio, skew", [(0.1, 0.0), (1.0, 0.1), (20.0, 0.02), (1000.0, 0.0)])
def test_a_box_on_the_floor_obeys_the_equation_of_motion(make_bodies, linear_fluid, mu, ratio, skew):
    bodies = make_bodies((FLOOR + BOX).format(mu=mu), gravity=9.81)
    matrix = dense(bodies.mass[0], ratio, skew)
    fluid = linear_fluid(matrix, [40.0 * (1 + ratio), 0, 0, 0, 0, 0])
    coupler, data, dt, touched = AddedMass(bodies), bodies.data, 1e-3, 0
    for _ in range(400):
        motion, bias, inertia = bodies.motion(), data.qfrc_bias.copy(), bodies.inertia()
        coupler.step(fluid, bodies, 0.0, dt)
        jacobian, a = motion.jacobian[0], coupler.acceleration
        load = jacobian.T @ (fluid.base[0] - matrix @ (jacobian @ a + motion.bias[0])) - bias + data.qfrc_constraint
        scale = np.abs(load).max() + bodies.mass[0] * 9.81
        touched += bool(np.abs(data.qfrc_constraint).max() > 0)
        assert inertia @ a == pytest.approx(load, abs=1e-3 * scale)
    assert touched > 100 and bodies.unsettled == 0
    assert bodies.penetration()[1] < 0.01 and np.abs(data.qvel).max() < 20.0


def test_bodies_that_feel_each_other_settle_in_contact(make_bodies, linear_fluid):
    """Two boxes side by side on the floor, pushed together, whose added masses couple as strongly as they weigh."""
    left, right = (
        BOX.format(mu=0.3).replace('"box"', f'"{n}"').replace("0 0 0.21", f"{x} 0 0.2")
        for n, x in (("a", -0.301), ("b", 0.301))
    )
    left, right = (text.replace('type="a"', 'type="box"').replace('type="b"', 'type="box"') for text in (left, right))
    bodies = make_bodies(FLOOR.format(mu=0.3) + left + right, gravity=9.81)
    rng = np.random.default_rng(1)
    root = rng.normal(size=(12, 12))
    fluid = linear_fluid(root @ root.T * bodies.mass[0] / 12, [[200.0, 0, 0, 0, 0, 0], [-200.0, 0, 0, 0, 0, 0]])
    coupler = AddedMass(bodies)
    for _ in range(300):
        coupler.step(fluid, bodies, 0.0, 1e-3)
    assert bodies.unsettled <= 15 and np.abs(bodies.data.qvel).max() < 3.0 and bodies.penetration()[1] < 0.01
