"""A solitary wave from a piston (Goring 1978), 0.3 of the depth high, over 20 depths of a flat bed.

Exact: the wave keeps its height, and travels at sqrt(g (d + H)) (Rayleigh 1876; the exact speed of a wave of this height,
Longuet-Higgins & Fenton 1974, is 0.2 % lower). Heights and times of the crest are those of a parabola through the top
tenth of the elevation at gauges 5 and 25 depths from the piston's start; the far wall's reflection is not back by then.

`solitary_wave`: the piston's path is Goring's own. `solitary_series`: it follows a series of elevation and flux of the same
wave, as a depth-averaged code would write it at the piston's first place.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case
from cases.validation.engine.pictures import Chart, Pictured
from fsi.fluid.gauges import elevation
from fsi.simulation.loop import Simulation
from fsi.waves.kinds.solitary import SolitaryPiston

G, DEPTH, HEIGHT = 9.81, 0.2, 0.3  # the height in depths
GAUGES = np.array([5.0, 25.0]) * DEPTH
SPEED = math.sqrt(G * DEPTH * (1 + HEIGHT))
LENGTH = 34 * DEPTH


def crest(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Time and height of the highest crest of y, from a parabola through what lies above 0.9 of it around it."""
    top = int(y.argmax())
    below = np.flatnonzero(y < 0.9 * y[top])
    first, last = below[below < top].max(initial=-1) + 1, below[below > top].min(initial=len(y))
    near = slice(first, last)
    a, b, c = np.polyfit(t[near] - t[top], y[near], 2)
    return float(t[top] - b / (2 * a)), float(c - b * b / (4 * a))


def passing(t: np.ndarray, passed: float, height: float, depth: float) -> np.ndarray:
    """Elevation (n,) [m] at times (n,) [s] of a solitary wave (Rayleigh 1876) whose crest passes at `passed` [s]."""
    speed, kappa = math.sqrt(G * (depth + height)), math.sqrt(0.75 * height / (depth**2 * (depth + height)))
    return height / np.cosh(np.clip(kappa * speed * (t - passed), -50, 50)) ** 2


class Crests(Pictured):
    """Height and time of the crest at the gauges."""

    interval, colour, moments = 0.05 * math.sqrt(DEPTH / G), "u", (2.0, 4.0)

    def begin(self, sim: Simulation) -> None:
        self.time, self.elevation = [], []

    def sample(self, sim: Simulation) -> None:
        dr, h = sim.scene.spacing, sim.scene.smoothing_length
        self.time.append(sim.time)
        self.elevation.append([elevation(sim.fluid.position, np.array([x]), dr, h) for x in GAUGES])

    def charts(self) -> list[Chart]:
        t, y = np.array(self.time), np.array(self.elevation) / DEPTH
        (start, _), lines = crest(t, y[:, 0]), []
        for x, column in zip(GAUGES, y.T, strict=True):
            lines.append((f"run, {x / DEPTH:g} depths", t, column))
            passed = start + (x - GAUGES[0]) / SPEED
            lines.append((f"Rayleigh, {x / DEPTH:g} depths", t, passing(t, passed, HEIGHT * DEPTH, DEPTH) / DEPTH))
        return [Chart("gauges", "Elevation at the gauges", "time [s]", "elevation over depth", tuple(lines))]

    def errors(self) -> dict[str, float]:
        t, y = np.array(self.time), np.array(self.elevation)
        (start, first), (end, last) = (crest(t, column) for column in y.T)
        return {
            "height": first / (HEIGHT * DEPTH) - 1,
            "height_loss": 1 - last / first,
            "speed": (GAUGES[1] - GAUGES[0]) / (end - start) / SPEED - 1,
        }


def scene(spacing: float, folder) -> dict:
    piston = SolitaryPiston(HEIGHT * DEPTH, DEPTH, G)
    passed = 0.5 * piston.time + (GAUGES[1] + 2 * DEPTH) / SPEED  # by the crest, two depths past the second gauge
    return {
        "duration": passed,
        "tank": {"min": [0.0, -DEPTH], "max": [LENGTH, 0.6 * DEPTH]},
        "waves": {"kind": "solitary", "wave_height": HEIGHT * DEPTH},
    }


def write_series(file: Path, height: float, depth: float, passed: float, last: float, rate: float = 50.0) -> None:
    """Write time [s] from 0 to `last`, elevation [m] and flux [m2/s], `rate` rows a second, of a solitary wave (Rayleigh 1876)
    whose crest passes at `passed` [s]; its flux is c eta, as that of every wave of permanent form into still water."""
    t = np.linspace(0.0, last, round(last * rate) + 1)
    eta = passing(t, passed, height, depth)
    rows = np.column_stack([t, eta, math.sqrt(G * (depth + height)) * eta])
    np.savetxt(file, rows, fmt="%.6g", delimiter=",", header="time [s],elevation [m],flux [m2/s]", comments="")


def series_scene(spacing: float, folder: Path) -> dict:
    piston = SolitaryPiston(HEIGHT * DEPTH, DEPTH, G)
    passed = 0.5 * (piston.time - piston.stroke / piston.speed)  # by the crest, at the piston's first place
    write_series(folder / "series.csv", HEIGHT * DEPTH, DEPTH, passed, 2 * passed)
    waves = {"kind": "shallow", "file": str(folder / "series.csv"), "carries": "flux"}
    return scene(spacing, folder) | {"waves": waves}


def _case(name: str, title: str, reference: str, scene) -> Case:
    return Case(
        name,
        title,
        reference,
        {"coarse": DEPTH / 20, "medium": DEPTH / 40, "paper": DEPTH / 80},
        scene,
        Crests,
        {"height": 0.03, "height_loss": 0.03, "speed": 0.01},
    )


NAMES = ("solitary_wave", "solitary_series")
CASES = {
    case.name: case
    for case in (
        _case(
            "solitary_wave",
            "A solitary wave 0.3 of the depth high over 20 depths",
            "Exact: it keeps its height and the speed sqrt(g (d + H)).",
            scene,
        ),
        _case(
            "solitary_series",
            "A solitary wave 0.3 of the depth high, from a series of elevation and flux at a line",
            "Exact: it keeps the series' height and the speed sqrt(g (d + H)).",
            series_scene,
        ),
    )
}
