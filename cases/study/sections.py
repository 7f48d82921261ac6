"""What the routines of studies have on the page: each section is drawn where the dataset has what it shows."""

from __future__ import annotations

import math

import numpy as np

from cases.report import charts
from cases.report.page import Page
from cases.study.bem import RADIATED, frequency_name, of_omega
from cases.study.extremes import GOAL, draws, gumbel_fit, largest_of
from cases.study.results import names_in_order
from cases.study.scatter import Annual

PAIRS = 6  # of joints in a figure of added mass and damping
RESPONSES = 6  # in a figure of extremes
SMALL = 1e-3  # of the largest, below which the added mass of a pair of joints is left out


def sections(page: Page, data) -> None:
    """All of them that the study has."""
    for section in (_damping, _response_amplitude, _radiation, _power_matrix, _extreme):
        section(page, data)


def label(variable) -> str:
    """Name and units, as on an axis."""
    units = variable.attrs.get("units", "1")
    return words(variable) if units in ("1", "") else f"{words(variable)} [{units}]"


def words(variable) -> str:
    """The long name, or the name without its underscores."""
    return str(variable.attrs.get("long_name") or variable.name).replace("_", " ")


def title(data, column: str) -> str:
    """A column of the table of a study in words: `force_max.flap` is "Largest fluid force, flap"."""
    base, _, where = column.partition(".")
    text = words(data[base])
    return f"{text[:1].upper()}{text[1:]}" + (f", {where.replace('.', ', ')}" if where else "")


def _damping(page: Page, data) -> None:
    if "best_damping" not in data:
        return
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


def _response_amplitude(page: Page, data) -> None:
    """RAO of every joint beside linear theory, over frequency."""
    if "rao_theory" not in data:
        return
    name = frequency_name(data)
    others = [d for d in data.rao.dims if d not in (name, "joint")]
    joints = [j for j in data.joint.values if np.isfinite(data.rao_theory.sel(joint=j)).any()]
    figure, panels = charts.canvas(len(joints), height=3.6)
    for panel, joint in zip(panels, joints, strict=True):
        _beside(panel, data, data.rao.sel(joint=joint), data.rao_theory.sel(joint=joint), name, others)
        panel.set_title(f"Response amplitude operator, {joint}", loc="left", fontsize=13)
    page.section("Response amplitude operator").figure(figure, "Runs beside linear potential theory", name="rao")


def _beside(panel, data, runs, theory, name: str, others, error=None) -> None:
    """Points of the runs and curves of theory, one colour for each value of the other parameters."""
    shape = [range(data.sizes[d]) for d in others]
    for n, index in enumerate(np.ndindex(*map(len, shape))):
        at = dict(zip(others, index, strict=True))
        where = ", ".join(f"{words(data[d])} {_value(data[d].values[i])}" for d, i in at.items())
        colour = charts.COLOURS[n % len(charts.COLOURS)]
        bars = None if error is None else np.abs(error.isel(at).values)
        shown = f", {where}" if where else ""
        panel.errorbar(data[name], runs.isel(at), yerr=bars, fmt="o", markersize=6, capsize=4, color=colour,
                       label=f"runs{shown}", zorder=3)  # fmt: skip
        if theory is not None:
            curve = theory.isel({d: i for d, i in at.items() if d in theory.dims})
            panel.plot(of_omega(data.bem_omega, name), curve, "--", color=colour, label=f"linear theory{shown}")
    values = data[name].values.astype(float)
    room = 0.15 * (np.ptp(values) or values[0])
    panel.set(xlim=(max(values.min() - room, 0), values.max() + room), xlabel=label(data[name]), ylabel=label(runs))
    _fit_height(panel)
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=11, frameon=False)


def _fit_height(panel) -> None:
    """The height of a panel by what lies within its width."""
    low, high = panel.get_xlim()
    shown = [y[(x >= low) & (x <= high) & np.isfinite(y)] for x, y in (_points(line) for line in panel.get_lines())]
    shown = np.concatenate([y for y in shown if len(y)] or [np.zeros(1)])
    bottom, top = min(float(shown.min()), 0.0), max(float(shown.max()), 0.0)
    room = 0.08 * (top - bottom or 1.0)
    panel.set_ylim(bottom - (room if bottom < 0 else 0.0), top + room)


def _points(line) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)


def _value(value) -> str:
    return f"{value:.4g}" if isinstance(value, int | float | np.number) else str(value)


