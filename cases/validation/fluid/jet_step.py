"""A jet along a floor hits a step and leaves over its edge: pressure on the front of the step, in two dimensions.

Exact: the free streamlines of a jet that hits a plate (Milne-Thomson 1968, Theoretical Hydrodynamics, ch. 11; half of it, the
floor being the line of symmetry), without gravity. In the plane of the complex velocity zeta = (u - i v) / U the flow is a
quarter of the unit circle with a source of the jet's flux at 1 and a sink at e^(-i alpha), alpha the angle at which the jet
leaves. On the step zeta = -i q, and by the images of source and sink

    dy/dq = 4 D / pi (1 / (1 + q^2) - (q^2 + cos 2 alpha) / (q^4 + 2 q^2 cos 2 alpha + 1)),    p = rho U^2 (1 - q^2) / 2,

D the thickness of the jet; q is 0 at the foot and 1 at the edge, whose height gives alpha. The step is that of `box_short`
(its height, the heights of its probes, its spacings), the jet as thick as the water which meets it at about 0.8 s. The jet
starts clear of the tank's wall: water that is drawn off a wall leaves with less than its speed.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from cases.validation.engine.case import Case, Measure
from cases.validation.fluid.short_box import PROBES
from fsi.fluid.gauges import pressure_at
from fsi.simulation.loop import Simulation

STEP, JET, SPEED = 0.16, 0.12, 2.0  # height of the step [m], thickness [m] and speed [m/s] of the jet
LENGTH, ROOM, HEIGHT = 2.4, 0.8, 1.6  # of the jet, room behind it and behind the step, and over the bed [m]
STEADY = 0.35, 0.65  # [s]; the end of the jet comes at 1.2


def on_face(angle: float, points: int = 4001) -> tuple[np.ndarray, np.ndarray]:
    """Height in jet thicknesses and pressure as a share of rho U^2 / 2, from the foot of the step to its edge, of a jet
    that leaves at that angle [rad] to the floor."""
    q, c = np.linspace(0, 1, points), math.cos(2 * angle)
    slope = 4 / math.pi * (1 / (1 + q**2) - (q**2 + c) / (q**4 + 2 * c * q**2 + 1))
    return cumulative_trapezoid(slope, q, initial=0), 1 - q**2


def exact_pressure(heights: tuple[float, ...], jet_over_step: float) -> np.ndarray:
    """Pressure as a share of rho U^2 / 2 at heights that are shares of the step's."""
    angle = brentq(lambda angle: on_face(angle)[0][-1] * jet_over_step - 1, 1e-3, 0.5 * math.pi - 1e-3)
    height, pressure = on_face(angle)
    return np.interp(heights, height * jet_over_step, pressure)


class FrontPressure(Measure):
    """Pressures on the front of the step, means over the time in which the flow is steady."""

    def begin(self, sim: Simulation) -> None:
        self.found, self.stagnation = [], 0.5 * sim.scene.fluid.density * SPEED**2

    def sample(self, sim: Simulation) -> None:
        if not STEADY[0] <= sim.time <= STEADY[1]:
            return
        fluid, h = sim.fluid, sim.scene.smoothing_length
        points = [np.array([LENGTH, z]) for z in PROBES]
        self.found.append([pressure_at(fluid.position, fluid.pressure_values, point, h, 0.0) for point in points])

    def errors(self) -> dict[str, float]:
        exact = exact_pressure(tuple(z / STEP for z in PROBES), JET / STEP)
        found = np.mean(self.found, axis=0) / self.stagnation
        return {f"p{n}": share for n, share in enumerate((found - exact).tolist(), start=1)}


STEP_XML = """<mujoco model="step">
  <option gravity="0 0 0"/>
  <custom><tuple name="wet"><element objtype="geom" objname="step"/></tuple></custom>
  <worldbody>
    <geom name="step" type="box" pos="{x} 0 {half}" size="{half} 0.5 {half}"/>
  </worldbody>
</mujoco>
"""


def _scene(spacing: float, folder: Path) -> dict:
    (folder / "step.xml").write_text(STEP_XML.format(x=LENGTH + 0.5 * STEP, half=0.5 * STEP))
    return {
        "duration": STEADY[1],
        "gravity": 0.0,
        "tank": {"min": [-ROOM, 0.0], "max": [LENGTH + ROOM, HEIGHT], "walls": ["x-", "x+", "z-", "z+"]},
        "bodies": {"step": {"mjcf": "step.xml"}},
        "fluid": {"blocks": [{"min": [0.0, 0.0], "max": [LENGTH, JET], "velocity": [SPEED, 0.0]}]},
    }


NAMES = ("jet_step",)
CASES = {
    "jet_step": Case(
        "jet_step",
        "A jet along a floor hits a step and leaves over its edge",
        "Exact: free streamlines (Milne-Thomson 1968). Errors of the pressure at the heights of P1 to P4 of `box_short`, means"
        " over 0.3 s, as shares of rho U^2 / 2.",
        {"coarse": 0.02, "medium": 0.01, "paper": 0.005},
        _scene,
        FrontPressure,
        {f"p{n}": 0.05 for n in (1, 2, 3, 4)},
        reasons="At 20 mm the jet is 6 spacings thick, and water swirls in the corner under P1. P4 is 2.5 spacings of 10 mm"
        " from the edge; it falls short of the exact pressure by half as much at half the spacing. The gauge is not why: of the"
        " exact flow it would read 0.011 too little.",
    )
}
