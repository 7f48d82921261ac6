"""An irregular sea of second order in a box, kd = 1.6 at the peak, without a body.

Exact: the elevation of the incident waves themselves, at the same places and times (`fsi.waves.second_order`): the box makes
the sea of its seed, wave by wave. `Hm0`: the standard deviation over theory's; `record`: root mean square of the difference
over theory's standard deviation; `shape`: the same of the spectra in bands of a fifth of the peak frequency; `crests`: mean of
the highest third of the crests over theory's. `sea_irregular_30min` runs half an hour of it, 1500 peak periods.
"""

from __future__ import annotations

import itertools
import math
from functools import partial

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.engine.pictures import Chart
from cases.validation.waves.wavemaker import SEA
from fsi.fluid.gauges import elevation
from fsi.scene.geometry import incident_waves
from fsi.simulation.loop import Simulation
from fsi.waves.linear import wavenumber

G, DEPTH, HM0, PEAK = 9.81, 0.5, 0.08, 1.2
LENGTH = 2 * math.pi / wavenumber(2 * math.pi / PEAK, DEPTH, G)
BEGIN, PERIODS = 4, 40  # peak periods: of the record, until the end
HALF_HOUR = 1800.0  # [s]
PLACES = LENGTH * np.array([-0.4, 0.0, 0.4])


def crests(y: np.ndarray) -> float:
    """Mean of the highest third of the crests between upward crossings of the mean, of an even record y (n,)."""
    y = y - y.mean()
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    found = np.sort([y[a:b].max() for a, b in itertools.pairwise(up)])
    return float(found[-max(1, len(found) // 3) :].mean())


def bands(y: np.ndarray, step: float) -> np.ndarray:
    """Energy of records y (n, m) in bands of a fifth of the peak frequency."""
    f = np.fft.rfftfreq(len(y), step) * PEAK
    density = (np.abs(np.fft.rfft(y - y.mean(0), axis=0)) ** 2).sum(1)
    return np.histogram(f, np.arange(0.1, 3.6, 0.2), weights=density)[0]


class Record(Measure):
    """Elevation at three places, and that of the incident waves."""

    interval = PEAK / 30

    def begin(self, sim: Simulation) -> None:
        self.time, self.found, self.exact, self.waves = [], [], [], incident_waves(sim.scene)

    def sample(self, sim: Simulation) -> None:
        if sim.time < BEGIN * PEAK:
            return
        fluid, dr, h = sim.fluid, sim.scene.spacing, sim.scene.smoothing_length
        self.time.append(sim.time)
        self.found.append([elevation(fluid.position, np.array([x]), dr, h, fluid.boundary) for x in PLACES])
        self.exact.append(self.waves.elevation(sim.time, PLACES[:, None]))

    def records(self) -> tuple[np.ndarray, np.ndarray]:
        """Elevation of the run and of the incident waves (n, places) [m], `interval` apart."""
        t = np.arange(self.time[0], self.time[-1], self.interval)
        rows = np.transpose([self.found, self.exact], (0, 2, 1))
        found, exact = (np.stack([np.interp(t, self.time, column) for column in columns], 1) for columns in rows)
        return found, exact

    def charts(self) -> list[Chart]:
        found, exact = self.records()
        f = np.arange(0.2, 3.5, 0.2)
        shapes, whole = (("run", found), ("incident waves", exact)), bands(exact, self.interval).sum()
        points = tuple((name, f, bands(y, self.interval) / whole) for name, y in shapes)
        last = slice(-round(20 * PEAK / self.interval), None)
        t = self.time[-1] + self.interval * np.arange(-len(found), 0)[last]
        lines = tuple((name, t, y[last, 1] - y[:, 1].mean()) for name, y in shapes)
        return [
            Chart("spectrum", "Energy by frequency", "frequency over the peak's", "share", points=points),
            Chart("record", "Elevation in the middle, the last 20 peak periods", "time [s]", "elevation [m]", lines),
        ]

    def errors(self) -> dict[str, float]:
        found, exact = self.records()
        off = found - found.mean(0) - exact + exact.mean(0)
        energy, theory = bands(found, self.interval), bands(exact, self.interval)
        return {
            "Hm0": float(found.std(0).mean() / exact.std(0).mean() - 1),
            "record": float(off.std() / exact.std()),
            "shape": float(np.sqrt(((energy - theory) ** 2).sum() / (theory**2).sum())),
            "crests": np.mean([crests(a) / crests(b) for a, b in zip(found.T, exact.T, strict=True)]) - 1,
        }


def scene(spacing: float, folder, duration: float = PERIODS * PEAK) -> dict:
    half = round(LENGTH / spacing) * spacing
    waves = {"kind": "irregular", "Hm0": HM0, "peak_period": PEAK, "components": 40, "highest": 2.0, "seed": 5}
    return {
        "duration": duration,
        "tank": {"min": [-half, -DEPTH], "max": [half, math.ceil(2 * HM0 / spacing) * spacing]},
        "sea": {"waves": waves, "order": 2},
        "numerics": SEA,
    }


def _case(name: str, title: str, scene) -> Case:
    return Case(
        name,
        f"A JONSWAP sea of second order in a box, {title}, 2D",
        "The incident waves of the same seed, of second order (Sharma and Dean 1981).",
        {level: HM0 / n for level, n in (("coarse", 4), ("medium", 8), ("paper", 16))},
        scene,
        Record,
        {"Hm0": 0.02, "record": 0.2, "shape": 0.1, "crests": 0.05},
        fails_when={
            "record": Wrong("another seed", 0.5),
            "shape": Wrong("the spectrum of Pierson and Moskowitz of the same height", 0.3),
            "crests": Wrong("crests of linear theory", -0.08),
        },
    )


NAMES = ("sea_irregular", "sea_irregular_30min")
CASES = {
    "sea_irregular": _case("sea_irregular", "36 peak periods", scene),
    "sea_irregular_30min": _case("sea_irregular_30min", "half an hour", partial(scene, duration=HALF_HOUR)),
}
