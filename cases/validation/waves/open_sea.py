"""Waves in a box with a sea around it: those that were asked for stay, those that were not leave.

`sea_regular`, and on a current `sea_current_with` and `sea_current_against`: no body; the elevation at nine gauges between
the zones against the incident waves themselves, of Stokes' third order. `sea_absorption`: still water is thrown into a group
of waves, half of which runs to either side; exact is that nothing comes back. Its kinetic energy is half of the whole as soon
as it runs, so that sqrt(2 K / K0), when what came back would be in the middle again, is what the zones reflect.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.theory.separation import first_harmonic
from cases.validation.waves.wavemaker import SEA
from fsi.fluid.gauges import elevation
from fsi.scene.geometry import incident_waves
from fsi.simulation.loop import Simulation
from fsi.waves.current import retimed
from fsi.waves.kinds.focused import Waves as Focused
from fsi.waves.kinds.regular import Waves as Regular

G, DEPTH, KD, HEIGHT = 9.81, 0.5, 1.5, 0.1
K = KD / DEPTH
OMEGA = math.sqrt(G * K * math.tanh(KD))
PERIOD, LENGTH = 2 * math.pi / OMEGA, 2 * math.pi / K
PERIODS, RECORD = 10, 3  # of the run, and at its end of the record
CURRENT = 0.3  # [m/s], a sixth of the speed of the waves
GROUP = Focused(kind="focused", crest=0.03, peak_period=PERIOD, time=0.0, gamma=8.0, highest=1.6)
BACK = (3.0, 5.0)  # when what is reflected comes through the middle [periods]


class Stays(Measure):
    """Elevation between the zones, and that of the incident waves."""

    def begin(self, sim: Simulation) -> None:
        asked = sim.scene.sea.waves
        self.period, self.height, self.end = asked.period, asked.wave_height, sim.scene.duration
        self.interval = self.period / 24
        self.time, self.found, self.exact, self.waves = [], [], [], incident_waves(sim.scene)
        self.k = float(self.waves.k[0])
        self.places = 2 * math.pi / self.k * np.linspace(-0.45, 0.45, 9)

    def sample(self, sim: Simulation) -> None:
        dr, h = sim.scene.spacing, sim.scene.smoothing_length
        self.time.append(sim.time)
        self.found.append([elevation(sim.fluid.position, np.array([x]), dr, h) for x in self.places])
        self.exact.append(self.waves.elevation(sim.time, self.places[:, None]))

    def errors(self) -> dict[str, float]:
        t, found, exact = (np.array(x) for x in (self.time, self.found, self.exact))
        record, omega = RECORD * self.period, 2 * math.pi / self.period
        late = t > self.end - record
        early = (t > self.period) & (t < self.period + record)

        def harmonic(n: np.ndarray, order: int = 1) -> np.ndarray:
            return first_harmonic(t[n], found[n], order * omega) / first_harmonic(t[n], exact[n], order * omega)

        ratio, before = harmonic(late), harmonic(early)
        height = np.abs(ratio).mean()
        slope = np.polyfit(self.places, np.angle(ratio), 1)[0]  # of k too much
        whole = t > t[-1] - record * (1 + 1e-9)
        return {
            "height": float(height - 1),
            "spread": float(np.abs(np.abs(ratio) - height).max()),
            "phase_speed": float(-slope / self.k),
            "level": float((found[whole] - exact[whole]).mean() / self.height),
            "growth": float(height / np.abs(before).mean() - 1),
            "second_harmonic": float(np.abs(harmonic(late, 2)).mean() - 1),
        }


class Leaves(Measure):
    """Kinetic energy of the water."""

    def begin(self, sim: Simulation) -> None:
        fluid = sim.fluid
        fluid.velocity[:] = GROUP.incident(DEPTH, G).velocity(0.0, fluid.position)
        self.time, self.kinetic = [0.0], [0.5 * float(fluid.k.mass) * float((fluid.velocity**2).sum())]

    def sample(self, sim: Simulation) -> None:
        self.time.append(sim.time)
        self.kinetic.append(sim.balance.kinetic)

    def errors(self) -> dict[str, float]:
        t, kinetic = np.array(self.time) / PERIOD, np.array(self.kinetic)
        return {"reflection": math.sqrt(2 * kinetic[(t > BACK[0]) & (t < BACK[1])].mean() / kinetic[0])}


def _scene(spacing: float, sea: dict, periods: float) -> dict:
    end = round(LENGTH / spacing) * spacing
    return {
        "duration": periods * PERIOD,
        "tank": {"min": [-end, -DEPTH], "max": [end, math.ceil(1.5 * HEIGHT / spacing) * spacing]},
        "sea": sea,
        "numerics": SEA,
    }


def regular(spacing: float, folder) -> dict:
    return _scene(spacing, {"waves": {"wave_height": HEIGHT, "period": PERIOD}}, PERIODS)


def streaming(current: float):
    def scene(spacing: float, folder) -> dict:
        waves = {"wave_height": HEIGHT, "period": PERIOD}
        drifting = retimed(Regular(**waves), DEPTH, G, current).incident(DEPTH, G)
        end = round(4 * math.pi / drifting.k[0] / spacing) * spacing / 2
        found = _scene(spacing, {"waves": waves, "current": current}, PERIODS)
        tank = {"min": [-end, -DEPTH], "max": [end, found["tank"]["max"][1]], "periodic": ["x"]}
        return found | {"tank": tank}

    return scene


def thrown(zone: float):
    def scene(spacing: float, folder) -> dict:
        still = {"wave_height": 1e-6, "period": PERIOD, "order": 1}
        return _scene(spacing, {"waves": still, "start": "rest", "zone": zone * LENGTH}, BACK[1])

    return scene


SPACING = {level: HEIGHT / per for level, per in (("coarse", 5), ("medium", 10), ("paper", 20))}
NAMES = ("sea_regular", "sea_absorption", "sea_current_with", "sea_current_against")
CASES = {
    "sea_regular": Case(
        "sea_regular",
        "Regular waves in a box with a sea around it, kd = 1.5, H/L = 0.048",
        "The incident waves: Stokes' third order, with the return flow of a closed tank.",
        SPACING,
        regular,
        Stays,
        {"height": 0.02, "spread": 0.02, "phase_speed": 0.005, "level": 0.005, "growth": 0.02},
        fails_when={
            "spread": Wrong("a wave of a tenth comes back from the zones", 0.1),
            "phase_speed": Wrong("the speed of linear theory in place of the third order's", 0.008),
            "level": Wrong("the level creeps by a hundredth of the wave height", 0.01),
            "growth": Wrong("waves that grow by a twentieth in six periods", 0.05),
        },
    ),
    "sea_absorption": Case(
        "sea_absorption",
        "A group of waves thrown into still water leaves the box through zones of half a wave length",
        "Exact: nothing comes back.",
        SPACING,
        thrown(0.5),
        Leaves,
        {"reflection": 0.06},
        "The longest waves of the group are half as long again as at its peak, and their zones a third of their length; zones"
        " of 0.8 of the wave length at the peak leave 3 %, near what the particles' own disorder leaves.",
    ),
} | {
    name: Case(
        name,
        f"Regular waves {way} a current of {CURRENT:g} m/s in a periodic box with a sea's zones, 1.2 s, H = 0.1 m",
        "The incident waves: Stokes' third order in water that drifts with the current (Peregrine 1976).",
        SPACING,
        streaming(current),
        Stays,
        {"height": 0.02, "spread": 0.02, "phase_speed": 0.01, "level": 0.005, "growth": 0.02},
        "Against the current waves fall by 2.8 % in ten periods, with it they grow by 0.5 %; the cause is not known.",
        fails_when={
            "spread": Wrong("a wave of a tenth comes back from the zones", 0.1),
            "phase_speed": Wrong("the length of waves without the current", 0.15),
            "level": Wrong("the level creeps by a hundredth of the wave height", 0.01),
            "growth": Wrong("waves that grow by a twentieth in six periods", 0.05),
        },
    )
    for name, way, current in (("sea_current_with", "on", CURRENT), ("sea_current_against", "against", -CURRENT))
}
