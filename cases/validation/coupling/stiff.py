"""Stiff springs and dampers, end stops and contacts, one body each, side by side in a tank.

Bodies that float at rest are pushed: at 0.5 m/s against springs of 1e2 to 1e6 times the hydrostatic stiffness and against
dampers of 1e-2 to 1e4 times the critical damping, at 2 m/s against an end stop (joint limit) and a shelf under water (contact)
of a time constant of 1 ms, and against an end stop of 4 ms. `energy_created`: how far a body's kinetic and spring energy,
less the work of fluid and weight on it, ever exceeds that at the start, as a share of it. Penetrations are the deepest.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from fsi.owners import FIRST_BODY

HALF, HIGH, RATIO, PITCH, DEPTH = 0.1, 0.08, 0.5, 0.5, 0.5  # m
STIFFNESS = 1000 * 9.81 * 2 * HALF  # hydrostatic, N/m
MASS = RATIO * 1000 * 4 * HALF * HIGH
CRITICAL = 2 * math.sqrt(2 * MASS * STIFFNESS)  # with as much added mass
SPRINGS, DAMPERS = (1e2, 1e4, 1e6), (1e-2, 1.0, 1e2, 1e4)
STOPS = {"stop": 0.001, "soft_stop": 0.004}  # time constant [s]

FILE = """<mujoco>
  <custom><tuple name="wet">{wet}</tuple></custom>
  <option timestep="0.02" integrator="implicitfast"/>
  <worldbody>
    <geom name="ledge" type="box" pos="{x} 0 {z}" size="0.05 0.4 0.01" solref="0.001 1"/>
{bodies}
  </worldbody>
</mujoco>
"""


def _names() -> list[str]:
    return [*(f"spring_{k:g}" for k in SPRINGS), *(f"damper_{c:g}" for c in DAMPERS), *STOPS, "shelf"]


def _place(name: str) -> float:
    names = _names()
    return (names.index(name) + 0.5 - len(names) / 2) * PITCH


def _body(name: str) -> str:
    limit = f'limited="true" range="-0.03 0.03" solreflimit="{STOPS[name]} 1"' if name in STOPS else ""
    solid = 'solref="0.001 1"' if name == "shelf" else 'contype="0" conaffinity="0"'
    return (
        f'    <body name="{name}" pos="{_place(name)} 0 0"><joint name="{name}" type="slide" axis="0 0 1" {limit}/>'
        f'<geom name="{name}" type="box" size="{HALF} 0.5 {HIGH}" density="{1000 * RATIO}" {solid}/></body>'
    )


def scene(spacing: float, folder: Path) -> dict:
    names = _names()
    wet = "".join(f'<element objtype="geom" objname="{name}"/>' for name in names)
    text = FILE.format(wet=wet, x=_place("shelf"), z=-HIGH - 0.04, bodies="\n".join(map(_body, names)))
    (folder / "stiff.xml").write_text(text, encoding="utf-8")
    ptos = {f"spring_{k:g}": {"stiffness": k * STIFFNESS} for k in SPRINGS}
    ptos |= {f"damper_{c:g}": {"damping": c * CRITICAL} for c in DAMPERS}
    end = len(names) * PITCH / 2
    return {
        "duration": 2.0,
        "tank": {"min": [-end, -DEPTH], "max": [end, 0.5]},
        "bodies": {"set": {"mjcf": str(folder / "stiff.xml"), "pto": ptos}},
    }


class Created(Measure):
    """Energy of each body against what it was given, and penetrations."""

    def begin(self, sim) -> None:
        names = sim.bodies.joint_names
        push = {name: -0.5 if name.startswith(("spring", "damper")) else -2.0 for name in names}
        sim.bodies.place({}, push)
        self.speed = np.array([push[name] for name in names])
        self.start = 0.5 * MASS * self.speed**2
        self.spring = np.array([float(n.removeprefix("spring_")) if n.startswith("spring") else 0.0 for n in names])
        self.given, self.most = np.zeros(len(names)), np.zeros(len(names))

    def sample(self, sim) -> None:
        series = sim.bodies.joints()
        before, self.speed = self.speed, series["joint_velocity"].copy()
        load = sim.balance.wrench[FIRST_BODY:, 2] - MASS * sim.scene.gravity
        self.given += load * sim.dt * (before + self.speed) / 2
        energy = 0.5 * MASS * self.speed**2 + 0.5 * STIFFNESS * self.spring * series["joint_position"] ** 2
        self.most = np.maximum(self.most, energy - self.given - self.start)
        self.depths = sim.bodies.penetration()

    def errors(self) -> dict[str, float]:
        limits, contact = self.depths
        return {
            "energy_created": (self.most / self.start).max(),
            "stop_penetration_m": limits["stop"],
            "soft_stop_penetration_m": limits["soft_stop"],
            "contact_penetration_m": contact,
        }


NAMES = ("stiff_mechanisms",)
CASES = {
    "stiff_mechanisms": Case(
        "stiff_mechanisms",
        "Springs of 1e2 to 1e6 times the hydrostatic stiffness, dampers of 1e-2 to 1e4 times critical, stops hit at 2 m/s",
        "Exact: no energy is created. Penetration of an end stop and a contact of 1 ms, and of an end stop of 4 ms: a body of"
        " 2 m/s goes 2 v / e times the time constant into a critically damped stop that acts alone (0.7 and 2.9 mm).",
        {"coarse": 0.04, "medium": 0.02, "paper": 0.01},
        scene,
        Created,
        {
            "energy_created": 0.01,
            "stop_penetration_m": 0.0015,
            "soft_stop_penetration_m": 0.006,
            "contact_penetration_m": 0.0015,
        },
        fails_when={"contact_penetration_m": Wrong("twice as deep as the contact allows", 0.003)},
    )
}