def _radiation(page: Page, data) -> None:
    """Added mass and damping of every pair of joints, beside linear theory where the study has it."""
    if "added_mass" not in data:
        return
    name = frequency_name(data)
    driven = list(data.driven.values) if "driven" in data.dims else [None]
    pairs = [(i, j) for i in driven for j in data.joint.values]
    if len(driven) > 1 or len(data.joint) > 1:
        size = {pair: float(abs(_pair(data.added_mass, *pair)).max()) for pair in pairs}
        pairs = sorted(
            (p for p in pairs if size[p] > SMALL * max(size.values())), key=lambda p: (p[0] != p[1], -size[p])
        )
    figure, panels = charts.canvas(2 * len(pairs[:PAIRS]), height=3.0)
    for n, (i, j) in enumerate(pairs[:PAIRS]):
        for panel, key in zip(panels[2 * n : 2 * n + 2], RADIATED, strict=True):
            runs, error = _pair(data[key], i, j), _pair(data[f"{key}_error"], i, j)
            theory = _pair(data[f"{key}_theory"], i, j) if f"{key}_theory" in data else None
            theory = theory if theory is not None and np.isfinite(theory).any() else None
            _beside(panel, data, runs, theory, name, [d for d in runs.dims if d != name], error)
            where = f"force on {j}, {i} moved" if i is not None and i != j else str(j)
            panel.set_title(
                f"{'Added mass' if key == 'added_mass' else 'Radiation damping'}, {where}", loc="left", fontsize=13
            )
    section = page.section("Added mass and radiation damping")
    beside = " beside linear potential theory" if "added_mass_theory" in data else ""
    left = f"; {len(pairs) - PAIRS} smaller pairs of joints are in study.nc" if len(pairs) > PAIRS else ""
    caption = (
        f"From forced oscillation, the force of still water in the same pose taken out{beside}; bars are 95 % confidence "
        f"intervals over the periods{left}"
    )
    section.figure(figure, caption, name="radiation")


def _pair(values, driven, joint):
    return values.sel(joint=joint) if driven is None else values.sel(joint=joint, driven=driven)


def _power_matrix(page: Page, data) -> None:
    if "power_matrix" not in data or data.power_matrix.ndim != 2:
        return
    section = page.section("Power matrix")
    kinds = ("power_matrix", "power_matrix_error", "power_matrix_bem", "power_matrix_ratio", "capture_width_matrix")
    names = [name for name in kinds if name in data]
    names = [name for name in names if np.isfinite(data[name].values).any()]
    high = 0.42 * len(data[data.power_matrix.dims[0]]) + 1.5
    figure, panels = charts.canvas(len(names), height=min(max(high, 2.8), 8.0))
    powers = [data[name].values for name in ("power_matrix", "power_matrix_bem") if name in names]
    both = (np.nanmin(powers), np.nanmax(powers)) if powers else (None, None)
    for panel, name in zip(panels, names, strict=True):
        down, along = data[name].dims
        limits = both if name in ("power_matrix", "power_matrix_bem") else (None, None)
        charts.heat_map(
            panel, data[along].values, data[down].values, data[name].values,
            xlabel=label(data[along]), ylabel=label(data[down]), label=_units(data[name]), limits=limits,
        )  # fmt: skip
        panel.set_title(title(data, name), loc="left", fontsize=13)
    beside = ", beside linear potential theory" if "power_matrix_bem" in data else ""
    by = " and ".join(words(data[name]) for name in data.power_matrix.dims)
    section.figure(figure, f"Mean absorbed power by {by}{beside}", name="power_matrix")
    if stopped := _stopped(data):
        section.text(stopped)


def _stopped(data) -> str:
    """Which joints came to an end stop, and in how many runs: linear theory knows of none."""
    if "end_stop_hits" not in data:
        return ""
    hit = data.end_stop_hits > 0
    over = [dim for dim in hit.dims if dim != "joint"]
    counts = {str(name): int(hit.sel(joint=name).sum()) for name in hit.joint.values}
    of = int(np.prod([hit.sizes[dim] for dim in over]))
    told = [f"{name} in {count} of {of} runs" for name, count in counts.items() if count]
    return f"Joints that came to an end stop, which linear theory does not know: {', '.join(told)}." if told else ""


def _units(variable) -> str:
    return f"[{variable.attrs['units']}]"


