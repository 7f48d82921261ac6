"""A spar in forced heave, in free heave, and with six degrees of freedom, in three dimensions.

`spar`: radius 0.2 m, draft 0.8 m, 2 m of water, amplitude 0.06 m, 4 rad/s. Linear theory with the coefficients of a
boundary element code (`coupling.forced_heave`): amplitude and phase of the force without its hydrostatic part, added mass,
damping. The source documents move a spar of 115 kg and 1.4 m draft whose shape is not given: `spar_heave` lets a revolved
one of that mass and draft go. Its period is compared with linear theory, 2 pi sqrt((M + A33) / (rho g S)), with the added
mass of the plain spar scaled by the cube of the radius, for it is that of the bottom alone (the free surface is many radii
away). `spar_free` has six degrees of freedom: started in the plane y = 0 it must stay there, and keep the heave period.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.coupling import forced_heave
from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from fsi.simulation.loop import Simulation

OMEGA, MASS, RADIUS, DEPTH = 4.0, 115.0, 0.1621, 2.0
STIFFNESS = 1000 * 9.81 * math.pi * RADIUS**2
ADDED = 15.4 * (RADIUS / 0.2) ** 3  # kg, at about 2.6 rad/s
PERIOD = 2 * math.pi * math.sqrt((MASS + ADDED) / STIFFNESS)


class Forced(Pictured):
    """Heave and force, read as `forced_heave.Load` does, with pictures."""

    colour, window, moments = "speed", ((-1.2, 1.2), (-2.0, 0.4)), (3.1, 3.5)
    sample, errors = forced_heave.Load.sample, forced_heave.Load.errors

    def begin(self, sim: Simulation) -> None:
        self.omega, self.rows = OMEGA, []

    def charts(self) -> list[Chart]:
        t, z, force = np.array(self.rows).T
        at_rest = forced_heave.STIFFNESS * forced_heave.DRAFT
        ratio = forced_heave.theory(OMEGA) + forced_heave.STIFFNESS
        last = t > t[-1] - 2 * math.pi / OMEGA
        phase = forced_heave.harmonic(t[last], z[last], OMEGA)
        linear = (ratio * phase * np.exp(-1j * OMEGA * t[last])).real
        lines = ("run", t, force - at_rest + forced_heave.STIFFNESS * z), ("linear theory", t[last], linear)
        return [
            Chart("force", "Vertical force of the water without its hydrostatic part", "time [s]", "force [N]", lines)
        ]


class Free(Pictured):
    """Position and tilt of the spar."""

    colour, window, moments = "speed", ((-1.2, 1.2), (-2.0, 0.4)), (0.6, 1.2, 3.0, 6.0)

    def begin(self, sim: Simulation) -> None:
        self.time, self.rows, self.leaks = [], [], 0
        self._note(sim)

    def sample(self, sim: Simulation) -> None:
        self._note(sim)

    def _note(self, sim: Simulation) -> None:
        motion = sim.bodies.motion()
        axis = motion.rotation[0, :, 2]
        x, y, z = motion.position[0]
        self.time.append(sim.time)
        self.rows.append((x, y, z, math.atan2(axis[0], axis[2]), math.atan2(-axis[1], axis[2])))
        self.leaks = sim.fluid.lost

    def errors(self) -> dict[str, float]:
        t, rows = np.array(self.time), np.array(self.rows)
        errors = {"heave_period": _period(t, rows[:, 2]) / PERIOD - 1, "leaks": float(self.leaks)}
        if np.abs(rows[:, 3]).max() > 1e-9:
            errors["sway_m"] = float(np.abs(rows[:, 1]).max())
            late = np.abs(rows[t > 0.5 * t[-1], 3]).max()
            errors["tilt_growth"] = max(0.0, float(late / abs(rows[0, 3]) - 1))
        return errors

    def charts(self) -> list[Chart]:
        t, rows = np.array(self.time), np.array(self.rows)
        z = rows[:, 2] - rows[0, 2] + 0.06
        linear = 0.06 * np.cos(2 * math.pi * t / PERIOD)
        charts = [
            Chart("heave", "Heave", "time [s]", "heave [m]", (("run", t, z), ("undamped linear theory", t, linear)))
        ]
        if np.abs(rows[:, 3]).max() > 1e-9:
            lines = ("pitch", t, np.degrees(rows[:, 3])), ("roll", t, np.degrees(rows[:, 4]))
            charts.append(Chart("tilt", "Pitch and roll", "time [s]", "angle [degrees]", lines))
        return charts


def _period(t: np.ndarray, z: np.ndarray) -> float:
    """Twice the time [s] from the first minimum of z to the maximum after it, each by a parabola; nan without a minimum."""
    low = int(z[t < 0.75 * PERIOD].argmin())
    if low < 3:
        return math.nan  # it does not move
    after = np.flatnonzero((t > t[low]) & (t < t[low] + 0.75 * PERIOD))
    turns = []
    for i in (low, int(after[z[after].argmax()])):
        near = slice(i - 3, i + 4)
        a, b, _ = np.polyfit(t[near] - t[i], z[near], 2)
        turns.append(t[i] - b / (2 * a))
    return 2 * (turns[1] - turns[0])


SHORT = (
    "The radius is 2.4 spacings at the coarse level, and the period as short as that without added mass, 3.4 % below theory: a"
    " target of 5 % would not have told the two apart. What shortens it has not been found."
)


def _free(name: str, title: str, more: dict) -> Case:
    reference = f"Linear theory: heave period {PERIOD:.3f} s, added mass of the plain spar scaled by its radius cubed."
    if more:
        reference += " Started in the plane y = 0 it stays there; its tilt does not grow."
    target = {"heave_period": 0.02, "leaks": 0.0} | more
    fails = {"heave_period": Wrong("no added mass at all", math.sqrt(MASS / (MASS + ADDED)) - 1)}
    return Case(name, title, reference, spacings(name), builder(name), Free, target, SHORT, fails_when=fails)


NAMES = ("spar", "spar_heave", "spar_free")
CASES = {
    case.name: case
    for case in (
        Case(
            "spar",
            "Plain spar in forced heave, 0.06 m at 4 rad/s",
            "Linear theory: boundary element code, A33 15.25 kg, B33 2.38 kg/s; the force without its hydrostatic part.",
            spacings("spar"),
            builder("spar"),
            Forced,
            forced_heave.TARGET,
            forced_heave.REASONS,
        ),
        _free("spar_heave", "Spar of 115 kg and 1.4 m draft, free heave", {}),
        _free("spar_free", "Spar of 115 kg with six degrees of freedom", {"sway_m": 0.005, "tilt_growth": 0.05}),
    )
}
