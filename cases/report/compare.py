"""Two or more runs on one page: what differs between their scenes, their figures and their curves."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.page import Page, Section
from fsi.errors import SceneError

MOST_PANELS = 24
SERIES = (
    "joint_position", "joint_force", "pto_power", "body_force", "body_torque", "load_force", "mooring_tension", "elevation",
    "pressure", "discharge", "runup_height", "sensor_reading", "kinetic_energy",
)  # fmt: skip
SAME = 1e-6  # of the largest, below which a curve is left out as zero


def short_names(folders: Sequence[Path]) -> list[str]:
    """The last parts of the paths that tell them apart."""
    parts = [folder.absolute().parts for folder in folders]
    if len(set(parts)) < len(parts):
        raise SceneError("a folder stands twice", key="DIR", fix="name each once")
    count = next(n for n in range(1, max(map(len, parts)) + 1) if len({p[-n:] for p in parts}) == len(parts))
    return ["/".join(p[-count:]) for p in parts]


def differences(section: Section, texts: Sequence[str], names: Sequence[str], what: str) -> None:
    """A table of the keys of TOML texts that are not the same in all of them."""
    tables = [dict(_flat(tomllib.loads(text))) for text in texts]
    keys = list(dict.fromkeys(key for table in tables for key in table))
    rows = [
        [key, *(_shown(table.get(key)) for table in tables)]
        for key in keys
        if len({repr(t.get(key)) for t in tables}) > 1
    ]
    if rows:
        section.table(["key", *names], rows, f"Keys of the {what} that differ; - where one is not given")
    else:
        section.text(f"The {what}s are the same.")


def _shown(value) -> str:
    return "-" if value is None else str(value)


def _flat(table, before: str = ""):
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def of_runs(folders: Sequence[Path], names: Sequence[str]) -> Page:
    from cases.report.run import key_figures
    from fsi.record.dataset import frames_of
    from fsi.record.manifest import read_manifest
    from fsi.scene.file import load_scene

    runs = [frames_of(folder) for folder in folders]
    scenes = [load_scene(folder / "scene.toml") for folder in folders]
    page = Page("Comparison of runs", ", ".join(names))
    head = page.section("Runs")
    facts = [read_manifest(folder) for folder in folders]
    rows = [
        [name, scene.name, f"{fact['status']}", fact.get("simulated_seconds", 0.0), fact.get("wall_seconds", 0.0)]
        for name, scene, fact in zip(names, scenes, facts, strict=True)
    ]
    head.table(["run", "scene", "status", "simulated [s]", "run time [s]"], rows)
    differences(head, [(f / "scene.toml").read_text(encoding="utf-8") for f in folders], names, "scene")
    found = [key_figures(data, scene) for data, scene in zip(runs, scenes, strict=True)]
    figures_table(page.section("Key figures"), [figures for figures, _, _ in found], names)
    page.sections[-1].items(f"{name}: over {which}" for name, (_, _, which) in zip(names, found, strict=True))
    _curves(page.section("Time series"), runs, names)
    return page


def figures_table(section: Section, found: Sequence[list], names: Sequence[str]) -> None:
    """Figures side by side, and each over the first's."""
    tables = [{f.key: f for f in figures if not f.name.endswith("_error")} for figures in found]
    rows = []
    for key in dict.fromkeys(key for table in tables for key in table):
        figures = [table.get(key) for table in tables]
        one = next(f for f in figures if f is not None)
        values = [f.value if f is not None and f.units == one.units else None for f in figures]
        base = values[0]
        over = [f"{v / base:.3f}" if base and v is not None and np.isfinite(v / base) else "-" for v in values[1:]]
        shown = ["-" if v is None else float(v) for v in values]
        rows.append([one.long_name, one.label, one.units, *shown, *over])
    section.table(["figure", "of", "unit", *names, *(f"{name} over {names[0]}" for name in names[1:])], rows)


def _curves(section: Section, runs: Sequence, names: Sequence[str]) -> None:
    """A panel for every series that two of the runs or more have, element by element."""
    panels = []
    for series in SERIES:
        lines: dict[str, list] = {}
        for data, name in zip(runs, names, strict=True):
            for where, values in _elements(data, series):
                lines.setdefault(where, []).append((name, data.time.values, values))
        largest = max(
            (float(np.nanmax(np.abs(v), initial=0.0)) for curves in lines.values() for _, _, v in curves), default=0.0
        )
        for where, curves in lines.items():
            if len(curves) > 1 and any(np.nanmax(np.abs(v), initial=0.0) > SAME * largest for _, _, v in curves):
                facts = next(data[series].attrs for data in runs if series in data)
                panels.append((facts, where, curves))
    if not panels:
        section.text("The runs share no series.")
        return
    left = len(panels) - MOST_PANELS
    figure, axes = charts.canvas(len(panels[:MOST_PANELS]), height=2.6)
    for panel, (facts, where, curves) in zip(axes, panels, strict=False):
        for name, time, values in curves:
            panel.plot(time, values, label=name, linewidth=1.3, color=charts.COLOURS[names.index(name)])
        words = facts["long_name"]
        panel.set(xlabel="time [s]", ylabel=f"[{facts['units']}]")
        panel.set_title(f"{words[:1].upper()}{words[1:]}" + (f", {where}" if where else ""), loc="left", fontsize=13)
        panel.margins(x=0)
        charts.legend(panel)
    more = f"; {left} more panels are left out" if left > 0 else ""
    section.figure(figure, f"The series that the runs share{more}", name="series")


def _elements(data, series: str):
    """Label and values (time,) of every element of a series."""
    if series not in data or not data.sizes["time"]:
        return
    variable = data[series]
    shape = variable.shape[1:]
    for index in np.ndindex(shape):
        labels = [
            str(data[dim].values[i]) if dim in data.coords else str(i)
            for dim, i in zip(variable.dims[1:], index, strict=True)
        ]
        yield " ".join(labels), variable.values[(slice(None), *index)]
