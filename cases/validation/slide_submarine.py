"""A triangular slide runs down a submerged ramp of 45 degrees, free, in two dimensions.

Case of Heinrich (1992), J. Waterway Port Coast. Ocean Eng. 118, 249-266: 2000 kg/m3 in water 1 m deep; surfaces at 0.5 and
1.0 s, of which the sources at hand have pictures only. The reference is rigid-body theory: with the weight in water and a
constant added mass and drag, the way down the ramp is s = u^2 / a ln cosh(a t / u) of the initial acceleration a and the
final speed u (Grilli & Watts 1999, Eng. Anal. Bound. Elem. 23, 645-656). `law` is the root mean square misfit of the best
such curve, as a share of the way; `displacement` compares the way after 0.5 s with that at the finest level.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.case import Case
from cases.validation.pictures import Chart, Pictured
from cases.validation.scenes import builder, spacings
from fsi.simulation import Simulation

MASS, BUOYANCY, G = 250.0, 125.0, 9.81  # [kg/m], [kg/m] of water displaced, [m/s2]
PULL = (MASS - BUOYANCY) * G * math.sin(math.radians(45))  # [N/m]
MOMENTS = (0.5, 1.0)
END = 0.6  # of the comparison [s]; the foot comes to the bed at about 0.9 s
FINEST = 0.2704  # way after 0.5 s at a spacing of 10 mm [m], by this solver


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


class Way(Pictured):
    """The way of the slide, and the surface at the times of the experiment."""

    moments, colour, window = MOMENTS, "speed", ((0.4, 4.0), (-1.0, 0.3))

    def begin(self, sim: Simulation) -> None:
        self.time, self.way, self.leaks = [0.0], [0.0], 0

    def sample(self, sim: Simulation) -> None:
        self.time.append(sim.time)
        self.way.append(float(sim.bodies.joints()["joint_position"][0]))
        self.leaks = sim.fluid.lost

    def fitted(self) -> tuple[np.ndarray, np.ndarray, float, float]:
        t, s = np.array(self.time), np.array(self.way)
        t, s = t[t <= END], s[t <= END]
        return t, s, *best_law(t, s)

    def errors(self) -> dict[str, float]:
        t, s, a, u = self.fitted()
        return {
            "law": float(np.sqrt(((law(t, a, u) - s) ** 2).mean()) / s[-1]),
            "displacement": float(np.interp(0.5, t, s) / FINEST - 1),
            "leaks": float(self.leaks),
        }

    def charts(self) -> list[Chart]:
        t, _, a, u = self.fitted()
        return [
            Chart(
                "way", f"Way down the ramp; law of a = {a:.2f} m/s2 (added mass {PULL / a - MASS:.0f} kg/m), u = {u:.2f} m/s",
                "time [s]", "way [m]", (("run", self.time, self.way), ("rigid body with drag", t, law(t, a, u))),
            )
        ]  # fmt: skip


CASES = {
    "slide_submarine": Case(
        "slide_submarine",
        "A triangular slide of 2000 kg/m3 runs down a ramp of 45 degrees in water 1 m deep",
        "Rigid-body theory with constant added mass and drag (Grilli & Watts 1999), best fit over 0.6 s; the way after 0.5 s"
        " against the finest level (self-convergence). Case of Heinrich (1992).",
        spacings("slide_submarine"),
        builder("slide_submarine"),
        Way,
        {"law": 0.03, "displacement": 0.05, "leaks": 0.0},
    )
}
