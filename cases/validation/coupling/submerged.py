"""A body deep in a closed tank is moved to and fro, by less than a third of its radius: the water must not resist.

Without viscosity the flow is irrotational and the work per cycle zero, whatever the amplitude. The force of the last period
of two and a half is split by least squares (`forced_heave.harmonic`) into a part against the acceleration, omega^2 Ma times
the displacement, and one against the speed: `resistance` is the latter over omega Ma and the speed's amplitude. The tank is
ten radii wide and high (six for the sphere), full, under gravity, which sets the numerical speed of sound. The standing
pressure acts apart (`fsi.fluid.standing`), as it should be asked for where bodies radiate; `scene(..., standing_pressure =
"paired")` has the default.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.coupling import models
from cases.validation.coupling.forced_heave import harmonic
from cases.validation.engine.case import Case, Measure, Wrong

RADIUS, OMEGA, AMPLITUDE = 0.1, 6.0, 0.1  # m, 1/s, radii
PERIODS, RAMP = 2.5, 1.0
SHAPES = {  # MuJoCo's type, size [m] and whether the cylinder lies along y
    "cylinder": ("cylinder", (RADIUS, 0.5), True),
    "box": ("box", (RADIUS, 0.5, RADIUS), False),
    "plate": ("box", (RADIUS, 0.5, 0.1 * RADIUS), False),
    "sphere": ("sphere", (RADIUS,), False),
}


class Resistance(Measure):
    """Displacement and force of the last period."""

    def __init__(self, sim, omega: float):
        self.omega, self.rows = omega, []
        super().__init__(sim)

    def sample(self, sim) -> None:
        joints = sim.bodies.joints()
        middle = joints["joint_position"][0] - 0.5 * sim.dt * joints["joint_velocity"][0]  # of the step
        self.rows.append((sim.time - 0.5 * sim.dt, middle, models.force(sim)[0, 2]))

    def parts(self) -> tuple[float, float]:
        """Added mass [kg] and resistance over the speed [kg/s]; per length in two dimensions."""
        t, z, force = np.array(self.rows).T
        last = t > t[-1] - 2 * math.pi / self.omega
        found = harmonic(t[last], force[last], self.omega) / harmonic(t[last], z[last], self.omega)
        return found.real / self.omega**2, found.imag / self.omega

    def errors(self) -> dict[str, float]:
        mass, resistance = self.parts()
        return {"resistance": resistance / (self.omega * mass)}


REASONS = (
    "What is left falls with the spacing: 4.7 and 2.3 % for the cylinder of 5 and 10 spacings to the radius. Edges shed what"
    " a round body does not, and a plate of one or two spacings does most. Summed over pairs, the default, the standing"
    " pressure makes the particles resist a change of their arrangement as a solid does: 16 and 15 % for the same cylinder."
    " Shifting, 0.5 in a full tank, lets volume creep past the body: without it the box, moved by a twentieth of a spacing, is"
    " resisted by 0.9 % in place of 14, and cylinder and plate, by half a spacing, by 3.3 and 25 % in place of 5.0 and 105; the"
    " box by 15 in place of 13 %: that is the particles' rearrangement. Of the box's, time step, density relaxation and wall"
    " guard change a tenth at most."
)


def scene(shape: str, amplitude: float = AMPLITUDE, omega: float = OMEGA, **numerics):
    """The `scene` of a case: a shape of `SHAPES` that oscillates vertically by `amplitude` [radii] at `omega` [1/s]."""

    def build(spacing: float, folder) -> dict:
        kind, size, along_y = SHAPES[shape]
        dim = 3 if shape == "sphere" else 2
        half, period = (3.0 if dim == 3 else 5.0) * RADIUS, 2 * math.pi / omega
        text = models.body(shape, (0, 0, 0), models.HEAVE, kind, size, 1000.0, along_y=along_y)
        motion = {"amplitude": amplitude * RADIUS, "omega": omega, "ramp": RAMP * period}
        return {
            "dimension": dim,
            "duration": PERIODS * period,
            "tank": {"min": [-half] * dim, "max": [half] * dim, "walls": ["x-", "x+", "y-", "y+", "z-", "z+"]},
            "fluid": {"still_water_level": half},
            "bodies": models.write(folder, [text]),
            "coupler": {"scheme": "prescribed", "motion": {shape: motion}},
            "numerics": {"viscosity": "none", "artificial_viscosity": 0.0, "standing_pressure": "apart"} | numerics,
        }

    return build


def _case(shape: str) -> Case:
    name = "submerged_oscillation" if shape == "cylinder" else f"submerged_{shape}"
    return Case(
        name,
        f"A {shape} deep in a closed tank is moved to and fro by a tenth of its radius, {3 if shape == 'sphere' else 2}D",
        "Potential flow: no resistance. The radius is 5, 10 and 20 spacings.",
        {"coarse": RADIUS / 5, "medium": RADIUS / 10, "paper": RADIUS / 20},
        scene(shape),
        lambda sim: Resistance(sim, OMEGA),
        {"resistance": 0.03},
        REASONS,
        fails_when={"resistance": Wrong("a resistance of a tenth of the inertial force", 0.1)},
    )


NAMES = ("submerged_oscillation", "submerged_box", "submerged_plate", "submerged_sphere")
CASES = {case.name: case for case in map(_case, SHAPES)}
