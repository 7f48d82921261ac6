"""What a section that heaves is resisted by besides its waves: with sharp edges and with a round bottom, in two dimensions.

A box of half width R and draft 2 R, or one whose bottom is half a circle, is moved up and down in water 6 R deep. Linear
theory (`panels.Section`) has the added mass Ma and the damping B of the waves; `resistance` is what the water holds back
besides, over omega Ma. A section with a round bottom has none in a fluid without viscosity. Sharp edges shed vortices, whose
resistance is quadratic: a share of omega Ma in proportion to the amplitude, so that one of R / 50 hardly has any.

`viscous` says how much of the energy ends in artificial viscosity, booked step by step: the work of its forces in the last
periods as that of a damper. That is no cause: what edges shed ends there too (docs/theory/numerics.md). The force is read as
`forced_heave.Load` does.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.coupling import models
from cases.validation.coupling.forced_heave import harmonic
from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.theory.panels import Section
from fsi.owners import FIRST_BODY

RHO, G = 1000.0, 9.81
RADIUS, DRAFT, DEPTH, TOP = 0.2, 0.4, 1.2, 0.4  # half width, draft, depth of the water and height over it [m]
OMEGA, PERIODS, READ = 6.0, 4.5, 3  # 1/s; the first period is a ramp, the last ones are read
HALF, BEACH = 2.4, 1.2  # half length of the tank and where its damping starts [m]
STIFFNESS = 2 * RHO * G * RADIUS


class Resistance(Measure):
    """Heave, force and the work of artificial viscosity of each step."""

    def __init__(self, sim, section: Section):
        self.section, self.rows, self._work = section, [], 0.0
        super().__init__(sim)

    def begin(self, sim) -> None:
        """Have the predictor's work booked beside what it does."""
        fluid, predict, mass = sim.fluid, sim.fluid.predict, float(sim.fluid.k.mass)

        def booked() -> None:
            before = fluid.velocity.copy()
            predict()
            push = fluid.velocity - before - fluid.dt * fluid.force.uniform
            self._work = 0.5 * mass * float(((before + fluid.velocity) * push).sum())

        fluid.predict = booked

    def sample(self, sim) -> None:
        joints = sim.bodies.joints()
        half = 0.5 * sim.dt * joints["joint_velocity"][0]  # from the middle of the step to its end
        force = sim.balance.wrench[FIRST_BODY, 2] - STIFFNESS * half
        self.rows.append((sim.time - 0.5 * sim.dt, joints["joint_position"][0] - half, force, self._work))

    def errors(self) -> dict[str, float]:
        mass, waves = self.section.coefficients(OMEGA, "heave")
        span = READ * 2 * math.pi / OMEGA
        t, z, force, work = np.array(self.rows).T
        last = t > t[-1] - span
        heave = harmonic(t[last], z[last], OMEGA)
        found = harmonic(t[last], force[last], OMEGA) / heave + STIFFNESS
        viscous = -2 * work[last].sum() / (span * (OMEGA * abs(heave)) ** 2)
        return {
            "added_mass": found.real / OMEGA**2 / mass - 1,
            "resistance": (found.imag / OMEGA - waves) / (OMEGA * mass),
            "viscous": viscous / (OMEGA * mass),
        }


def hull(section: Section) -> tuple[str, str]:
    """MJCF of the section as a body on a heave joint, and of its mesh."""
    height, half = DRAFT + TOP, 0.5 * section.width
    corner = [(x, z) for x, z in section.contour(0.005)] + [(half, TOP)]
    points = [(side * x, y, z) for x, z in corner for side in (-1, 1) for y in (-0.5, 0.5)]
    vertices = " ".join(f"{value:.9g}" for point in points for value in point)
    size = (half, 0.5, 0.5 * height)
    box = models.body("hull", (0, 0, 0), models.HEAVE, "box", size, RHO * DRAFT / height)
    plain = f'type="box" size="{" ".join(f"{value:.9g}" for value in size)}"'
    asset = f'<asset><mesh name="hull" vertex="{vertices}"/></asset>'
    return box.replace(plain, 'type="mesh" mesh="hull"'), asset


def scene(section: Section, amplitude: float, **numerics):
    """The `scene` of a case: the section heaves by this amplitude [m]."""

    def build(spacing: float, folder) -> dict:
        body, asset = hull(section)
        period = 2 * math.pi / OMEGA
        motion = {"amplitude": amplitude, "omega": OMEGA, "ramp": period}
        return {
            "duration": PERIODS * period,
            "tank": {"min": [-HALF, -DEPTH], "max": [HALF, TOP]},
            "damping": [{"start": side * BEACH, "end": side * HALF, "rate": 10.0} for side in (-1, 1)],
            "bodies": models.write(folder, [body], assets=asset),
            "coupler": {"scheme": "prescribed", "motion": {"hull": motion}},
            "numerics": {"standing_pressure": "apart"} | numerics,
        }

    return build


SECTIONS = {
    "sharp": Section(2 * RADIUS, DRAFT, DEPTH),
    "round": Section(2 * RADIUS, DRAFT, DEPTH, RADIUS * (1 - 1e-9)),
}
AMPLITUDE = {"sharp": RADIUS / 50, "round": RADIUS / 10}  # so that the sharp edges shed next to nothing
REASONS = {
    "sharp": "It does not vanish with the amplitude: short divergence at sharp edges, of which a step's pressure takes away a"
    " hundredth, pushes on the body for hundreds of steps (impulse_start_sharp). That is 6 %, and 3 % at half the spacing;"
    " artificial viscosity is another 7 %.",
    "round": "Artificial viscosity: without it 0.7 %.",
}


def _case(shape: str) -> Case:
    section, part = SECTIONS[shape], round(RADIUS / AMPLITUDE[shape])
    bottom = "sharp edges" if shape == "sharp" else "a round bottom"
    return Case(
        f"heave_resistance_{shape}",
        f"A section with {bottom} is moved up and down by 1/{part} of its half width, 2D",
        "Linear theory: boundary elements. The half width is 5, 10 and 20 spacings.",
        {"coarse": RADIUS / 5, "medium": RADIUS / 10, "paper": RADIUS / 20},
        scene(section, AMPLITUDE[shape]),
        lambda sim: Resistance(sim, section),
        {"added_mass": 0.05, "resistance": 0.03},
        REASONS[shape],
        fails_when={
            "resistance": Wrong("a resistance of a tenth of the inertial force", 0.1),
        },
    )


NAMES = ("heave_resistance_sharp", "heave_resistance_round")
CASES = {case.name: case for case in map(_case, SECTIONS)}
