"""The wave surge converter of Wei et al. (2015) at 1:25, whose mass and inertia are known, in waves of 0.2 m and 2 s.

Flap of 33.04 kg, 0.12 x 0.48 x 1.04 m, hinged 0.16 m over a bed that rises to 0.155 m before it; still water 0.691 m over the
paddle's floor. Zhang et al. (2021, Ocean Eng. 236, 109540) solved it by SPH at 30 mm for 12 s. Its inertia of 1.84 kg m2 is
taken about the hinge here, which puts the centre of mass 0.19 m above it; `owsc_wei_peer` has both the other way, the
centre of mass on the hinge and 1.84 kg m2 about it, as the peer. `owsc_wei_20`, `_50` and `_100` have a power take-off of so
many N m s.

The experiment's records are not at hand: the pitch is compared with linear theory of the flap in a flume as wide as that of
the desktop levels, in 0.536 m of water, without its base and in the waves that come to it. The waves asked for are those of
the paddle's depth, carried to the flap's by the flux of energy (Dean & Dalrymple 1991, section 4.8).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cases.validation.bodies.owsc import Pitch
from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.pictures import Chart
from cases.validation.engine.scenes import builder, spacings
from cases.validation.theory.linear_flap import RHO, Flap, G, Response
from cases.validation.theory.separation import first_harmonic, group_speed, wave_heights
from fsi.fluid.gauges import elevation
from fsi.simulation.loop import Simulation
from fsi.waves import wavenumber

PERIOD, HEIGHT, OMEGA = 2.0, 0.2, math.pi
OFFSHORE, DEPTH = 0.691, 0.536  # still water at the paddle and at the flap [m]
FLAP = Flap(hinge=-0.376, top=0.104, thick=0.12, wide=1.04, flume=2.28, depth=DEPTH)
MASS, INERTIA, CENTRE = 33.04, 1.84, 0.19  # [kg], about the hinge [kg m2], over the hinge [m]
LINEAR = Response(
    11.35, 7.84, 781.5
)  # of `linear_flap.respond`, drawn on to zero spacing from (60, 20, 54) and (30, 20, 27) mm
GAUGES = np.arange(-1.75, -0.55, 0.1)  # from the flap [m], over the flat before it
MODEL = Path(__file__).parents[3] / "bodies" / "models" / "flap_wei.xml"
INERTIAL = '<inertial pos="0 0 0.19" mass="33.04" diaginertia="3.61 0.647 3.02"/>'
ON_HINGE = '<inertial pos="0 0 0" mass="33.04" diaginertia="3.61 1.84 3.02"/>'


def stiffness(centre: float) -> float:
    """Stiffness [N m] of buoyancy and weight about the upright place, the centre of mass so high over the hinge [m]."""
    wet = -FLAP.hinge
    waterplane = FLAP.thick**3 * FLAP.wide / 12
    return G * (RHO * (FLAP.thick * FLAP.wide * wet**2 / 2 + waterplane) - MASS * centre)


def incident_height() -> float:
    """Height [m] of the waves where the flap is."""
    there, here = (group_speed(wavenumber(OMEGA, d, G), d, G) for d in (OFFSHORE, DEPTH))
    return HEIGHT * math.sqrt(there / here)


def linear_pitch(damping: float, centre: float) -> float:
    """Pitch amplitude [rad] by linear theory in these waves, with a power take-off of so much damping [N m s]."""
    return LINEAR.pitch(OMEGA, incident_height() / 2, INERTIA, stiffness(centre), damping)


class PitchWei(Pitch):
    """Pitch, elevations and the pressures of the six sensors that ride on the flap."""

    def begin(self, sim: Simulation) -> None:
        scene = sim.scene
        place, end = scene.bodies["flap"].position[0], scene.duration
        self.window = (place - 2.0, place + 2.0), (scene.tank.min[-1], scene.tank.max[-1])
        self.moments = tuple(end - share * PERIOD for share in (1.0, 0.75, 0.5, 0.25))
        peer = scene.name.endswith("_peer")
        self.linear = linear_pitch(getattr(scene.bodies["flap"].pto, "damping", 0.0), 0.0 if peer else CENTRE)
        self.before = place + GAUGES
        self.places = [*self.before, *(gauge.x for gauge in scene.gauges.values())]
        self.names, self.probes = list(scene.gauges), dict.fromkeys(scene.probes)
        self.time, self.pitch, self.level, self.pressure, self.leaks = [], [], [], [], 0

    def sample(self, sim: Simulation) -> None:
        fluid, scene = sim.fluid, sim.scene
        self.time.append(sim.time)
        self.pitch.append(float(sim.bodies.joints()["joint_position"][0]))
        feet = [np.array([x, 0.0]) for x in self.places]
        self.level.append([elevation(fluid.position, foot, scene.spacing, scene.smoothing_length) for foot in feet])
        self.pressure.append(list(sim.instruments.pressures().values()))
        self.leaks = fluid.lost

    def errors(self) -> dict[str, float]:
        t = np.array(self.time)
        last = t > t[-1] - 2 * PERIOD
        t, pitch, level = t[last], np.array(self.pitch)[last], np.array(self.level)[last, : len(GAUGES)]
        amplitude = abs(first_harmonic(t, pitch[:, None], OMEGA)[0])
        incident, _ = wave_heights(t, level, self.before, OMEGA, wavenumber(OMEGA, DEPTH, G))
        return {
            "wave_height": incident / incident_height() - 1,
            "pitch_over_linear": amplitude / (self.linear * incident / incident_height()) - 1,
            "leaks": float(self.leaks),
        }

    def charts(self) -> list[Chart]:
        ends, high = [self.time[0], self.time[-1]], math.degrees(self.linear)
        theory = ("linear theory, amplitude", [*ends, math.nan, *ends], [high, high, math.nan, -high, -high])
        pitch = ("run", self.time, np.degrees(self.pitch)), theory
        level, pressure = np.array(self.level).T[len(GAUGES) :], 1e-3 * np.array(self.pressure).T
        levels = tuple((name, self.time, values) for name, values in zip(self.names, level, strict=True))
        pressures = tuple((n.replace("_", " "), self.time, p) for n, p in zip(self.probes, pressure, strict=True))
        return [
            Chart("pitch", "Pitch of the flap", "time [s]", "pitch [degrees]", pitch),
            Chart("level", "Elevation at 3.99, 7.02 and 8.82 m", "time [s]", "elevation [m]", levels),
            Chart("pressure", "Pressure at the sensors on the flap", "time [s]", "pressure [kPa]", pressures),
        ]


def scene(damping: float, peer: bool) -> Callable[[float, Path], dict]:
    """The `scene` of a case: the built-in one with a power take-off of so much damping [N m s], or the peer's inertia."""

    def build(spacing: float, folder: Path) -> dict:
        data = builder("owsc_wei")(spacing, folder)
        if damping:
            data["bodies"]["flap"]["pto"] = {"kind": "linear", "damping": damping}
        if peer:
            text = MODEL.read_text(encoding="utf-8")
            (folder / "flap.xml").write_text(text.replace(INERTIAL, ON_HINGE), encoding="utf-8")
            data["bodies"]["flap"]["mjcf"] = str(folder / "flap.xml")
        return data

    return build