def annual_section(page: Page, found: Annual) -> None:
    """Mean annual energy."""
    section = page.section("Mean annual energy")
    margin = f" ± {found.error / 1000:.2g}" if math.isfinite(found.error) else ""
    section.facts(
        {
            "mean annual energy": f"{found.energy / 1000:.4g}{margin} kWh",
            "mean absorbed power": f"{found.power:.4g} W",
            "share of the year inside the matrix": f"{100 * found.covered:.3g} %",
            "share of the waves' energy inside the matrix": f"{100 * found.covered_energy:.3g} %",
        }
    )
    section.text(
        "The power matrix, bilinear between its seas, weighted by their occurrence; seas outside the matrix add nothing, so "
        "that a wider matrix can only give more. ± is the 95 % confidence interval of the seeds."
    )


def _extreme(page: Page, data) -> None:
    """Fits of the largest values, with their confidence, and how many seeds they need."""
    names = [str(name).removesuffix("_mode") for name in data.data_vars if str(name).endswith("_max_mode")]
    if not names:
        return
    section, rows, fits = page.section("Extreme of a storm"), [], []
    stops = data.end_stop_hits.sum("seed") if "end_stop_hits" in data else None
    for name in names:
        mode = data[f"{name}_mode"]
        for index in np.ndindex(mode.shape):
            at = dict(zip(mode.dims, index, strict=True))
            where = ", ".join(str(data[d].values[i]) for d, i in at.items())
            value, high, low, upper, seeds = (
                float(data[f"{name}_{s}"].values[index]) for s in ("mode", "95", "95_low", "95_high", "seeds")
            )
            if math.isnan(value):
                continue
            joint = {d: i for d, i in at.items() if stops is not None and d in stops.dims}
            hits = float(stops.isel(joint)) if stops is not None and "joint" in at else 0.0
            note = f"end stop reached {hits:.0f} times" if hits else ""
            wanted = "bounded by the end stop" if math.isnan(seeds) else f"{seeds:.0f}"
            units = data[name].attrs["units"]
            rows.append([title(data, name), where, value, high, f"{low:.4g} to {upper:.4g}", wanted, units, note])
            fits.append((f"{title(data, name)}, {where}", data[name].isel(at), high, not math.isnan(seeds)))
    runs = data.sizes["seed"]
    heads = [
        "response",
        "of",
        "most probable",
        "not passed in 95 of 100",
        "its 95 % confidence",
        f"seeds for ±{100 * GOAL:.0f} %",
    ]
    section.table(
        [*heads, "units", "end stops"], rows, f"Gumbel distribution fitted to the largest values of {runs} seeds"
    )
    _fits(section, data, fits[:RESPONSES])
    if stops is not None and float(stops.sum()) > 0:
        section.text(
            "Joints that came to their end stops: their motion is bounded there, and loads of runs with and without a blow on "
            "the stop are of two kinds, which one distribution does not describe; read those of loads with care."
        )


def _fits(section, data, fits) -> None:
    """Largest values of the seeds over the reduced variate, with the fit and its 95 % band, as far as the storm."""
    if not fits:
        return
    repeats = float(data.attrs.get("repeats", 1.0))
    columns = 2 if len(fits) > 1 else 1
    figure, panels = charts.canvas(-(-len(fits) // columns), columns, height=3.6)
    for panel, (name, values, high, free) in zip(panels, fits, strict=False):
        x = np.sort(values.values[np.isfinite(values.values)])
        n = len(x)
        reduced = -np.log(-np.log((np.arange(1, n + 1) - 0.44) / (n + 0.12)))  # Gringorten (1963)
        location, scale = gumbel_fit(x)
        storm = float(largest_of(0.0, 1.0, repeats)[1])
        line = np.linspace(reduced[0] - 0.3, max(storm, reduced[-1]) + 0.3, 50)
        many = draws(float(location), float(scale), n)
        band = np.quantile(many[0][:, None] + many[1][:, None] * line, (0.025, 0.975), axis=0)
        panel.plot(reduced, x, "o", label="seeds", zorder=3)
        panel.plot(line, location + scale * line, label="fit")
        panel.fill_between(line, *band, alpha=0.2, label="95 % confidence")
        panel.plot(storm, high, "D", color=charts.COLOURS[6], label="storm, 95 of 100", zorder=4)
        if not free:
            panel.axhline(high, color="0.3", linestyle=":", label="end stop")
        panel.set(xlabel="reduced variate -ln(-ln(probability))", ylabel=_units(values))
        panel.set_title(name, loc="left", fontsize=12)
        panel.legend(fontsize=10, frameon=False, loc="upper left")
    for panel in panels[len(fits) :]:
        panel.set_visible(False)
    section.figure(figure, "Largest value of each seed, and the distribution fitted to them", name="extremes")


def parameters_in_words(data) -> str:
    """The parameters of a study in one phrase."""
    return " and ".join(words(data[name]) for name in names_in_order(data)) or "nothing"
