"""Measures that also draw: snapshots of the particles at given times and series over reference points, as the pages that
`fsi validate CASE --figures` writes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np

from cases.report.charts import canvas, legend
from cases.report.page import Page
from cases.validation.engine.case import Case, Measure, Row
from cases.validation.engine.report import cells, headings
from fsi.simulation.loop import Simulation

UNITS = {"speed": "speed [m/s]", "pressure": "pressure [kPa]", "u": "horizontal velocity [m/s]"}


@dataclass(frozen=True)
class Chart:
    """Lines and reference points over one x: each is (name, x, y)."""

    name: str
    title: str
    xlabel: str
    ylabel: str
    lines: tuple = ()
    points: tuple = ()


@dataclass(frozen=True)
class Shot:
    """Particles at one time: position (n, 2) [m] and velocity (n, 2) [m/s] in (x, z), values (n,), whether they are of another
    liquid than the first (n,), solid (b, 2) what is not fluid."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    values: np.ndarray
    other: np.ndarray
    solid: np.ndarray


class Pictured(Measure):
    """A measure that keeps snapshots at `moments` [s], coloured by `colour`, of what lies within `window`, ((x, x),
    (z, z)) [m]; in three dimensions those within one spacing of the plane y = `plane`. With `arrows` [m] velocities are
    drawn that far apart."""

    moments: tuple[float, ...] = ()
    colour = "speed"
    window: tuple | None = None
    plane = 0.0
    arrows = 0.0

    def __init__(self, sim: Simulation):
        self.shots: list[Shot] = []
        self.spacing = sim.scene.spacing
        super().__init__(sim)

    def __call__(self, sim: Simulation) -> None:
        super().__call__(sim)
        if len(self.shots) < len(self.moments) and sim.time >= self.moments[len(self.shots)] - 0.5 * sim.dt:
            self.shots.append(self._shot(sim))

    def charts(self) -> list[Chart]:
        """Curves of the run over the reference."""
        return []

    def _shot(self, sim: Simulation) -> Shot:
        fluid = sim.fluid
        solid = fluid.boundary[fluid.of_owner(0).start :]
        values = {
            "speed": lambda: np.sqrt((fluid.velocity**2).sum(1)),
            "pressure": lambda: 1e-3 * fluid.pressure_values,
            "u": lambda: fluid.velocity[:, 0].copy(),
        }[self.colour]()
        keep, kept = self._seen(sim, fluid.position), self._seen(sim, solid)
        position, velocity = (array[keep][:, [0, -1]] for array in (fluid.position, fluid.velocity))
        other = np.zeros(fluid.count, bool) if fluid.liquid is None else fluid.liquid[fluid.label] > 0
        return Shot(sim.time, position, velocity, np.asarray(values, float)[keep], other[keep], solid[kept][:, [0, -1]])

    def _seen(self, sim: Simulation, points: np.ndarray) -> np.ndarray:
        near = np.ones(len(points), bool)
        if sim.fluid.dim == 3:
            near &= np.abs(points[:, 1] - self.plane) <= sim.scene.spacing
        for axis, span in zip((0, -1), self.window or (), strict=False):
            near &= (points[:, axis] >= span[0]) & (points[:, axis] <= span[1])
        return near


def write_page(case: Case, row: Row, measures: Mapping[str, Measure], folder: Path) -> Path:
    """The page of a row, NAME_LEVEL.html, with figures beside it as PNG: those of each run by its name, "" for the only one."""
    page = Page(case.name, case.title)
    about = page.section("Run")
    about.text(case.reference)
    about.table(headings(case), [cells(row)])
    if case.reasons:
        about.text(case.reasons)
    for run, measure in measures.items():
        of, name = (f" ({run})", f"{case.name}_{run}") if run else ("", case.name)
        if getattr(measure, "shots", ()):
            page.section(f"Particles{of}").figure(_snapshots(measure), caption(measure), name=f"{name}_particles")
        if charts := getattr(measure, "charts", list)():
            curves = page.section(f"Curves{of}")
            for chart in charts:
                curves.figure(_drawn(chart), chart.title, name=f"{name}_{chart.name}")
    folder.mkdir(parents=True, exist_ok=True)
    return page.write(folder / f"{case.name}_{row.level}.html", images=folder)


def caption(measure: Pictured) -> str:
    dotted = "; other liquids than the first dotted" if any(shot.other.any() for shot in measure.shots) else ""
    return f"Particles coloured by {UNITS[measure.colour]}; solids grey{dotted}"


def _snapshots(measure: Pictured):
    shots = measure.shots
    points = np.concatenate([shot.position for shot in shots])
    low, high = np.array(measure.window).T if measure.window else (points.min(0), points.max(0))
    wide, tall = np.subtract(high, low)
    columns = 1 if wide > 2.2 * tall or len(shots) == 1 else 2
    rows = -(-len(shots) // columns)
    height = min(6.0, max(1.6, 11.0 / columns * tall / wide + 0.6))
    figure, panels = canvas(rows, columns, height=height)
    values = np.concatenate([shot.values for shot in shots])
    least, most = np.percentile(values, [1, 99])
    for panel, shot in zip(panels, shots, strict=False):
        size = 72 * height / max(tall, wide * columns * height / 11.0) * measure.spacing
        panel.scatter(*shot.solid.T, s=size**2 * 0.6, c="0.7", linewidths=0, rasterized=True)
        drawn = panel.scatter(
            *shot.position.T, s=size**2 * 0.8, c=shot.values, vmin=least, vmax=most, cmap="turbo", linewidths=0,
            rasterized=True,
        )  # fmt: skip
        panel.scatter(*shot.position[shot.other].T, s=size**2 * 0.06, c="black", linewidths=0, rasterized=True)
        if measure.arrows:
            _draw_arrows(panel, shot, measure.arrows)
        panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x [m]", ylabel="z [m]")
        panel.set_title(f"t = {shot.time:.4g} s", loc="left")
        panel.grid(False)
    for panel in panels[len(shots) :]:
        panel.remove()
    figure.colorbar(drawn, ax=panels[: len(shots)], label=UNITS[measure.colour], shrink=0.8)
    return figure


def _draw_arrows(panel, shot: Shot, apart: float) -> None:
    """The velocity of one particle in each square of side `apart` [m]; the fastest one as long as two of them."""
    _, chosen = np.unique(np.floor(shot.position / apart).astype(int), axis=0, return_index=True)
    x, z = shot.position[chosen].T
    u, w = shot.velocity[chosen].T
    scale = np.percentile(np.hypot(u, w), 95) / (2 * apart)
    panel.quiver(x, z, u, w, angles="xy", scale_units="xy", scale=max(scale, 1e-9), width=0.0012, color="black")


def _drawn(chart: Chart):
    figure, (panel,) = canvas(height=4.0)
    for name, x, y in chart.lines:
        panel.plot(x, y, label=name, linewidth=1.4)
    for (name, x, y), marker, colour in zip(chart.points, cycle("os^vD"), cycle(("0.15", "#0b5cad", "#d1602b"))):
        panel.plot(x, y, marker, label=name, markersize=5, markerfacecolor="none", color=colour)
    panel.set(xlabel=chart.xlabel, ylabel=chart.ylabel)
    panel.set_title(chart.title, loc="left", fontsize=13)
    legend(panel)
    return figure
