"""The theory that the coupling is compared with, and the cases that are cheap enough to run here."""

import math

import mujoco
import numpy as np
import pytest

from cases.validation.coupling import added_mass, archimedes, decay, forced_heave, stability
from cases.validation.engine.case import met
from cases.validation.engine.registry import choose, load
from cases.validation.engine.runner import run_case
from cases.validation.theory.panels import Section, release


def test_the_group_runs_all_cases_of_the_coupling():
    names = {case.name for case in choose(["coupling"])}
    assert {"archimedes_box", "decay_sphere", "added_mass_annulus", "forced_heave_4", "stability_raft"} <= names
    assert "still_water" not in names


def test_a_body_let_go_follows_its_equation_of_motion():
    """Added mass and damping that do not depend on the frequency leave an ordinary differential equation."""
    inertia, mass, damping, stiffness = 1.0, 0.5, 0.3, 6.0
    t = np.linspace(0, 5, 101)
    x = release(t, inertia, stiffness, lambda omega: (mass, damping), top=40.0)
    rate = damping / (2 * (inertia + mass))
    omega = math.sqrt(stiffness / (inertia + mass) - rate**2)
    exact = np.exp(-rate * t) * (np.cos(omega * t) + rate / omega * np.sin(omega * t))
    np.testing.assert_allclose(x, exact, atol=5e-3)


@pytest.mark.parametrize("nu, mass, damping", [(0.5, 0.90, 0.40), (0.75, 0.81, 0.26), (1.0, 0.93, 0.10)])
def test_panels_give_the_known_coefficients_of_a_heaving_section(nu, mass, damping):
    """Width twice the draft in deep water, as computed and measured by Vugts (1968), read from his curves."""
    width, draft = 0.4, 0.2
    root = math.sqrt(width / (2 * 9.81))
    found = Section(width, draft, 4.0).coefficients(nu / root, "heave")
    assert found[0] / (1000 * width * draft) == pytest.approx(mass, abs=0.04)
    assert found[1] * root / (1000 * width * draft) == pytest.approx(damping, abs=0.04)


def test_panels_converge_and_take_energy_out():
    section = Section(0.8, 0.1, 0.6)
    for mode in ("heave", "pitch"):
        for omega in (3.0, 6.0, 9.0):
            assert all(value > 0 for value in section.coefficients(omega, mode))
    assert section.stiffness("pitch") == pytest.approx(9810 * (0.8**3 / 12 - 0.8 * 0.1 * 0.05))


def test_a_half_circle_that_turns_about_its_centre_moves_no_water():
    """Its bilges are all of it; nor does the water right it."""
    section, box = Section(0.2, 0.1, 0.6, bilge=0.0999), Section(0.2, 0.1, 0.6)
    assert section.area() == pytest.approx(0.5 * math.pi * 0.1**2, rel=1e-3)
    assert abs(section.stiffness("pitch")) < 1e-3 * abs(box.stiffness("pitch")) + 0.01
    for found, sharp in zip(section.coefficients(6.0, "pitch"), box.coefficients(6.0, "pitch"), strict=True):
        assert abs(found) < 1e-4 * sharp


def test_the_rounded_box_is_the_body_of_its_file(tmp_path):
    for mode, mass in (("pitch", 80.0), ("roll", 1000 * Section(0.8, 0.1, 0.6, 0.08).area())):
        model = mujoco.MjModel.from_xml_path(decay.box_scene(mode)(0.02, tmp_path)["bodies"]["set"]["mjcf"])
        assert model.body_mass[1] == pytest.approx(mass, rel=1e-3)
        inertia = np.zeros((1, 1))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, inertia)
        assert inertia[0, 0] == pytest.approx(decay.BOXES[mode].inertia, rel=1e-3)


