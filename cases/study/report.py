"""The page of a study: response curves of one parameter, surfaces of two, the best design, every run."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.page import Page
from cases.study.judge import best_row, feasible
from cases.study.results import load_results, names_in_order, table
from fsi.errors import SceneError

SHOWN = ("mean_power", "capture_width_ratio", "rao", "rao_phase", "motion_max", "joint_force_max", "force_max")
DECAY = ("decay_period", "decay_linear", "decay_quadratic", "decay_ratio")
TABLE = 5  # parameters and figures side by side in the table of runs, that a page holds
CURVES = 3  # values of a second parameter that are curves in one panel; more are a surface


def report(folder: str | Path) -> Path:
    """Write `report.html` and its PNGs (`report/`) into the folder of a study; returns the page.

    Raises SceneError where the folder holds no study, or none of its runs is done.
    """
    folder = Path(folder)
    data = load_results(folder)
    frame = table(data)
    if not (frame["status"] == "done").any():
        raise SceneError(f"no run of {folder} is done", fix="see the reasons in study.nc, or run fsi sweep again")
    page = Page(data.attrs["study"], data.attrs["description"] or _subtitle(data, frame))
    _best(page, data)
    _routine(page, data)
    figure, names = _responses(data, frame)
    if names:
        page.section("Response").figure(figure, _caption(data), name="response")
    _history(page, data, frame)
    _runs(page, data, frame)
    return page.write(folder / "report.html", folder / "report")


def _subtitle(data, frame) -> str:
    done = int((frame["status"] == "done").sum())
    return f"{data.attrs['method'].replace('_', ' ')} of {len(frame)} runs, {done} done, over {_parameters(data)}"


def _parameters(data) -> str:
    return " and ".join(names_in_order(data)) or "nothing"


def _caption(data) -> str:
    return f"What comes of {_parameters(data)}; runs that failed are left out"


def _best(page: Page, data) -> None:
    best = best_row(data)
    if best is None:
        return
    section = page.section("Best design")
    unit = data[best["objective"].partition(".")[0]].attrs["units"]
    facts = {f"{name} [{data[name].attrs['units']}]": value for name, value in best["parameters"].items()}
    section.facts({**facts, f"{best['objective']} [{unit}]": best["value"], "run": f"runs/{best['run']}"})
    if data.attrs["constraints"] != "{}":
        section.text(f"Best of the runs that keep the constraints {data.attrs['constraints']}.")


def _routine(page: Page, data) -> None:
    """What the routine of the study adds."""
    if "best_damping" in data:
        section = page.section("Best damping")
        others = list(data.best_damping.dims)
        heads = [
            *(label(data[name]) for name in others),
            label(data.best_damping),
            label(data.best_power),
            "between points",
        ]
        rows = []
        for index in np.ndindex(data.best_damping.shape):
            at = [float(data[name].values[i]) for name, i in zip(others, index, strict=True)]
            values = float(data.best_damping.values[index]), float(data.best_power.values[index])
            rows.append([*at, *values, "yes" if data.best_inside.values[index] else "no: widen the range"])
        section.table(heads, rows, "Vertex of the parabola through the best point and its neighbours, over log damping")
    if "power_matrix" in data and data.power_matrix.ndim == 2:
        section = page.section("Power matrix")
        for name in ("power_matrix", "capture_width_matrix"):
            if name in data:
                first, second = data[name].dims
                heads = [f"{label(data[first])} \\ {label(data[second])}", *(f"{v:g}" for v in data[second].values)]
                rows = [
                    [float(v), *map(float, row)] for v, row in zip(data[first].values, data[name].values, strict=True)
                ]
                section.table(heads, rows, label(data[name]))
    if any(str(name).endswith("_max_mode") for name in data.data_vars):
        section, rows = page.section("Extreme of a storm"), []
        for name in (str(n) for n in data.data_vars if str(n).endswith("_max_mode")):
            high = data[f"{name.removesuffix('_mode')}_95"]
            for index in np.ndindex(data[name].shape):
                where = ", ".join(str(data[d].values[i]) for d, i in zip(data[name].dims, index, strict=True))
                values = float(data[name].values[index]), float(high.values[index])
                rows.append([name.removesuffix("_mode"), where, *values, data[name].attrs["units"]])
        section.table(["response", "of", "most probable", "not passed in 95 of 100", "units"], rows)


def label(variable) -> str:
    """Name and units, as on an axis."""
    units = variable.attrs.get("units", "1")
    words = variable.attrs.get("long_name", str(variable.name))
    return words if units in ("1", "") else f"{words} [{units}]"


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
    base = name.partition(".")[0]
    if f"{base}_bem" in data and not others:
        panel.plot(data[x], data[f"{base}_bem"], linestyle="--", color="0.4", label="linear theory")
    _axis(panel, data, x, "x")
    panel.set_ylabel(label(data[base]), fontsize=10)
    panel.set_title(name, loc="left", fontsize=12)
    charts.legend(panel)


def _at(data, name: str, value) -> str:
    units = data[name].attrs["units"]
    return (
        f"{name} {value:g}{'' if units == '1' else f' {units}'}"
        if isinstance(value, int | float)
        else f"{name} {value}"
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
        panel.figure.colorbar(filled, ax=panel).set_label(label(data[name.partition(".")[0]]), fontsize=10)
    panel.plot(known[x], known[y], "o", color="white", markeredgecolor="black", markersize=4, clip_on=False)
    best = best_row(data)
    if best is not None:
        at = best["parameters"]
        panel.plot(at[x], at[y], "*", color="#d1602b", markeredgecolor="black", markersize=15, clip_on=False)
    panel.set_title(name, loc="left", fontsize=12)
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
    heads = [*(f"{n} [{units[n]}]" for n in [*names_in_order(data), *columns]), "status", "run"]
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
