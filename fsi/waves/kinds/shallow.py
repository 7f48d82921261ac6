"""Waves from a series of a shallow-water code: the piston that lets through what flowed over a line there."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from fsi.errors import SceneError
from fsi.parts import FilePath, NonNegative
from fsi.tables import read_table
from fsi.waves.kind import Fault, Surface, Water, WaveKind, resolved
from fsi.waves.kinds.table import TablePiston, natural_spline

FINER = 4  # knots of the path between two rows
STILL = 0.02  # of the largest speed, that the record may begin and end with
SLOWEST, FASTEST = 0.5, 2.0  # speed of its waves over sqrt(g depth)
HEADS = {  # what the third column is called, by what it carries
    "speed": re.compile(r"\b(speed|velocity|u|u_mean)\b|\bm/s\b", re.IGNORECASE),
    "flux": re.compile(r"\b(flux|discharge|q|qx|hu)\b|\bm(2|\^2|\*\*2|²)/s\b", re.IGNORECASE),
}


class Waves(WaveKind):
    """Waves that a depth-averaged code has computed at a line: columns time [s], elevation [m], and speed [m/s] or flux
    [m2/s]. The line is where the piston stands at first; its time 0 is `start`. One record, which does not come again."""

    kind: Literal["shallow"]
    file: FilePath
    carries: Literal["speed", "flux"] = (
        "speed"  # the third column: depth-averaged speed, or flux through the whole depth
    )
    start: NonNegative = 0.0  # when the record begins [s]

    def piston(self, depth: float, g: float) -> SeriesPiston:
        return SeriesPiston(read_series(self.file, self.carries, depth), g, self.start)

    def faults(self, water: Water) -> Iterator[Fault]:
        if not self.file.is_file():
            yield "waves.file", f"no such file: {self.file}", "check the path; it is relative to the scene file"
            return
        try:
            series = read_series(self.file, self.carries, water.depth)
        except SceneError as error:
            yield error.key or "waves.file", error.fault, error.fix
            return
        if np.ptp(series.speed) == 0:
            yield "waves.file", f"{self.file.name}: the water never moves", "give a record with waves in it"
            return
        last, end = series.speed[-1], self.piston(water.depth, water.g).end
        if abs(last) > STILL * np.abs(series.speed).max() and end < water.duration:
            yield (
                "waves.file",
                f"{self.file.name}: the record is too short, it ends at {series.time[-1]:g} s with the water at {last:.3g} m/s,"
                f" and the run goes on for {water.duration - end:.3g} s",
                f"give a longer record, or set duration to {end:.4g} s or less",
            )

    def warnings(self, water: Water) -> Iterator[str]:
        series = read_series(self.file, self.carries, water.depth)
        yield from resolved(water, "the wave height", float(np.ptp(series.elevation)), 4)
        most = np.abs(series.speed).max()
        for word, u in (("begins", series.speed[0]), ("ends", series.speed[-1])):
            if abs(u) > STILL * most:
                yield f"waves.file: the record {word} at {u:.3g} m/s, and the piston stands still there"
        pace = series.pace(water.g)
        if not SLOWEST <= pace <= FASTEST:
            yield (
                f"waves.file: its flux over its elevation is {pace:.2g} of sqrt(g depth), the speed of long waves; "
                f"check that {self.carries!r} is what column 3 carries, and its units"
            )

    def figures(self, water: Water) -> Iterator[str]:
        piston = self.piston(water.depth, water.g)
        series, (low, high) = piston.series, piston.excursion
        yield (
            f"a record of {np.ptp(series.time):.4g} s, elevation {series.elevation.min():.3g} to "
            f"{series.elevation.max():.3g} m, waves that run at {piston.celerity:.3g} m/s; path {low:.3g} to {high:.3g} m"
        )

    def surface(self, motion: SeriesPiston, depth: float, g: float) -> Surface:
        series = motion.series

        def elevation(t: float, x: float) -> float:
            when = t - motion.start - x / motion.celerity
            return float(np.interp(when, series.time, series.elevation, left=0.0, right=0.0))

        return elevation


@dataclass(frozen=True)
class Series:
    """Rows at a line in water of this depth [m]: time [s] from 0, elevation [m], depth-averaged speed [m/s], each (n,)."""

    time: np.ndarray
    elevation: np.ndarray
    speed: np.ndarray
    depth: float

    def celerity(self, g: float) -> float:
        """Speed of its waves [m/s]: flux over elevation in least squares, which is exact for a wave of permanent form and
        sqrt(g depth) for long waves; within half and twice of that, where waves come back over the line."""
        return float(np.clip(self.pace(g), SLOWEST, FASTEST)) * math.sqrt(g * self.depth)

    def pace(self, g: float) -> float:
        """Flux over elevation in least squares, over sqrt(g depth); 1 where the surface does not move."""
        weight = float((self.elevation**2).sum())
        flux = self.speed * (self.depth + self.elevation)
        return float((flux * self.elevation).sum()) / weight / math.sqrt(g * self.depth) if weight else 1.0


def read_series(file: Path, carries: str, depth: float) -> Series:
    """The series of a file, for water of this depth [m]. Raises SceneError, which names file, row and column."""
    try:
        rows = read_table(file, ("time", "elevation", carries), 3)
    except SceneError as error:
        raise SceneError(f"{file.name}: {error.fault}", key="waves.file", fix=error.fix) from None
    time, elevation, third = rows.T
    head = file.read_text(encoding="utf-8-sig").partition("\n")[0].split(",")[-1].strip()
    other = next(name for name in HEADS if name != carries)
    if HEADS[other].search(head) and not HEADS[carries].search(head):
        fault = f"{file.name}: column 3 is called {head!r}, and waves.carries has it as {carries}"
        raise SceneError(fault, key="waves.carries", fix=f"set it to {other!r}, or call the column {carries}")
    if elevation.min() <= -depth:
        row = int(elevation.argmin())
        fault = (
            f"{file.name}: column elevation: {elevation[row]:g} m at {time[row]:g} s is below the bed, {depth:g} m deep"
        )
        raise SceneError(
            fault, key="waves.file", fix="give elevations over still water, at a line as deep as the piston"
        )
    speed = third / (depth + elevation) if carries == "flux" else third
    return Series(time - time[0], elevation, speed, depth)


class SeriesPiston(TablePiston):
    """The piston moves with the water under it, X' = u(t - X / c): where it is, the record of its first place comes later by
    the way X at the speed c of the waves (Goring 1978, for a wave of any shape). Its path is a cubic spline.

    It waits until `start` [s] and stays where the record ends, at `end`.
    """

    def __init__(self, series: Series, g: float, start: float = 0.0):
        self.series, self.start, self.celerity = series, start, series.celerity(g)
        self.t, self.x = self._path()
        self.curvature = natural_spline(self.t, self.x)
        self.excursion, self.end = (float(self.x.min()), float(self.x.max())), float(self.t[-1])

    def _path(self) -> tuple[np.ndarray, np.ndarray]:
        """Times and places, by the Runge-Kutta method of the fourth order."""
        time, speed, c = self.series.time, self.series.speed, self.celerity
        knots = np.interp(np.arange(FINER * (len(time) - 1) + 1) / FINER, np.arange(len(time)), time)
        last = time[-1] + max(float(np.trapezoid(speed, time)), 0.0) / c  # when its end reaches the piston
        step = (time[-1] - time[0]) / (FINER * (len(time) - 1))
        t = np.append(knots, np.arange(time[-1] + step, last + 2 * step, step))

        def u(when: float, place: float) -> float:
            return float(np.interp(when - place / c, time, speed, left=0.0, right=0.0))

        x = np.zeros(len(t))
        for n, (now, h) in enumerate(zip(t[:-1], np.diff(t), strict=True)):
            k1 = u(now, x[n])
            k2 = u(now + 0.5 * h, x[n] + 0.5 * h * k1)
            k3 = u(now + 0.5 * h, x[n] + 0.5 * h * k2)
            k4 = u(now + h, x[n] + h * k3)
            x[n + 1] = x[n] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return t + self.start, x