REASONS = (
    "Linear theory is for low waves; these are two fifths as high as the water is deep at the flap, whose base and sloping bed"
    " are not in it. With the centre of mass on the hinge it has a pitch beyond 90 degrees. Waves of 3.3 spacings over their"
    " height lose a tenth of it on the way."
)


def _case(name: str, damping: float = 0.0, peer: bool = False) -> Case:
    linear = math.degrees(linear_pitch(damping, 0.0 if peer else CENTRE))
    what = "the peer's centre of mass" if peer else f"a power take-off of {damping:g} N m s"
    return Case(
        name,
        f"Flap of known mass at 1:25 in waves of 0.2 m and 2 s, 3D, with {what}",
        f"Linear theory of the flap in its flume: {linear:.1f} degrees in waves of {incident_height():.3f} m; Wei et al. (2015)"
        " measured it, their records are not at hand.",
        spacings("owsc_wei"),
        scene(damping, peer),
        PitchWei,
        {"wave_height": 0.1, "pitch_over_linear": 0.15, "leaks": 0.0},
        REASONS,
        fails_when={
            "wave_height": Wrong("waves that have lost a fifth of their height", 0.2),
            "pitch_over_linear": Wrong("a flap that swings half as far again or half as far", 0.5),
        },
    )


NAMES = ("owsc_wei", "owsc_wei_20", "owsc_wei_50", "owsc_wei_100", "owsc_wei_peer")
CASES = {
    case.name: case
    for case in (
        _case("owsc_wei"),
        _case("owsc_wei_20", 20.0),
        _case("owsc_wei_50", 50.0),
        _case("owsc_wei_100", 100.0),
        _case("owsc_wei_peer", peer=True),
    )
}
