"""A triangular slide runs down a submerged ramp of 45 degrees, in two dimensions: guided along it, free by contact, free with
two layers of fluid glued to its face, and led down a prescribed way.

Case of Heinrich (1992), J. Waterway Port Coast. Ocean Eng. 118, 249-266: 2000 kg/m3 in water 1 m deep; surfaces at 0.5 and
1.0 s, of which the sources at hand have pictures only. The reference is rigid-body theory, by two ways:

- `law`: with the weight in water and a constant added mass and drag, the way down the ramp is s = u^2 / a ln cosh(a t / u)
  of the initial acceleration a and the final speed u (Grilli & Watts 1999, Eng. Anal. Bound. Elem. 23, 645-656); root mean
  square misfit of the best such curve over 0.6 s, as a share of the way.
- `theory`: with the added mass of potential flow at each place and the drag of a flat plate (`coupling.slide`), nothing
  fitted; largest misfit over the first 0.15 m, as a share of that.

`displacement` compares the way after 0.5 s with that of the same slide at a spacing of 7.5 mm. The prescribed way is that of
the theory; what must lead the slide on it besides its weight and the water, `drive`, is then a small share of its weight in
water: the mean of the first 0.25 s.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.coupling.models import force
from cases.validation.coupling.slide import way_of
from cases.validation.engine.case import Case
from cases.validation.engine.pictures import Chart, Pictured
from cases.validation.engine.scenes import builder, spacings
from fsi.simulation.loop import Simulation

MASS, BUOYANCY, G, S = 250.0, 125.0, 9.81, math.sqrt(0.5)  # [kg/m], [kg/m] of water displaced, [m/s2]
PULL = (MASS - BUOYANCY) * G * S  # [N/m]
MOMENTS = (0.5, 1.0)
END, EARLY, WAY = 0.6, 0.25, 0.15  # of the comparison [s], [s], [m]; the foot comes to the bed at about 0.9 s
FINEST = {"slide_submarine": 0.2716, "slide_submarine_contact": 0.2716, "slide_submarine_glued": 0.2536}
STOP = 0.665  # way of the guided slide's end, its foot 20 mm above the bed [m]


def law(t: np.ndarray, a: float, u: float) -> np.ndarray:
    """Way [m] of a body that starts with acceleration a and would end with speed u under drag as the speed squared."""
    return u * u / a * np.log(np.cosh(a * t / u))


def best_law(t: np.ndarray, s: np.ndarray) -> tuple[float, float]:
    """Acceleration and final speed of the law that fits best, by a search on ever finer grids."""
    low, high = np.array([0.5, 0.3]), np.array([6.0, 6.0])
    for _ in range(12):
        grid = [np.linspace(a, b, 15) for a, b in zip(low, high, strict=True)]
        misfit = [[((law(t, a, u) - s) ** 2).sum() for u in grid[1]] for a in grid[0]]
        i, j = np.unravel_index(np.argmin(misfit), (15, 15))
        best = np.array([grid[0][i], grid[1][j]])
        span = 0.3 * (high - low)
        low, high = np.maximum(best - span / 2, 0.05), best + span / 2
    return float(best[0]), float(best[1])


def write_motion(folder: Path) -> Path:
    """The table of the prescribed way, that of the theory to the end of the ramp, as it lies in `bodies/models`."""
    t = np.arange(0.0, 1.5, 0.01)
    s = way_of(t)
    table, file = np.stack([t, s], 1)[s <= STOP], Path(folder, "slide_submarine_down_slope.csv")
    np.savetxt(file, table, fmt="%.6f", delimiter=",", header="time [s],down_slope [m]", comments="")
    return file


class Way(Pictured):
    """The way of the slide, the force that is needed besides, and the surface at the times of the experiment."""

    moments, colour, window = MOMENTS, "speed", ((0.4, 4.0), (-1.0, 0.3))

    def begin(self, sim: Simulation) -> None:
        self.name, self.start = sim.scene.name, sim.bodies.motion().position[0]
        self.time, self.way, self.speed, self.load, self.leaks = [0.0], [0.0], [0.0], [0.0], 0
        self.glued = sim.glue.mass if sim.glue else 0.0
        self.theory = None

    def sample(self, sim: Simulation) -> None:
        motion = sim.bodies.motion()
        moved = motion.position[0] - self.start
        self.time.append(sim.time)
        self.way.append(S * (moved[0] - moved[2]))
        self.speed.append(S * (motion.velocity[0, 0] - motion.velocity[0, 2]))
        along = force(sim)[0]
        self.load.append(S * (along[0] - along[2]))  # of the water, down the ramp
        self.leaks = sim.fluid.lost

    def series(self) -> tuple[np.ndarray, np.ndarray]:
        t, s = np.array(self.time), np.array(self.way)
        return t[t <= END], s[t <= END]

    def drive(self) -> float:
        """Mean force along the ramp that leads the slide, over `EARLY` [N/m]."""
        t, load = np.array(self.time), np.array(self.load)
        early = t <= EARLY
        impulse = (load[early][1:] * np.diff(t[early])).sum()
        end = t[early][-1]
        return (MASS * self.speed[int(early.sum()) - 1] - impulse) / end - MASS * G * S

    def errors(self) -> dict[str, float]:
        if self.name.endswith("prescribed"):
            return {"drive": self.drive() / PULL, "leaks": float(self.leaks)}
        t, s = self.series()
        early = s <= WAY
        return {
            "law": float(np.sqrt(((law(t, *best_law(t, s)) - s) ** 2).mean()) / s[-1]),
            "theory": float(np.abs(s - way_of(t, self.glued))[early].max() / WAY),
            "displacement": float(np.interp(0.5, t, s) / FINEST[self.name] - 1),
            "leaks": float(self.leaks),
        }

    def charts(self) -> list[Chart]:
        t, s = self.series()
        if self.name.endswith("prescribed"):
            time = np.array(self.time)
            shown = time <= END  # the stop at the end of the ramp is two hundred times as large
            needed = MASS * np.gradient(self.speed, time)
            lines = [("water and weight", time[shown][1:], MASS * G * S + np.array(self.load)[shown][1:])]
            lines += [("mass times acceleration", time[shown], needed[shown])]
            title = "Force down the ramp on the slide; the difference is what leads it"
            return [Chart("force", title, "time [s]", "force [N/m]", tuple(lines))]
        a, u = best_law(t, s)
        lines = [("run", self.time, self.way), ("rigid body, added mass and drag fitted", t, law(t, a, u))]
        lines += [("rigid body, added mass of potential flow", t, way_of(t, self.glued))]
        title = f"Way down the ramp; fit: a = {a:.2f} m/s2, u = {u:.2f} m/s"
        return [Chart("way", title, "time [s]", "way [m]", tuple(lines))]


def _case(name: str, title: str, target: dict, reference: str = "", reasons: str = "") -> Case:
    reference = reference or (
        "Rigid-body theory: constant added mass and drag (Grilli & Watts 1999), best fit over 0.6 s (law); added mass of"
        " potential flow and the drag of a plate over the first 0.15 m (theory). The way after 0.5 s against that at a spacing"
        " of 7.5 mm."
    )
    title = f"A triangular slide of 2000 kg/m3 on a ramp of 45 degrees in water 1 m deep: {title}"
    target |= {"leaks": 0.0}
    return Case(
        name, title, reference + " Case of Heinrich (1992).", spacings(name), builder(name), Way, target, reasons
    )


FREE = {"law": 0.03, "theory": 0.1, "displacement": 0.05}

NAMES = ("slide_submarine", "slide_submarine_contact", "slide_submarine_glued", "slide_submarine_prescribed")
CASES = {
    case.name: case
    for case in (
        _case("slide_submarine", "guided", FREE.copy()),
        _case("slide_submarine_contact", "free by contact", FREE.copy()),
        _case(
            "slide_submarine_glued",
            "free, with two layers of fluid glued to it",
            FREE.copy(),
            reasons="At the coarse level the layers are 5 cm thick on a slide of 35 cm; theory counts their mass"
            " and not that they make the body larger. Medium: 8.7 %; at a spacing of 7.5 mm 7.5 %.",
        ),
        _case(
            "slide_submarine_prescribed",
            "led down as theory has it",
            {"drive": 0.1},
            "Rigid-body theory: led on its own way, the slide needs no force besides its weight and the water's; mean of the"
            " first 0.25 s, as a share of its weight in water along the ramp.",
        ),
    )
}
