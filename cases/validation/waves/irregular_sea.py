"""A JONSWAP sea in a flume that ends in a damping zone, kd = 1.2 at the peak.

Exact: the asked Hm0 and peak period, from the elevation at a gauge 1.2 lengths of the peak from the piston over 20 peak
periods. A record so short has an Hm0 of its own, some per cent off the sea's: the seed is one whose components, added up
by linear theory at the gauge, have the asked figures over the record within 1 %.
"""

from __future__ import annotations

import math

import numpy as np

from cases.validation.engine.case import Case, Measure
from cases.validation.theory.separation import group_speed
from cases.validation.waves.wavemaker import FLUME
from fsi.fluid.gauges import elevation
from fsi.simulation.loop import Simulation
from fsi.waves import piston, wavenumber
from fsi.waves.kinds.irregular import Waves as IrregularWaves

G, DEPTH = 9.81, 0.3
WAVES = IrregularWaves(kind="irregular", Hm0=0.045, peak_period=1.1, highest=2.0, seed=103)
LENGTH = 2 * math.pi / wavenumber(2 * math.pi / WAVES.peak_period, DEPTH, G)
GAUGE, SPONGE, END = 1.2 * LENGTH, 1.4 * LENGTH, 2.6 * LENGTH
RECORD = 20 * WAVES.peak_period
SLOWEST = group_speed(wavenumber(2 * math.pi * WAVES.highest / WAVES.peak_period, DEPTH, G), DEPTH, G)
START = 2 * WAVES.peak_period + GAUGE / SLOWEST  # the ramp, and the way of the shortest waves


def linear_elevation(t: np.ndarray, x: float) -> np.ndarray:
    """Elevation [m] at the distance x [m] from the piston by linear theory, after the ramp."""
    sea = piston(WAVES, DEPTH, G)
    k = np.array([wavenumber(w, DEPTH, G) for w in sea.omega])
    return np.cos(np.outer(t, sea.omega) + sea.phase - k * x) @ sea.wave_amplitude


def sea_state(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Hm0 = 4 sqrt(m0) [m], and the peak period [s] as the mean of 1/f weighted by the fourth power of the spectrum
    (Young 1995), of the part of the evenly sampled elevation y(t) between 0.5 and 2 peak frequencies of the asked sea."""
    f = np.fft.rfftfreq(len(y), t[1] - t[0])
    density = np.abs(np.fft.rfft(y - y.mean())) ** 2
    sea = (f > 0.45 / WAVES.peak_period) & (f < 1.1 * WAVES.highest / WAVES.peak_period)
    energy = 2 * density[sea].sum() / len(y) ** 2
    smooth = np.convolve(density, np.ones(3) / 3, "same")[sea]
    return 4 * math.sqrt(energy), float((smooth**4).sum() / (f[sea] * smooth**4).sum())


class Sea(Measure):
    """The elevation at the gauge."""

    interval = WAVES.peak_period / 40

    def begin(self, sim: Simulation) -> None:
        self.time, self.elevation = [], []

    def sample(self, sim: Simulation) -> None:
        if sim.time >= START:
            self.time.append(sim.time)
            dr, h = sim.scene.spacing, sim.scene.smoothing_length
            self.elevation.append(elevation(sim.fluid.position, np.array([GAUGE]), dr, h))

    def errors(self) -> dict[str, float]:
        t = START + np.linspace(0, RECORD, round(RECORD / self.interval), endpoint=False)
        height, period = sea_state(t, np.interp(t, self.time, self.elevation))
        return {"Hm0": height / WAVES.Hm0 - 1, "peak_period": period / WAVES.peak_period - 1}


def scene(spacing: float, folder) -> dict:
    end = math.ceil(END / spacing) * spacing
    return {
        "duration": START + RECORD,
        "tank": {"min": [0.0, -DEPTH], "max": [end, 2 * WAVES.Hm0]},
        "waves": WAVES.model_dump(exclude_none=True),
        "damping": [{"start": SPONGE, "end": end, "rate": 2.5 * 2 * math.pi / WAVES.peak_period}],
        "numerics": FLUME,
    }


NAMES = ("irregular_sea",)
CASES = {
    "irregular_sea": Case(
        "irregular_sea",
        "A JONSWAP sea of 20 peak periods",
        "Exact: the asked significant wave height and peak period; the linear record of this seed has both.",
        {level: WAVES.Hm0 / per_height for level, per_height in (("coarse", 4), ("medium", 8), ("paper", 16))},
        scene,
        Sea,
        {"Hm0": 0.05, "peak_period": 0.03},
    )
}
