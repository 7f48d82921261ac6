"""A measured elevation: the piston that makes at a gauge what was recorded there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fsi.errors import SceneError
from fsi.parts import FilePath, NonNegative, Positive
from fsi.tables import read_table
from fsi.waves.incident import IncidentWaves
from fsi.waves.kind import Fault, Surface, Train, Water, WaveKind, resolved
from fsi.waves.kinds.irregular import IrregularPiston, sea_surface
from fsi.waves.linear import piston_transfer, wavenumber

TAPER = 0.05  # share of the record at either end over which it rises from and falls to zero
LOW, HIGH = 0.3, 3.0  # band that is kept [frequency at the peak]


class Waves(WaveKind):
    """Waves out of a record of the elevation at a gauge, columns time [s] and elevation [m], by linear theory: every component
    goes back from the gauge to the piston at its own speed. The record comes again after its length."""

    kind: Literal["measured"]
    file: FilePath
    distance: NonNegative  # of the gauge from the piston's mean position [m]
    delay: NonNegative | None = (
        None  # time in the run at which the record begins at the gauge [s]; if None, when its waves get there
    )
    lowest: Positive | None = None  # frequency from which on it is made [Hz]; 0.3 of that at the peak if not given
    highest: Positive | None = None  # up to which [Hz]; 3 times that at the peak if not given
    ramp: NonNegative | None = None  # cosine ramp of the piston [s]; a period at the peak if not given

    def piston(self, depth: float, g: float) -> RecordPiston:
        sea, _ = self._sea(depth, g)
        return sea

    def incident(self, depth: float, g: float) -> IncidentWaves:
        return self.piston(depth, g).incident(depth, g)

    def _sea(self, depth: float, g: float) -> tuple[RecordPiston, float]:
        """The piston, and the delay [s]."""
        f, amplitude, phase, length = self._components()
        peak = _peak(f, amplitude)
        omega = 2 * math.pi * f
        k = np.array([wavenumber(w, depth, g) for w in omega])
        transfer = np.array([piston_transfer(x * depth) for x in k])
        ramp = 1 / peak if self.ramp is None else self.ramp
        delay = self.delay
        if delay is None:  # the group of the shortest waves is the slowest
            n = 0.5 * (1 + 2 * k[-1] * depth / math.sinh(min(2 * k[-1] * depth, 600)))
            delay = ramp + self.distance / (n * omega[-1] / k[-1])
        angle = phase + k * self.distance - omega * delay
        return RecordPiston(amplitude / transfer, amplitude, omega, angle, ramp, length), delay

    def _components(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Frequency [Hz], amplitude [m] and phase of cosines of the record, and its length [s]."""
        rows = read_table(self.file, ("time", "elevation"), 16)
        step = float(np.median(np.diff(rows[:, 0])))
        time = np.arange(rows[0, 0], rows[-1, 0] + 0.5 * step, step)
        eta = np.interp(time, rows[:, 0], rows[:, 1])
        eta = (eta - eta.mean()) * _taper(len(eta))
        found, f = np.fft.rfft(eta), np.fft.rfftfreq(len(eta), step)
        size = np.abs(found)
        if np.ptp(rows[:, 1]) <= 1e-9 * np.abs(rows[:, 1]).max():
            raise SceneError("the elevation never changes", key="waves.file", fix="give a record with waves in it")
        peak = _peak(f[1:], size[1:])
        low, high = self.lowest or LOW * peak, self.highest or HIGH * peak
        kept = (f > 0) & (f >= low) & (f <= high)
        if not kept.any():
            fault = f"no component lies between {low:.3g} and {high:.3g} Hz"
            raise SceneError(fault, key="waves.highest", fix=f"choose a band around the peak, {peak:.3g} Hz")
        return f[kept], 2 * size[kept] / len(eta), np.angle(found[kept]), len(eta) * step

    def trains(self, water: Water) -> list[Train]:
        f, amplitude, *_ = self._components()
        return [Train("at the peak", 4 * math.sqrt(0.5 * float((amplitude**2).sum())), 1 / _peak(f, amplitude))]

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        f, amplitude, *_ = self._components()
        return [(2 * a, 1 / x) for a, x in zip(amplitude.tolist(), f.tolist(), strict=True)]

    def faults(self, water: Water) -> Iterator[Fault]:
        if not self.file.is_file():
            yield "waves.file", f"no such file: {self.file}", "check the path; it is relative to the scene file"
            return
        try:
            self._components()
        except SceneError as error:
            yield error.key or "waves.file", error.fault, error.fix

    def warnings(self, water: Water) -> Iterator[str]:
        f, amplitude, *_ = self._components()
        yield from resolved(water, "Hm0", 4 * math.sqrt(0.5 * float((amplitude**2).sum())), 4)
        yield from resolved(water, "the shortest wave", water.length(1 / float(f[-1])), 10)

    def figures(self, water: Water) -> Iterator[str]:
        yield from super().figures(water)
        sea, delay = self._sea(water.depth, water.g)
        yield f"the record of {sea.length:.4g} s begins at the gauge, {self.distance:g} m from the piston, at {delay:.3g} s"

    def surface(self, motion, depth: float, g: float) -> Surface:
        return sea_surface(motion, depth, g)


@dataclass(frozen=True)
class RecordPiston(IrregularPiston):
    """The piston of a record that comes again after `length` [s]."""

    length: float = 0.0

    @property
    def excursion(self) -> tuple[float, float]:
        times = np.linspace(0.0, self.length, 8 * len(self.omega) + 1)
        x = np.array([float(self.amplitude @ np.sin(self.omega * t + self.phase)) for t in times])
        return min(1.05 * float(x.min()), 0.0), max(1.05 * float(x.max()), 0.0)


def _peak(f: np.ndarray, amplitude: np.ndarray) -> float:
    """Frequency at the peak [Hz], weighted by the fourth power of the energy (Young 1995), which is steady for raw spectra."""
    weight = amplitude**8 / (amplitude**8).max()
    return float((f * weight).sum() / weight.sum())


def _taper(count: int) -> np.ndarray:
    edge = max(1, int(TAPER * count))
    rise = 0.5 * (1 - np.cos(np.pi * (np.arange(edge) + 0.5) / edge))
    window = np.ones(count)
    window[:edge], window[-edge:] = rise, rise[::-1]
    return window
