"""Conditions of the bodies in words, from MuJoCo's own constraints."""

import numpy as np

HINGED = """<geom name="bed" type="box" pos="0 0 -1" size="2 2 0.1"/>
<body name="arm" pos="0 0 -0.5"><joint name="hinge" type="hinge" axis="0 1 0" range="-0.2 0.3"/>
<geom name="plate" type="box" pos="0 0 0.2" size="0.1 0.1 0.2"/></body>
<body name="weight" pos="0 0 -0.79"><freejoint/><geom name="ball" type="sphere" size="0.1"/></body>"""
HEAD = '<compiler angle="radian"/><custom><tuple name="wet"><element objtype="geom" objname="plate"/></tuple></custom>'


def test_limits_and_contacts_have_names(make_bodies):
    bodies = make_bodies(HINGED, head=HEAD)
    assert bodies.conditions() == []
    bodies.place({"hinge": 0.31}, {})
    assert bodies.conditions() == ["joint 'hinge' at its upper limit, 0.3 rad"]
    bodies.place({"hinge": -0.21}, {})
    assert bodies.conditions() == ["joint 'hinge' at its lower limit, -0.2 rad"]
    bodies.place({"hinge": 0.0}, {})
    nothing = np.zeros((1, 6)), np.zeros((bodies.model.nv,) * 2), np.zeros(bodies.model.nv)
    while not (found := bodies.conditions()):
        bodies.advance(0.01, *nothing)
    assert found == ["contact of 'ball' and 'bed'"]


def test_dry_bodies_have_poses_and_meshes(make_bodies):
    bodies = make_bodies(HINGED, head=HEAD)
    assert (bodies.names, bodies.dry_names) == (("arm",), ("weight",))
    position, rotation = bodies.dry_poses()
    np.testing.assert_allclose(position, [[0, 0, -0.79]], atol=1e-5)  # the contact gives a little
    np.testing.assert_allclose(rotation, [np.eye(3)])
    assert {(v.name, v.body) for v in bodies.visuals()} == {("bed", ""), ("plate", "arm"), ("ball", "weight")}
