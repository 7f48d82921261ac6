"""Irregular waves of a spectrum in a file, as buoys and wave models write it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from fsi.errors import SceneError
from fsi.extras import require
from fsi.parts import FilePath, NonNegative, Positive
from fsi.tables import MOST_BYTES, read_table
from fsi.trust import check_bytes
from fsi.waves.incident import IncidentWaves
from fsi.waves.kind import Fault, Surface, Train, Water, WaveKind, resolved
from fsi.waves.kinds.irregular import IrregularPiston, random_sea, sea_surface

BELOW, ABOVE = 0.002, 0.99  # shares of the energy between which the spectrum is made


class Waves(WaveKind):
    """A sea state of the spectrum in a file: many regular waves of linear theory with random frequencies and phases. All
    directions go along the flume."""

    kind: Literal["spectrum"]
    file: FilePath
    format: str = "csv"  # columns frequency [Hz], density [m2/Hz]; or a reader of wavespectra, such as "swan" or "ndbc"
    time: Annotated[int, Field(ge=0)] = 0  # number of the spectrum in a file with several times
    site: Annotated[int, Field(ge=0)] = 0  # the same for places
    scale: Positive = 1.0  # length in nature over length in the run, by Froude's law
    seed: Annotated[int, Field(ge=0)] = 1
    components: Annotated[int, Field(ge=10, le=10_000)] = 200
    ramp: NonNegative | None = None  # [s]; two peak periods if not given

    def piston(self, depth: float, g: float) -> IrregularPiston:
        f, density = self._spectrum()
        m0 = _integral(f, density)
        total = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(f) * (density[1:] + density[:-1]))]) / m0
        low, high = np.interp([BELOW, ABOVE], total, f)
        edges = np.linspace(low, high, self.components + 1)
        ramp = 2 / _peak(f, density) if self.ramp is None else self.ramp
        return random_sea(edges, lambda x: np.interp(x, f, density), 4 * math.sqrt(m0), self.seed, ramp, depth, g)

    def incident(self, depth: float, g: float) -> IncidentWaves:
        return self.piston(depth, g).incident(depth, g)

    def _spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Frequency [Hz] and density [m2/Hz], at the scale of the run. Raises SceneError where the file has none."""
        f, density = self._table() if self.format == "csv" else self._read()
        if not np.isfinite(density).all() or (density < 0).any() or not (density > 0).any() or f[0] < 0:
            raise SceneError(
                "densities must be numbers of 0 or more, and not all 0", key="waves.file", fix="correct the file"
            )
        return f * math.sqrt(self.scale), density / self.scale**2.5

    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        rows = read_table(self.file, ("frequency", "density"), 4)
        return rows[:, 0], rows[:, 1]

    def _read(self) -> tuple[np.ndarray, np.ndarray]:
        library = require("wavespectra", "waves", f"waves.format = {self.format!r}")
        reader = getattr(library, f"read_{self.format}", None)
        if reader is None:
            known = sorted(n.removeprefix("read_") for n in dir(library) if n.startswith("read_"))
            raise SceneError(f"no reader {self.format!r}", key="waves.format", fix=f"known are csv, {', '.join(known)}")
        check_bytes(self.file, MOST_BYTES, "cut it to the time and the site of the waves")
        try:
            found = reader(str(self.file)).spec.oned()
        except Exception as fault:  # every reader has its own
            fix = "check waves.format and the file"
            raise SceneError(f"cannot be read as {self.format}: {fault}", key="waves.file", fix=fix) from None
        for name, number in (("time", self.time), ("site", self.site)):
            if name in found.dims:
                if number >= found.sizes[name]:
                    fix = f"count from 0 to {found.sizes[name] - 1}"
                    raise SceneError(f"the file has {found.sizes[name]} of them", key=f"waves.{name}", fix=fix)
                found = found.isel({name: number})
        if more := [name for name in found.dims if name != "freq"]:
            fix = "bring one place and time into a file of its own, or into a CSV"
            raise SceneError(f"the spectra also run along {', '.join(more)}", key="waves.file", fix=fix)
        return np.asarray(found.freq.values, float), np.asarray(found.values, float)

    def trains(self, water: Water) -> list[Train]:
        f, density = self._spectrum()
        return [Train("at the peak", 4 * math.sqrt(_integral(f, density)), 1 / _peak(f, density))]

    def linear_waves(self, depth: float, g: float) -> list[tuple[float, float]]:
        sea = self.piston(depth, g)
        return [(2 * a, 2 * math.pi / w) for a, w in zip(sea.wave_amplitude, sea.omega, strict=True)]

    def faults(self, water: Water) -> Iterator[Fault]:
        if not self.file.is_file():
            yield "waves.file", f"no such file: {self.file}", "check the path; it is relative to the scene file"
            return
        try:
            self._spectrum()
        except SceneError as error:
            yield error.key or "waves.file", error.fault, error.fix

    def warnings(self, water: Water) -> Iterator[str]:
        sea = self.piston(water.depth, water.g)
        yield from resolved(water, "Hm0", 4 * math.sqrt(0.5 * float((sea.wave_amplitude**2).sum())), 4)
        yield from resolved(water, "the shortest wave", water.length(2 * math.pi / float(sea.omega.max())), 10)

    def surface(self, motion, depth: float, g: float) -> Surface:
        return sea_surface(motion, depth, g)


def _integral(f: np.ndarray, density: np.ndarray) -> float:
    return float((0.5 * np.diff(f) * (density[1:] + density[:-1])).sum())


def _peak(f: np.ndarray, density: np.ndarray) -> float:
    return float(f[int(density.argmax())])
