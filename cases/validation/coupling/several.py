"""Several bodies at once: a chain of five hinged floats, a float on a mooring tendon, two bodies that collide under water,
and a body of a gram beside one of a tonne.

Exact: Archimedes for what comes to rest, the tendon's tension from the buoyancy of a float held under water, and the energy
of all, which never rises: as a share of the potential energy of the water above the bed, of which still water alone gains a
thousandth while its lattice settles, and without the first half second, in which it does most of that. Drafts are errors in
shares of the spacing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cases.validation.coupling.energy import Inside, Total
from cases.validation.engine.case import Case, Measure, Wrong

RHO, G = 1000.0, 9.81
HEAD = '<mujoco>\n  <option timestep="0.02" integrator="implicitfast"/>\n'
LINK, BEAM, LINKS = 0.4, 0.12, 5  # length and height of a link of the chain [m]
FLOAT, UNDER, STRETCH = (0.32, 0.2), 0.12, 2e5  # width and height [m], of its top under water [m], N/m
SETTLED = 0.5  # s
BOX, SPEED = 0.2, 1.0  # of the bodies that collide [m], m/s
GRAM, TONNE = (0.32, 0.16), (1.28, 0.8)  # widths and heights of 1e-3 kg and 1e3 kg [m]


def chain(folder: Path) -> str:
    """Floats hinged end to end, half immersed at rest."""
    text, end = "", ""
    for n in range(LINKS):
        place = f"{-LINKS * LINK / 2 + LINK / 2} 0 0.04" if n == 0 else f"{LINK} 0 0"
        joint = (
            "<freejoint/>" if n == 0 else f'<joint name="hinge{n}" type="hinge" axis="0 1 0" pos="{-LINK / 2} 0 0"/>'
        )
        size = f"{LINK / 2 - 0.03} 0.5 {BEAM / 2}"
        text += (
            f'<body name="link{n}" pos="{place}">{joint}<geom name="link{n}" type="box" size="{size}" density="500"/>\n'
        )
        end += "</body>"
    return f"{HEAD}<worldbody>{text}{end}</worldbody><contact>{_exclusions()}</contact></mujoco>"


def _exclusions() -> str:
    return "".join(f'<exclude body1="link{n}" body2="link{m}"/>' for m in range(LINKS) for n in range(m))


def mooring(folder: Path) -> str:
    """A float under water, held by a tendon."""
    size = f"{FLOAT[0] / 2} 0.5 {FLOAT[1] / 2}"
    z = -UNDER - FLOAT[1] / 2
    return f"""{HEAD}<worldbody><site name="anchor" pos="0 0 -0.8"/>
