"""Two or more studies on one page: what differs in their files, and their response curves over a parameter that they share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.compare import differences
from cases.report.page import Page
from cases.study.judge import best_row
from cases.study.report import DECAY, SHOWN
from cases.study.results import load_results, names_in_order, table
from cases.study.sections import label, title
from fsi.errors import SceneError

ALSO = ("added_mass", "radiation_damping", "crest_max", "pressure_max", "force_dynamic_max", "load_force_max")
MOST_PANELS = 16


def of_studies(folders: Sequence[Path], names: Sequence[str]) -> Page:
    """The page. Raises SceneError where the studies have no parameter of numbers in common."""
    studies = [load_results(folder) for folder in folders]
    frames = [table(data) for data in studies]
    page = Page("Comparison of studies", ", ".join(names))
    head = page.section("Studies")
    rows = [
        [name, data.attrs["study"], len(frame), int((frame["status"] == "done").sum()), data.attrs["description"]]
        for name, data, frame in zip(names, studies, frames, strict=True)
    ]
    head.table(["study", "name", "runs", "done", "description"], rows)
    differences(head, [(f / "study.toml").read_text(encoding="utf-8") for f in folders], names, "study file")
    _best(page, studies, names)
    x = _shared(studies, frames)
    columns = _columns(studies, frames)
    if not columns:
        raise SceneError("the studies have no figure in common", key="DIR", fix="compare studies of the same kind")
    wide = 2 if len(columns) > 1 else 1
    figure, panels = charts.canvas(-(-len(columns) // wide), wide, height=3.4)
    for panel, column in zip(panels, columns, strict=False):
        for n, (data, frame, name) in enumerate(zip(studies, frames, names, strict=True)):
            _curves(panel, data, frame[frame["status"] == "done"], x, column, name, charts.COLOURS[n])
        base = column.partition(".")[0]
        panel.set(xlabel=label(studies[0][x]), ylabel=f"[{studies[0][base].attrs['units']}]")
        panel.set_title(title(studies[0], column), loc="left", fontsize=12)
    for panel in panels[len(columns) :]:
        panel.set_visible(False)
    handles, texts = panels[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside upper left", ncols=4, frameon=False, fontsize=11)
    caption = f"Over {title(studies[0], x)[:1].lower()}{title(studies[0], x)[1:]}; the mean of the seeds"
    page.section("Response").figure(figure, caption, name="response")
    return page


def _shared(studies, frames) -> str:
    """The parameter of numbers that all have and that varies in each, the one with most values."""
    common = [n for n in names_in_order(studies[0]) if n != "seed" and all(n in names_in_order(d) for d in studies)]
    common = [n for n in common if all(f[n].dtype.kind in "if" and f[n].nunique() > 1 for f in frames)]
    for name in common:
        if len({data[name].attrs["units"] for data in studies}) > 1:
            units = " and ".join(sorted({data[name].attrs["units"] for data in studies}))
            raise SceneError(f"{name} is in {units}", key="DIR", fix="give the studies the same units")
    if not common:
        fix = "compare studies that vary the same parameter"
        raise SceneError("the studies vary no number in common", key="DIR", fix=fix)
    return max(common, key=lambda n: frames[0][n].nunique())


def _columns(studies, frames) -> list[str]:
    bases = (*SHOWN, *DECAY, *ALSO)
    shared = [c for c in frames[0] if c.partition(".")[0] in bases and all(c in f for f in frames)]
    same = [
        c for c in shared
        if len({d[c.partition(".")[0]].attrs["units"] for d in studies}) == 1 and frames[0][c].notna().any()
    ]  # fmt: skip
    return sorted(same, key=lambda c: bases.index(c.partition(".")[0]))[:MOST_PANELS]


def _curves(panel, data, frame, x: str, column: str, name: str, colour: str) -> None:
    """One curve for each value of the other parameters; all of a study in its colour."""
    others = [p for p in names_in_order(data) if p not in (x, "seed") and frame[p].nunique() > 1]
    groups = frame.groupby(others) if others else [((), frame)]
    for n, (values, part) in enumerate(groups):
        values = values if isinstance(values, tuple) else (values,)
        curve = part.groupby(x, as_index=False)[column].mean().dropna()
        where = ", ".join(
            f"{p} {v:.4g}" if isinstance(v, float | np.number) else f"{p} {v}"
            for p, v in zip(others, values, strict=True)
        )
        style = ("-", "--", ":", "-.")[n % 4]
        text = f"{name}, {where}" if where else name
        panel.plot(curve[x], curve[column], style, marker="o", markersize=4, color=colour, label=text)


def _best(page: Page, studies, names: Sequence[str]) -> None:
    found = [(name, data, best_row(data)) for name, data in zip(names, studies, strict=True)]
    rows = [
        [
            name,
            title(data, best["objective"]),
            best["value"],
            data[best["objective"].partition(".")[0]].attrs["units"],
            ", ".join(
                f"{p} = {v:.4g}" if isinstance(v, float) else f"{p} = {v}" for p, v in best["parameters"].items()
            ),
        ]
        for name, data, best in found
        if best is not None
    ]
    if rows:
        page.section("Best designs").table(["study", "objective", "value", "units", "at"], rows)