def test_hulmes_coefficients_belong_together():
    """Added mass follows from damping (Kramers & Kronig): A(w) - A(inf) = 2/pi int (B(s) - B(w)) / (s^2 - w^2) ds."""
    ka, mass, damping = decay.HULME.T
    omega = np.linspace(1e-3, math.sqrt(10.0), 20001)
    b = omega * np.interp(omega**2, ka, damping)
    for value in (0.4, 1.0, 2.0):
        w = math.sqrt(value)
        at = w * np.interp(value, ka, damping)
        kernel = np.divide(b - at, omega**2 - w**2, out=np.zeros_like(b), where=np.abs(omega - w) > 1e-4)
        beyond = -at / (2 * w) * math.log((omega[-1] + w) / (omega[-1] - w))
        found = 0.5 + 2 / math.pi * (np.trapezoid(kernel, omega) + beyond)
        assert found == pytest.approx(np.interp(value, ka, mass), abs=0.02)


def test_added_masses_without_a_far_wall():
    assert added_mass.annulus_mass(0.1, 1e4) == pytest.approx(1000 * math.pi * 0.01)
    assert added_mass.shell_mass(0.1, 1e4) == pytest.approx(0.5 * 1000 * 4 / 3 * math.pi * 1e-3)


def test_drafts():
    for dimension in (2, 3):
        assert archimedes.draft("box", dimension, 0.25) == 0.25 * archimedes.HIGH
        assert archimedes.draft("ball", dimension, 0.5) == pytest.approx(archimedes.RADIUS)
    area = archimedes.displaced("ball", 2, archimedes.draft("ball", 2, 0.1))
    assert area == pytest.approx(0.1 * math.pi * archimedes.RADIUS**2)
    volume = archimedes.displaced("ball", 3, archimedes.draft("ball", 3, 0.1))
    assert volume == pytest.approx(0.1 * 4 / 3 * math.pi * archimedes.RADIUS**3)


def test_phase_and_amplitude_of_a_harmonic():
    t = np.linspace(0, 2, 301)
    y = 3 * np.cos(4 * t - 0.2) + 1 + 0.1 * np.cos(8 * t)
    found = forced_heave.harmonic(t, y, 4.0)
    assert abs(found) == pytest.approx(3) and np.angle(found) == pytest.approx(0.2)
    assert abs(forced_heave.theory(4.0)) == pytest.approx(989, rel=0.01)


@pytest.mark.parametrize("arrangement", stability.ARRANGEMENTS)
def test_the_default_scheme_holds_the_lightest_bodies(arrangement):
    """The worst case of each arrangement; without the added mass it does not last."""
    fastest, updates, inertia = stability.run(arrangement, 0.02, 0.04)
    assert fastest < stability.LIMIT and updates == 1 and inertia > 5
    assert stability.run(arrangement, 0.02, 0.04, "lagged")[0] == math.inf
    assert stability.run(arrangement, 0.02, 0.04, "fixed_point")[0] < stability.LIMIT


@pytest.mark.parametrize("arrangement", ["box", "raft"])
@pytest.mark.parametrize("ratio", [1e-4, 1e-3, 0.005])
def test_the_default_scheme_holds_bodies_lighter_than_air(arrangement, ratio):
    """The box was thrown by the wall guard, which hands on the momentum of particles heavier than it is, and shaken apart by
    the water's answer to its velocity."""
    fastest, _, inertia = stability.run(arrangement, ratio, 0.04)
    assert fastest < 0.5 * stability.LIMIT and inertia > 50


def test_added_mass_in_an_annulus():
    row, reason = run_case(load("added_mass_annulus"), "medium", "chebyshev6", threads=1)
    assert reason == "" and row.passed


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["added_mass_shaken", "archimedes_ball", "archimedes_box", "collision", "decay_heave_2d", "drops_box",
     "drops_wedge", "float_chain", "mooring", "pinned", "plate_slap", "slide_contact", "slide_glued",
     "stability_flap", "stiff_mechanisms", "zero_gravity"],
)  # fmt: skip
def test_cases_that_pass_coarse(name):
    row, reason = run_case(load(name), "coarse", "chebyshev6", threads=1)
    assert reason == "" and row.passed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "missed", "bound"), [("decay_roll_2d", "decay", 0.11), ("schemes_flap", "angle", 0.02)]
)
def test_cases_that_miss_one_target_coarse(name, missed, bound):
    row, reason = run_case(load(name), "coarse", "chebyshev6", threads=1)
    assert reason == "" and all(met(row.error[n], t) for n, t in (row.target | {missed: bound}).items())