<body name="float" pos="0 0 {z}"><freejoint/><site name="keel" pos="0 0 {-FLOAT[1] / 2}"/>
<geom name="float" type="box" size="{size}" density="300"/></body></worldbody>
<tendon><spatial name="tether" stiffness="{STRETCH}" damping="300" springlength="0 {0.8 + z - FLOAT[1] / 2}">
<site site="anchor"/><site site="keel"/></spatial></tendon></mujoco>"""


def collision(folder: Path) -> str:
    """Two bodies of the density of water, side by side."""
    size = f'type="box" size="{BOX / 2} 0.5 {BOX / 2}" density="1000"'
    left, right = (
        f'<body name="{name}" pos="{x} 0 -0.4"><freejoint/><geom name="{name}" {size}/></body>'
        for name, x in (("left", -0.25), ("right", 0.25))
    )
    return f"{HEAD}<worldbody>{left}{right}</worldbody></mujoco>"


def light_and_heavy(folder: Path) -> str:
    """A gram and a tonne, 3 cm above their rest and free to move in every way."""
    bodies = ""
    for name, x, (wide, high), mass in (("gram", -1.0, GRAM, 1e-3), ("tonne", 0.6, TONNE, 1e3)):
        z = high / 2 - mass / (RHO * wide) + 0.03
        geom = f'<geom name="{name}" type="box" size="{wide / 2} 0.5 {high / 2}" mass="{mass}"/>'
        bodies += f'<body name="{name}" pos="{x} 0 {z}"><freejoint/>{geom}</body>'
    return f"{HEAD}<worldbody>{bodies}</worldbody></mujoco>"


class Together(Measure):
    """Energy, fluid in bodies, heights over the last quarter, and what the case adds."""

    def __init__(self, sim, group: Group):
        self.group = group
        super().__init__(sim)

    def begin(self, sim) -> None:
        if self.group.push:
            self.group.push(sim)
        self.total, self.inside, self.sim = None, Inside(sim), sim
        self.heights, self.tension = [], []

    def sample(self, sim) -> None:
        if sim.time > SETTLED:
            self.total = self.total or Total(sim)
            self.total(sim)
        if sim.time > 0.75 * sim.scene.duration:
            self.heights.append(sim.bodies.motion().position[:, 2])
            if sim.bodies.model.ntendon:
                stretch = sim.bodies.data.ten_length[0] - sim.bodies.model.tendon_lengthspring[0, 1]
                self.tension.append(STRETCH * stretch)

    def errors(self) -> dict[str, float]:
        sim, group = self.sim, self.group
        errors = {
            "energy_rise": self.total.rise / group.water(sim.scene.tank.width),
            "fluid_in_bodies": self.inside.count(sim) / sim.fluid.count,
        }
        mean = np.mean(self.heights, axis=0)
        if group.rest:
            level = _level(sim, group)
            errors["draft"] = np.abs(mean - level - np.array(group.rest)).max() / sim.scene.spacing
        if self.tension:
            expected = (RHO - 300) * G * FLOAT[0] * FLOAT[1]
            errors["tension"] = np.mean(self.tension) / expected - 1
        if sim.bodies.penetration()[1] > 0:
            errors["contact_penetration_m"] = sim.bodies.penetration()[1]
        return errors


def _level(sim, group: Group) -> float:
    """Water level at rest, from the particles in the tank and what the bodies displace then [m]."""
    (left, bed), (right, _) = group.tank
    water = sim.fluid.count * sim.scene.spacing**2
    return (water + float(np.array(group.drafts) @ np.array(group.widths))) / (right - left) + bed


@dataclass(frozen=True)
class Group:
    """A case: the file, the tank, the heights of the bodies over the water at rest, their widths and drafts [m], and what sets
    them going."""

    model: Callable[[Path], str]
    tank: tuple[list[float], list[float]]
    duration: float
    rest: tuple[float, ...] = ()
    widths: tuple[float, ...] = ()
    drafts: tuple[float, ...] = ()
    push: Callable | None = None
    spacing: dict[str, float] = field(default_factory=lambda: {"coarse": 0.04, "medium": 0.02, "paper": 0.01})

    def water(self, width: float) -> float:
        """Energy that it takes to lift the water of the tank from its bed [J]."""
        (left, bed), (right, _) = self.tank
        return RHO * G * bed**2 / 2 * (right - left) * width

    def scene(self, spacing: float, folder: Path) -> dict:
        (folder / "bodies.xml").write_text(self.model(folder), encoding="utf-8")
        low, high = self.tank
        beaches = [{"start": side * 0.7 * high[0], "end": side * high[0]} for side in (-1, 1)]
        return {
            "duration": self.duration,
            "tank": {"min": low, "max": high},
            "damping": beaches,
            "bodies": {"set": {"mjcf": str(folder / "bodies.xml")}},
        }


def _approach(sim) -> None:
    """Towards each other."""
    sim.bodies.data.qvel[[0, 6]] = SPEED, -SPEED
    sim.bodies.restore(sim.bodies.state())


_GRAM, _TONNE = GRAM[1] / 2 - 1e-3 / (RHO * GRAM[0]), TONNE[1] / 2 - 1.0 / TONNE[0]
GROUPS = {
    "float_chain": Group(
        chain, ([-2.0, -0.6], [2.0, 0.4]), 8.0,
        rest=(0.0,) * LINKS, widths=(LINK - 0.06,) * LINKS, drafts=(BEAM / 2,) * LINKS,
    ),
    "mooring": Group(mooring, ([-1.2, -0.8], [1.2, 0.4]), 6.0),
    "collision": Group(
        collision, ([-1.2, -0.8], [1.2, 0.4]), 1.5, push=_approach
    ),
    "light_and_heavy": Group(
        light_and_heavy, ([-2.4, -1.6], [2.4, 0.8]), 10.0,
        rest=(_GRAM, _TONNE), widths=(GRAM[0], TONNE[0]),
        drafts=(1e-3 / (RHO * GRAM[0]), 1.0 / TONNE[0]),
    ),
}  # fmt: skip
TITLES = {
    "float_chain": "Five floats hinged end to end fall 4 cm and come to rest",
    "mooring": "A float of density ratio 0.3 is held 12 cm under water by a tendon",
    "collision": "Two bodies of the density of water run into each other at 2 m/s, 0.4 m deep",
    "light_and_heavy": "A body of 1e-3 kg (density ratio 2e-5) beside one of 1e3 kg, both free",
}
TARGETS = {
    "float_chain": {"draft": 0.25},
    "mooring": {"tension": 0.03},
    "collision": {"contact_penetration_m": 0.01},
    "light_and_heavy": {"draft": 0.25},
}
REASONS = {
    "light_and_heavy": "A body without weight hovers where the pressure of the last particles ends, 0.22 to 0.29 spacings above"
    " the water at spacings of 40 and 20 mm; the heavy one lies within 0.005, and boxes of a ratio of 0.02 within 0.06.",
    "collision": "Particles caught between the bodies when they meet have no room: a few (3 of 4600 at 2 cm) end up more than"
    " half a spacing inside one of them.",
}
NAMES = ("float_chain", "mooring", "collision", "light_and_heavy")
CASES = {
    name: Case(
        name,
        TITLES[name],
        "Exact: no energy is created, no fluid gets into a body; Archimedes.",
        group.spacing,
        group.scene,
        lambda sim, group=group: Together(sim, group),
        {"energy_rise": 0.002, "fluid_in_bodies": 0.0, **TARGETS[name]},
        reasons=REASONS.get(name, ""),
        fails_when={"contact_penetration_m": Wrong("a tenth of a body inside the other", 0.1 * BOX)},
    )
    for name, group in GROUPS.items()
}
