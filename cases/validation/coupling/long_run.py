"""A hinged flap in regular waves for 200 periods: what it does in the last hundred has to stay the same.

Amplitudes are those of the first harmonic of the angle, found by least squares over ten periods at a time. `spread`: largest
distance of one of the last ten from their mean; `drift`: rise of a straight line through them over the hundred periods;
both as shares of the mean. `volume`: of the fluid, at the end against the start.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure

PERIOD, PERIODS, BLOCK = 1.3, 200, 10
DEPTH, LENGTH = 0.42, 6.0

FLAP = """<mujoco model="flap">
  <option timestep="0.01" integrator="implicitfast"/>
  <worldbody>
    <body name="flap" pos="0 0 -0.36">
      <joint name="hinge" type="hinge" axis="0 1 0"/>
      <geom name="flap" type="box" pos="0 0 0.24" size="0.06 0.5 0.21" density="400"/>
    </body>
  </worldbody>
</mujoco>
"""


def harmonic(t: np.ndarray, x: np.ndarray, omega: float) -> float:
    """Amplitude of the first harmonic of x (n,), beside a mean and a second one."""
    phases = np.outer(t, [omega, 2 * omega])
    basis = np.column_stack([np.cos(phases), np.sin(phases), np.ones_like(t)])
    a, _, b, *_ = np.linalg.lstsq(basis, x, rcond=None)[0]
    return math.hypot(a, b)


class Amplitudes(Measure):
    """Angle of the hinge."""

    interval = PERIOD / 60

    def begin(self, sim) -> None:
        self.time, self.angle, self.volume_at_start = [], [], sim.balance.volume

    def sample(self, sim) -> None:
        self.time.append(sim.time)
        self.angle.append(sim.bodies.joints()["joint_position"][0])
        self.volume = sim.balance.volume

    def errors(self) -> dict[str, float]:
        t, x, omega = np.array(self.time), np.array(self.angle), 2 * math.pi / PERIOD
        starts = np.arange(PERIODS // 2, PERIODS, BLOCK) * PERIOD
        windows = [(t > start) & (t <= start + BLOCK * PERIOD) for start in starts]
        found = np.array([harmonic(t[inside], x[inside], omega) for inside in windows])
        rise = np.polyfit(np.linspace(0, 1, len(found)), found, 1)[0]
        return {
            "spread": np.abs(found / found.mean() - 1).max(),
            "drift": rise / found.mean(),
            "volume": self.volume / self.volume_at_start - 1,
        }


def _scene(spacing: float, folder: Path) -> dict:
    (folder / "flap.xml").write_text(FLAP, encoding="utf-8")
    return {
        "duration": PERIODS * PERIOD,
        "tank": {"min": [0.0, -DEPTH], "max": [LENGTH, 0.3]},
        "waves": {"wave_height": 0.06, "period": PERIOD},
        "damping": [{"start": 4.2, "end": LENGTH}],
        "bodies": {"flap": {"mjcf": str(folder / "flap.xml"), "position": [2.4, 0.0, 0.0], "pto": {"damping": 10.0}}},
    }


NAMES = ("flap_200_periods",)
CASES = {
    "flap_200_periods": Case(
        "flap_200_periods",
        "A flap with a linear power take-off in regular waves for 200 periods",
        "Exact: in the last hundred periods nothing changes.",
        {"coarse": 0.03, "medium": 0.02, "paper": 0.015},
        _scene,
        Amplitudes,
        {"spread": 0.02, "drift": 0.02, "volume": 0.01},
    )
}
