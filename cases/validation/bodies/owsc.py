"""A bottom-hinged flap at 1:20 in regular waves of 0.15 m and 1.34 s, 0.7 m deep: 3D in a narrow flume, and 2D.

Experiment (SurgeWEC, as told in the source documents): pitch amplitude about 30 degrees, -36 degrees in the trough. By the
depth given the flap is submerged, by the place of its upper sensor it pierces the surface: both readings are run. The
mass of the flap is not given; 550 kg/m3 here, with a hinge damping of 0.5 N m s.

`pitch_over_30` is reported against the experiment, `pitch_period` against the waves'. `wave_height` is that of the waves that
come to the flap, told apart from those it sends back by gauges before it: a gauge at the flap itself reads the flap, where
that pierces the surface. `pitch_over_linear` compares with linear theory of the same flap in the same flume and in waves of
that height (`linear_flap`); at open sea, for the wide flume of the paper level, with a boundary element code.

What decides between 17 and 30 degrees is the mass. Submerged, the flap of 550 kg/m3 would swing by itself in 2.45 s, longer
than the waves, so inertia holds it back; with 200 kg/m3 linear theory has 30 degrees in the narrow flume. Below linear theory
the flap stays by what its edges shed, and, in a few spacings over its thickness, by more added inertia: swung by force through
5 degrees in still water it has 1.12, 1.01 and 0.88 kg m2 at 25, 17.5 and 12.5 mm (theory 0.92) and a damping of 2.7, 2.5 and
1.7 N m s (waves alone 0.47). Where it pierces the surface it leans down the waves by 22 degrees and swings by 18 about that;
in waves of 0.05 m it swings by 3 % less than linear theory has, and sends back 8 % of them (7 %).
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from cases.validation.theory.linear_flap import Flap, Response, inertia, stiffness
from cases.validation.theory.separation import first_harmonic, wave_heights
from fsi.fluid.gauges import elevation, pressure_at
from fsi.simulation.loop import Simulation
from fsi.waves import wavenumber

PERIOD, HEIGHT, DEPTH = 1.34, 0.15, 0.7
OMEGA = 2 * math.pi / PERIOD
DENSITY, FRICTION = 550.0, 0.5  # of flap.xml [kg/m3], [N m s]
EXPERIMENT = math.radians(30)
SUBMERGED = {"hinge": -0.65, "top": -0.35, "thick": 0.06, "wide": 0.4, "depth": DEPTH}
FLAPS = {
    "owsc": Flap(**SUBMERGED, flume=0.84),
    "owsc_2d": Flap(**SUBMERGED, flume=0.4),
    "owsc_2d_surface": Flap(**SUBMERGED | {"hinge": -0.25, "top": 0.05}, flume=0.4),
}
LINEAR = {  # of `linear_flap.respond`, drawn on to zero spacing from two lattices
    "owsc": Response(0.607, 0.106, 45.9),
    "owsc_2d": Response(0.9235, 0.4654, 66.31),
    "owsc_2d_surface": Response(1.2031, 4.581, 208.0),
}
OPEN_SEA = Response(0.606, 0.0525, 45.8)  # bem_flap at 1.34 s
GAUGES = np.arange(-2.0, -0.75, 0.1)  # from the flap [m]


def linear_pitch(name: str, wide: bool = False, density: float = DENSITY) -> float:
    """Pitch amplitude [rad] by linear theory in the waves asked for, `wide` in the wide flume."""
    flap = FLAPS[name]
    alone = inertia(flap, density), stiffness(flap, density)
    return (OPEN_SEA if wide else LINEAR[name]).pitch(OMEGA, HEIGHT / 2, *alone, FRICTION)


class Pitch(Pictured):
    """Pitch of the flap, the elevation before and beside it, and the pressure where its sensors are at rest."""

    moments, colour, interval = (), "u", 0.02

    def begin(self, sim: Simulation) -> None:
        scene = sim.scene
        place, end = scene.bodies["flap"].position[0], scene.duration
        self.window = (place - 1.5, place + 1.5), (scene.tank.min[-1], scene.tank.max[-1])
        self.moments = (end - PERIOD, end - 0.75 * PERIOD, end - 0.5 * PERIOD, end - 0.25 * PERIOD)
        self.linear = linear_pitch(scene.name, scene.dimension == 3 and scene.tank.max[1] > 1)
        self.before = place + GAUGES
        self.gauges = [(x, 0.0) for x in self.before] + [(scene.gauges["beside"].x, scene.gauges["beside"].y)]
        self.probes = {name: np.array(probe.position) for name, probe in scene.probes.items()}
        self.time, self.pitch, self.level, self.pressure, self.leaks = [], [], [], [], 0

    def sample(self, sim: Simulation) -> None:
        fluid, scene, h = sim.fluid, sim.scene, sim.scene.smoothing_length
        points = [np.array(place[: fluid.dim - 1]) for place in self.gauges]
        self.time.append(sim.time)
        self.pitch.append(float(sim.bodies.joints()["joint_position"][0]))
        self.level.append([elevation(fluid.position, point, scene.spacing, h) for point in points])
        rho_g = scene.fluid.density * scene.gravity
        probes = self.probes.values()
        self.pressure.append([pressure_at(fluid.position, fluid.pressure_values, point, h, rho_g) for point in probes])
        self.leaks = fluid.lost

    def steady(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time [s], pitch [rad] and elevations before the flap [m] of the last two periods."""
        t = np.array(self.time)
        last = t > t[-1] - 2 * PERIOD
        return t[last], np.array(self.pitch)[last], np.array(self.level)[last, :-1]

    def period(self) -> float:
        """Period of the pitch [s], from its upward crossings of the mean."""
        t, y = np.array(self.time), np.array(self.pitch)
        y = y - self.steady()[1].mean()
        up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
        crossings = t[up] - y[up] * (t[up + 1] - t[up]) / (y[up + 1] - y[up])
        return float(np.diff(crossings[-3:]).mean())

    def errors(self) -> dict[str, float]:
        t, pitch, level = self.steady()
        amplitude = abs(first_harmonic(t, pitch[:, None], OMEGA)[0])
        incident, _ = wave_heights(t, level, self.before, OMEGA, wavenumber(OMEGA, DEPTH, 9.81))
        return {
            "pitch_period": self.period() / PERIOD - 1,
            "wave_height": incident / HEIGHT - 1,
            "pitch_over_linear": amplitude / (self.linear * incident / HEIGHT) - 1,
            "pitch_over_30": amplitude / EXPERIMENT - 1,
            "leaks": float(self.leaks),
        }

    def charts(self) -> list[Chart]:
        bounds = [math.degrees(s * self.linear) for s in (-1, 1)]
        ends = [self.time[0], self.time[-1]]
        lines = [("run", self.time, np.degrees(self.pitch))]
        lines += [(f"linear, {bound:+.1f} degrees", ends, [bound, bound]) for bound in bounds]
        lines += [("experiment, +30 and -36 degrees", [*ends, math.nan, *ends], [30, 30, math.nan, -36, -36])]
        sensors = zip(self.probes, 1e-3 * np.array(self.pressure).T, strict=True)
        pressures = tuple((name.replace("_", " "), self.time, values) for name, values in sensors)
        level = np.array(self.level)
        levels = ("2 m before", self.time, level[:, 0]), ("beside", self.time, level[:, -1])
        return [
            Chart("pitch", "Pitch of the flap", "time [s]", "pitch [degrees]", tuple(lines)),
            Chart("level", "Elevation before and beside the flap", "time [s]", "elevation [m]", levels),
            Chart("pressure", "Pressure where the sensors are at rest", "time [s]", "pressure [kPa]", pressures),
        ]


def _case(name: str, title: str, linear: float) -> Case:
    reference = (
        "Experiment: SurgeWEC flap at 1:20, pitch amplitude about 30 degrees (reported). Linear theory of this flap, in this"
        f" flume and in the waves that come to it: {math.degrees(linear_pitch(name)):.1f} degrees in waves of 0.15 m at"
        f" 550 kg/m3, {math.degrees(linear_pitch(name, density=200.0)):.1f} at 200; the mass is not given. The period of the"
        " pitch is the waves'."
    )
    target = {
        "pitch_period": 0.02,
        "wave_height": 0.15,
        "pitch_over_linear": linear,
        "pitch_over_30": 1.0,
        "leaks": 0.0,
    }
    return Case(name, title, reference, spacings(name), builder(name), Pitch, target)


NAMES = ("owsc", "owsc_2d", "owsc_2d_surface")
CASES = {
    case.name: case
    for case in (
        _case("owsc", "Submerged flap in a flume twice as wide, 3D", 0.5),
        _case("owsc_2d", "Submerged flap, 2D", 1.0),
        _case("owsc_2d_surface", "Flap that pierces the surface, 2D", 3.0),
    )
}
