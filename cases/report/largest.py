"""The moment of the largest load: when it comes, how it rises and falls, and what the water looks like then."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.figure import static_part
from cases.report.page import Page
from cases.report.snapshot import snapshot_figure
from fsi.errors import SceneError
from fsi.scene.model import Scene

LOADS = (("body", "body_force", "body_position"), ("structure", "load_force", "load_centre"))
AROUND = 0.05  # of the measured time, on either side of the moment


def moment(part):
    """Of the part of a run's dataset that figures are taken from: the dimension, name and dynamic force (time, 3) [N] of what
    has the largest dynamic load, and the index of its time; None in a run without loads."""
    best = None
    for dim, series, _ in LOADS:
        for name in part[dim].values if dim in part.dims and series in part and part.sizes["time"] else ():
            load = part[series].sel({dim: name}).values
            known = np.isfinite(load).all(axis=1)
            if not known.any():
                continue
            dynamic = np.where(known[:, None], load - static_part(load[known]), 0.0)
            size = np.linalg.norm(dynamic, axis=1)
            if size.max() > (0.0 if best is None else best[3]):
                best = dim, str(name), dynamic, float(size.max()), int(size.argmax())
    return best and (*best[:3], best[4])


def largest_load(page: Page, folder: Path, data, scene: Scene, seconds: float) -> None:
    """The section of a run's page; none where nothing bears a load. `seconds` is the length of the measured time at its end."""
    end = float(data.time[-1]) if data.sizes["time"] else 0.0
    part = data.sel(time=slice(end - seconds - 1e-9, None))
    found = moment(part)
    if found is None:
        return
    dim, name, dynamic, index = found
    time, force = float(part.time[index]), dynamic[index]
    size = float(np.linalg.norm(force))
    section = page.section("Largest load")
    kind = "body" if dim == "body" else "structure"
    section.text(f"The largest dynamic force of the fluid, {size:.4g} N, acts on the {kind} {name} at {time:.4f} s.")
    figure, [panel] = charts.canvas(height=2.8)
    around = np.abs(part.time.values - time) <= max(AROUND * seconds, 20 * float(part.time_step[index]))
    columns = [dynamic[around, k] for k in range(3)]
    shown = [k for k in range(3) if np.abs(columns[k]).max() > 1e-9 * size]
    charts.lines(panel, part.time.values[around], [columns[k] for k in shown], ["xyz"[k] for k in shown],
                 xlabel="time [s]", ylabel="dynamic force [N]", title=f"Dynamic force on {name}")  # fmt: skip
    panel.axvline(time, color="0.4", linestyle=":", linewidth=1.2)
    section.figure(figure, "The force less its static part", name="largest_load")
    position = next(place for own, _, place in LOADS if own == dim)
    place = part[position].sel({dim: name}).values[index] if position in part else np.full(3, np.nan)
    try:
        arrows = [(place, force)] if np.isfinite(place).all() else []
        picture, caption = snapshot_figure(folder / "run.rrd", [time], data, scene, arrows)
    except SceneError as fault:
        section.text(f"No picture: {fault}")
        return
    arrow = "; the arrow has the direction of the dynamic force" if arrows else ""
    section.figure(picture, f"The snapshot nearest to it. {caption}{arrow}", name="largest_load_particles")
