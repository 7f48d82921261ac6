"""The page of a study: response curves of one parameter, surfaces of two, the best design, every run."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.froude import check_scale, scaled
from cases.report.page import Page
from cases.report.wave_figures import energy_period_ratio
from cases.study.design import base_scene
from cases.study.judge import best_row, feasible
from cases.study.results import load_results, names_in_order, table
from cases.study.scatter import annual, read_scatter
from cases.study.sections import annual_section, label, parameters_in_words, sections, title, words
from cases.study.study_file import load_study
from fsi.errors import SceneError

SHOWN = ("mean_power", "capture_width_ratio", "rao", "rao_phase", "motion_max", "joint_force_max", "force_max")
DECAY = ("decay_period", "decay_linear", "decay_quadratic", "decay_ratio")
TABLE = 5  # parameters and figures side by side in the table of runs, that a page holds
CURVES = 3  # values of a second parameter that are curves in one panel; more are a surface


def report(folder: str | Path, *, scale: float | None = None, scatter: str | Path | None = None) -> Path:
    """Write `report.html` and its PNGs (`report/`) into the folder of a study; returns the page.

    `scale` is full size over model: all figures are then those at full scale by Froude's law. `scatter` is the file of a
    scatter table, at the size that the page has: a power matrix gives the mean annual energy.
    Raises SceneError where the folder holds no study, or none of its runs is done.
    """
    folder = Path(folder)
    data = load_results(folder)
    if scale is not None:
        data, left = scaled(data, check_scale(scale))
    frame = table(data)
    if not (frame["status"] == "done").any():
        raise SceneError(f"no run of {folder} is done", fix="see the reasons in study.nc, or run fsi sweep again")
    page = Page(data.attrs["study"], data.attrs["description"] or _subtitle(data, frame))
    if scale is not None:
        _at_full_scale(page, scale, left)
    _best(page, data)
    sections(page, data)
    if scatter is not None:
        annual_section(page, _annual(folder, data, scatter))
    figure, names = _responses(data, frame)
    if names:
        page.section("Response").figure(figure, _caption(data), name="response")
    _history(page, data, frame)
    _runs(page, data, frame)
    return page.write(folder / "report.html", folder / "report")


def _at_full_scale(page: Page, scale: float, left: list[str]) -> None:
    section = page.section("Scale")
    section.text(
        f"All figures are at full scale, {scale:g} times the size of the runs, by Froude's law in water of the same density: "
        "lengths go by the scale, times by its root, forces by its third power, power by 3.5. Viscous forces do not go by it."
    )
    if left:
        section.items([("warning", f"left as they are, for their units are not given or not known: {', '.join(left)}")])


def _annual(folder: Path, data, scatter: str | Path):
    """What the power matrix makes of a scatter table. Raises SceneError where the study has none."""
    if "power_matrix" not in data:
        raise SceneError("the study has no power matrix", key="--scatter", fix="set routine = 'power_matrix'")
    scene = base_scene(load_study(folder / "study.toml"))
    try:
        ratio = energy_period_ratio(scene.waves)
    except AttributeError:  # waves without a spectrum of this kind
        ratio = None
    return annual(data.power_matrix, data.get("power_matrix_error"), read_scatter(scatter), ratio)


def _subtitle(data, frame) -> str:
    done = int((frame["status"] == "done").sum())
    return (
        f"{data.attrs['method'].replace('_', ' ')} of {len(frame)} runs, {done} done, over {parameters_in_words(data)}"
    )


def _caption(data) -> str:
    return f"What comes of {parameters_in_words(data)}; runs that failed are left out"


def _best(page: Page, data) -> None:
    best = best_row(data)
    if best is None:
        return
    section = page.section("Best design")
    unit = data[best["objective"].partition(".")[0]].attrs["units"]
    facts = {label(data[name]): value for name, value in best["parameters"].items()}
    section.facts({**facts, f"{title(data, best['objective'])} [{unit}]": best["value"], "run": f"runs/{best['run']}"})
    if data.attrs["constraints"] != "{}":
        section.text(f"Best of the runs that keep the constraints {data.attrs['constraints']}.")


def _columns(data, frame) -> list[str]:
    """The figures to draw, the objective first."""
    objective = data.attrs.get("objective", "")
    wanted = [name for base in (*SHOWN, *DECAY) for name in frame if name == base or name.startswith(f"{base}.")]
    names = [name for name in dict.fromkeys([objective, *wanted]) if name in frame and frame[name].notna().any()]
    return (
        names or [name for name in frame if name.partition(".")[0] in data.data_vars and frame[name].dtype == float][:6]
    )


def _responses(data, frame):
    """A figure with a panel for every response: curves over one parameter, surfaces over two numbers."""
    names, parameters = _columns(data, frame), _by_numbers(data, frame)
    if not parameters or not names:
        return None, []
    surface = len(parameters) > 1 and (data.attrs["method"] != "grid" or frame[parameters[1]].nunique() > CURVES)
    columns = 2 if len(names) > 1 else 1
    rows = -(-len(names) // columns)
    figure, panels = charts.canvas(rows, columns, height=3.6 if surface else 3.2)
    for panel, name in zip(panels, names, strict=False):
        draw = _surface if surface else _curves
        draw(panel, data, frame[frame["status"] == "done"], name, parameters)
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    return figure, names


def _by_numbers(data, frame) -> list[str]:
    """Parameters that are numbers and vary, the one with most values first."""
    numbers = [
        n for n in names_in_order(data) if n != "seed" and frame[n].dtype.kind in "if" and frame[n].nunique() > 1
    ]
    return sorted(numbers, key=lambda name: -frame[name].nunique())


def _curves(panel, data, frame, name: str, parameters: list[str]) -> None:
    x, others = (
        parameters[0],
        [p for p in names_in_order(data) if p not in (parameters[0], "seed") and frame[p].nunique() > 1],
    )
    for values in product(*(sorted(frame[p].unique()) for p in others)):
        part = frame
        for other, value in zip(others, values, strict=True):
            part = part[part[other] == value]
        part = part.groupby(x, as_index=False)[name].mean().dropna()
        text = ", ".join(_at(data, p, v) for p, v in zip(others, values, strict=True))
        panel.plot(part[x], part[name], marker="o", markersize=4, linewidth=1.4, label=text or None)
    best = best_row(data)
    if best is not None and name == best["objective"]:
        panel.plot(
            best["parameters"][x], best["value"], "*", color="#b8860b", markersize=14, label="best run", zorder=5
        )
    _axis(panel, data, x, "x")
    panel.set_ylabel(_units(data, name), fontsize=11)
    panel.set_title(title(data, name), loc="left", fontsize=12)
    charts.legend(panel)


def _units(data, name: str) -> str:
    """Of a figure, whose name stands above the panel."""
    return f"[{data[name.partition('.')[0]].attrs['units']}]"


def _at(data, name: str, value) -> str:
    units = data[name].attrs["units"]
    return (
        f"{words(data[name])} {value:g}{'' if units == '1' else f' {units}'}"
        if isinstance(value, int | float)
        else f"{words(data[name])} {value}"
    )


def _axis(panel, data, name: str, axis: str) -> None:
    values = np.unique(data[name].values.astype(float))
    panel.locator_params(axis=axis, nbins=5)
    if values[0] > 0 and values[-1] / values[0] > 15:
        from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

        getattr(panel, f"set_{axis}scale")("log")
        ticks = getattr(panel, f"{axis}axis")
        ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ticks.set_major_formatter(StrMethodFormatter("{x:g}"))
        ticks.set_minor_formatter(NullFormatter())
    getattr(panel, f"set_{axis}label")(label(data[name]), fontsize=10)


def _surface(panel, data, frame, name: str, parameters: list[str]) -> None:
    x, y = parameters[:2]
    known = frame[[x, y, name]].dropna()
    levels = 12
    _axis(panel, data, x, "x")
    _axis(panel, data, y, "y")
    if len(known) >= 4 and known[name].nunique() > 1 and _spread(known, x, y):
        filled = panel.tricontourf(known[x], known[y], known[name], levels=levels, cmap="viridis")
        panel.figure.colorbar(filled, ax=panel).set_label(_units(data, name), fontsize=11)
    panel.plot(known[x], known[y], "o", color="white", markeredgecolor="black", markersize=4, clip_on=False)
    best = best_row(data)
    if best is not None:
        at = best["parameters"]
        panel.plot(at[x], at[y], "*", color="#d1602b", markeredgecolor="black", markersize=15, clip_on=False)
    panel.set_title(title(data, name), loc="left", fontsize=12)
    panel.grid(False)


def _spread(known, x: str, y: str) -> bool:
    """Whether the points span a plane, as a triangulation needs."""
    points = known[[x, y]].drop_duplicates().to_numpy(float)
    return (
        len(points) > 3 and np.linalg.matrix_rank((points - points.mean(0)) / np.ptp(points, axis=0).clip(1e-300)) == 2
    )


def _history(page: Page, data, frame) -> None:
    """How an optimisation went: every trial, and the best so far."""
    if data.attrs["method"] != "optimise":
        return
    name, sign = data.attrs["objective"], int(data.attrs["sense"])
    good = feasible(data, frame)
    figure, (panel,) = charts.canvas(height=4.2)
    trial = np.arange(1, len(frame) + 1)
    best = sign * np.maximum.accumulate(np.where(good, sign * frame[name], -np.inf))
    panel.plot(trial[good], frame[name][good], "o", label="keeps the constraints")
    if (~good & frame[name].notna()).any():
        panel.plot(trial[~good], frame[name][~good], "x", color="0.5", label="breaks them")
    panel.step(trial, np.where(np.isfinite(best), best, np.nan), where="post", label="best so far", linewidth=1.4)
    panel.set(xlabel="trial", ylabel=label(data[name.partition(".")[0]]))
    panel.xaxis.get_major_locator().set_params(integer=True)
    charts.legend(panel)
    page.section("Search").figure(figure, "Objective of every trial in the order of asking", name="search")


def _runs(page: Page, data, frame) -> None:
    section = page.section("Runs")
    columns = _columns(data, frame)[: max(2, TABLE - len(names_in_order(data)))]
    units = frame.attrs["units"]
    heads = [*(f"{title(data, n)} [{units[n]}]" for n in [*names_in_order(data), *columns]), "status", "run"]
    rows = []
    for _, row in frame.iterrows():
        values = [row[name] for name in [*names_in_order(data), *columns]]
        rows.append([*(_plain(v) for v in values), row["status"], row["run_hash"]])
    section.table(heads, rows, "All figures are in study.nc")
    failed = frame[frame["status"] != "done"]
    if len(failed):
        section.items([("error", f"{row['run_hash'] or 'not run'}: {row['reason']}") for _, row in failed.iterrows()])


def _plain(value):
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else float(value)
    return value.item() if isinstance(value, np.generic) else value
