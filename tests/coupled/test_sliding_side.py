"""A side that moves along itself does not move the water: only what a body does along its normals acts on the pressure."""

import math

import numpy as np
import pytest

from cases.validation.coupling import models
from cases.validation.coupling.forced_heave import harmonic
from fsi.owners import FIRST_BODY
from fsi.scene.binding import bind
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

RADIUS, DRAFT, DEPTH, HALF = 0.2, 0.8, 2.0, 3.0  # m
OMEGA, HEAVE = 7.0, 0.03  # 1/s, m
PERIOD = 2 * math.pi / OMEGA
THEORY = 92.4  # kg/m, added mass by `cases.validation.theory.panels.Section(0.4, 0.8, 2.0, 0.2)`


def simulation(tmp_path, text, motion, spacing, duration, depth=DEPTH, half=HALF):
    bodies = models.write(tmp_path, [text])
    data = {
        "name": "side",
        "spacing": spacing,
        "duration": duration,
        "tank": {"min": [-half, -depth], "max": [half, 0.8]},
        "damping": [{"start": 0.7 * side * half, "end": side * half, "rate": 10.0} for side in (-1, 1)],
        "bodies": bodies,
        "coupler": {"scheme": "prescribed", "motion": {"body": motion}},
    }
    scene = Scene.model_validate(data, context={"folder": tmp_path})
    parts = bind(scene, "side")
    return Simulation(scene, bodies=parts[0], coupler=parts[1], ground=parts[2], threads=1)


def test_force_on_a_round_bottom_in_heave_is_that_of_linear_theory(tmp_path):
    """Three spacings to the radius. With an acceleration of the sides that the water felt, the added mass was 8 % too large
    and the resistance 0.12 of it, where theory has 0.001."""
    text = models.body("body", (0, 0, 0.4 + RADIUS - DRAFT), models.HEAVE, "capsule", (RADIUS, 0.4), 500)
    motion = {"amplitude": HEAVE, "omega": OMEGA, "ramp": PERIOD}
    sim = simulation(tmp_path, text, motion, RADIUS / 3, 2.5 * PERIOD)
    rows = []

    def watch(sim):
        joints = sim.bodies.joints()
        middle = joints["joint_position"][0] - 0.5 * sim.dt * joints["joint_velocity"][0]
        rows.append((sim.time - 0.5 * sim.dt, middle, models.force(sim)[0, 2]))

    sim.run(on_step=watch)
    t, z, force = np.array(rows)[np.array(rows)[:, 0] > sim.time - PERIOD].T
    found = harmonic(t, force, OMEGA) / harmonic(t, z, OMEGA)
    mass = (found.real + 9810.0 * 2 * RADIUS) / OMEGA**2
    assert mass == pytest.approx(THEORY, rel=0.05)
    assert abs(found.imag / OMEGA) < 0.08 * OMEGA * THEORY


def test_a_plate_that_is_accelerated_along_itself_leaves_the_pressure_of_its_sides_alone(tmp_path):
    """A tilted box, thick and long, half out of the water; it has turned since the start."""
    tilt, turn, dr = 0.3, 0.2, 0.05
    text = models.body("body", (0, 0, -0.1), models.PITCH, "box", (0.2, 0.5, 0.6), 500)
    text = text.replace("<body ", f'<body euler="0 {math.degrees(tilt):.9g} 0" ')
    motion = {"amplitude": turn, "omega": 0.5 * math.pi / 0.4, "ramp": 0.2}
    sim = simulation(tmp_path, text, motion, dr, 0.4, depth=1.0, half=1.2)
    sim.run()
    motion = sim.bodies.motion()
    shore, axis = sim.fluid.solids, motion.rotation[0][:, 2]
    units = np.zeros((1, sim.fluid.owners, 6))
    units[0, FIRST_BODY, :3] = axis
    lift = shore.lift_of(units)[:, 0] / np.maximum(shore.shepard[:, 0], 1e-9)[: shore.count]
    own = (shore.owner[: shore.count] == FIRST_BODY) & (shore.shepard[: shore.count, 0] > 0)
    local = (shore.position[: shore.count] - motion.position[0][[0, 2]]) @ motion.rotation[0][[0, 2]][:, [0, 2]]
    side = own & (np.abs(local[:, 0]) > 0.1) & (local[:, 1] > -0.3)
    bottom = own & (np.abs(local[:, 0]) < 0.05) & (local[:, 1] < -0.4)
    assert side.sum() > 20 and bottom.sum() > 5
    assert np.abs(lift[side]).max() < 1e-3 * 1000 * dr
    assert np.abs(lift[bottom]).max() > 1000 * dr
