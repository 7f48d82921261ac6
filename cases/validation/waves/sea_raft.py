"""A half immersed cylinder that heaves in a sea box, two dimensions: amplitude of its heave over that of the waves.

Linear theory: added mass and damping by boundary elements (`theory.panels`), the exciting force from the damping by Haskind's
relation, |X|^2 = 2 rho g c_g B of a section that is symmetric (Newman 1977, sec. 6.18). Waves of 0.9 s are near its
resonance. Steepness H/L 0.03; the box is two wave lengths long, with zones of half of one.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.coupling import models
from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.theory.panels import Section
from cases.validation.theory.separation import first_harmonic, group_speed
from cases.validation.waves.wavemaker import SEA
from fsi.scene.geometry import incident_waves
from fsi.waves.linear import wavenumber

G, RADIUS, DEPTH, STEEPNESS = 9.81, 0.15, 0.9, 0.03
PERIODS, RECORD = 16, 4  # of the run, and at its end of the record


class Waves:
    """Waves of this period [s], and the cylinder's answer to them."""

    def __init__(self, period: float):
        self.period, self.omega = period, 2 * math.pi / period
        self.k = wavenumber(self.omega, DEPTH, G)
        self.length = 2 * math.pi / self.k
        self.height = STEEPNESS * self.length

    def response(self) -> complex:
        """Heave over the waves' elevation, but for the phase of the exciting force."""
        section = Section(2 * RADIUS, RADIUS, DEPTH, bilge=RADIUS)
        added, damping = section.coefficients(self.omega, "heave")
        exciting = math.sqrt(2 * 1e3 * G * group_speed(self.k, DEPTH, G) * damping)
        moved = 1e3 * section.area() + added
        return exciting / (section.stiffness("heave") - self.omega**2 * moved - 1j * self.omega * damping)


class Heave(Measure):
    """Amplitude of the heave over that of the waves at the cylinder, in the last periods."""

    def begin(self, sim) -> None:
        self.waves, self.incident = WAVES[sim.scene.name], incident_waves(sim.scene)
        self.interval = self.waves.period / 24
        self.time, self.rows = [], []

    def sample(self, sim) -> None:
        if sim.time > (PERIODS - RECORD) * self.waves.period:
            self.time.append(sim.time)
            height = float(sim.bodies.joints()["joint_position"][0])
            self.rows.append([height, self.incident.elevation(sim.time, np.zeros((1, 1)))[0]])

    def errors(self) -> dict[str, float]:
        heave, incident = first_harmonic(np.array(self.time), np.array(self.rows), self.waves.omega)
        return {"response": abs(heave / incident) / abs(self.waves.response()) - 1}


def scene(name: str):
    def build(spacing: float, folder) -> dict:
        waves = WAVES[name]
        half = round(waves.length / spacing) * spacing
        body = models.body("cylinder", (0, 0, 0), models.HEAVE, "cylinder", (RADIUS, 0.5), 500.0, along_y=True)
        return {
            "duration": PERIODS * waves.period,
            "tank": {"min": [-half, -DEPTH], "max": [half, 0.3]},
            "sea": {"waves": {"wave_height": waves.height, "period": waves.period}},
            "bodies": models.write(folder, [body], G),
            "numerics": SEA,
        }

    return build


WAVES = {"sea_raft_0.9": Waves(0.9), "sea_raft_1.1": Waves(1.1)}
TARGET = {"sea_raft_0.9": 0.06, "sea_raft_1.1": 0.03}
SPACING = {level: RADIUS / n for level, n in (("coarse", 5), ("medium", 10), ("paper", 20))}
NAMES = ("sea_raft_0.9", "sea_raft_1.1")
CASES = {
    name: Case(
        name, f"A half immersed cylinder heaves in waves of {waves.period:g} s, in a box with a sea around it, 2D",
        "Linear theory by boundary elements.", SPACING, scene(name), Heave, {"response": TARGET[name]},
        "It heaves too little by an error that halves with the spacing.",
        fails_when={"response": Wrong("no radiation damping at resonance, or a tenth of the mass too much", 0.1)},
    )
    for name, waves in WAVES.items()
}  # fmt: skip
